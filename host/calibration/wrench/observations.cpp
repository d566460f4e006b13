// What was recorded -> observations for the fit, and a trial for analysis and certificate.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/core/algebra/decompositions.h"
#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr double kMaxGap = 0.15;  // s between readings that are interpolated
// A hand trembles at 8 to 12 Hz, which the springs and a cell's readings each follow in their own
// way: of a push both are averaged alike, by a raised cosine that is nothing so far from its
// middle (and passes less than 3 % of 8 Hz and above).
constexpr double kPushWindow = 0.25;      // s
constexpr std::size_t kMaxFrames = 1500;  // of pushes and movements in a fit
// A hand leans and sways at half a hertz or so: what is closer together than this is off alike, and
// would be taken for more than it is.
constexpr double kPushEvery = 1.0;  // s
// One lag is sought for all axes, but each mode of the platform follows its load at a delay of its
// own, 2 zeta / omega: with a twentieth of critical damping 0.2 ms at 90 Hz, 1 ms at 15 Hz.
constexpr double kAxisLag = 1e-3;    // s
constexpr double kNoRelation = 0.3;  // mean R^2

/// Of a push's window, from -1 to 1.
double raised_cosine(double off) { return 0.5 + 0.5 * std::cos(std::numbers::pi * off); }

/// Where the records of one zero count from: its rests, in the order of their times, and what
/// drifts between them.
class Baseline {
 public:
  /// `records` may hold other zeros too.
  Baseline(const WrenchPlan& plan, const std::vector<StepRecord>& records, int zero) {
    for (const StepRecord& record : records) {
      if (record.zero != zero || record.frames.empty() ||
          plan.step(record.step).kind != StepKind::rest)
        continue;
      const RecordMean mean = mean_of(record);
      rests_.push_back({mean.time, mean.displacement, mean_reading(record)});
    }
  }

  bool empty() const { return rests_.empty(); }
  /// Displacement of the first rest, m and rad.
  const Vector6& displacement() const { return rests_.front().displacement; }
  /// What the displacement has drifted since then: linear between rests, constant beyond.
  Vector6 drift(double time) const {
    const auto [before, after, share] = between(time);
    return (1 - share) * before.displacement + share * after.displacement - displacement();
  }
  /// Of drift() between two rests: that of a change that may have come at any moment, whose
  /// distribution over the change is uniform.
  Matrix6 drift_covariance(double time) const {
    const auto [before, after, share] = between(time);
    const Vector6 change = after.displacement - before.displacement;
    return change * change.transpose() / 12;
  }
  /// What the reference says when nothing is applied.
  Vector6 reading(double time) const {
    const auto [before, after, share] = between(time);
    return (1 - share) * before.reading + share * after.reading;
  }

 private:
  struct Rest {
    double time = 0;
    Vector6 displacement, reading;
  };
  /// The rests around `time` and the share of the later one.
  struct Between {
    const Rest& before;
    const Rest& after;
    double share;
  };
  Between between(double time) const {
    const auto after = std::ranges::upper_bound(rests_, time, {}, &Rest::time);
    if (after == rests_.begin()) return {*after, *after, 0};
    const Rest& before = *(after - 1);
    if (after == rests_.end()) return {before, before, 0};
    return {before, *after, (time - before.time) / (after->time - before.time)};
  }

  std::vector<Rest> rests_;
};

/// Rows of a trial as they come.
struct Rows {
  std::vector<double> time;
  std::vector<Vector6> value, sigma;
  std::vector<int> step;

  void add(double t, const Vector6& v, const Vector6& s, int of_step) {
    if (!time.empty() && t <= time.back()) return;  // a rest that is both last and first
    time.push_back(t);
    value.push_back(v);
    sigma.push_back(s);
    step.push_back(of_step);
  }
  static Eigen::MatrixXd matrix(const std::vector<Vector6>& rows) {
    Eigen::MatrixXd m(rows.size(), 6);
    for (std::size_t i = 0; i < rows.size(); ++i) m.row(i) = rows[i].transpose();
    return m;
  }
};

class Collector {
 public:
  Collector(const WrenchPlan& plan, const std::vector<StepRecord>& records, double gain_sigma)
      : plan_(plan), records_(records), gain_sigma_(gain_sigma) {
    for (const StepRecord& record : records)
      baselines_.try_emplace(record.zero, plan, records, record.zero);
  }

  WrenchData collect() {
    find_lag();
    std::size_t moving = 0;  // frames
    for (const StepRecord& record : records_) moving += is_hold(record) ? 0 : record.frames.size();
    const std::size_t stride = 1 + moving / kMaxFrames;
    for (const StepRecord& record : records_) {
      const Baseline& baseline = baselines_.at(record.zero);
      if (record.frames.empty() || baseline.empty()) continue;
      for (const TrackedFrame& f : record.frames) data_.path.push_back({f.time, f.displacement});
      if (is_hold(record))
        add_hold(record, baseline);
      else
        add_movement(record, baseline, stride);
    }
    finish_trial();
    if (std::ranges::all_of(data_.observations, [](const auto& o) { return o.wrench.isZero(); }))
      throw ConfigError(
          "no step with a load was recorded, only rests; do the steps that were skipped");
    data_.zero_in_use = records_.front().zero;
    return std::move(data_);
  }

 private:
  const PlanStep& step_of(const StepRecord& record) const { return plan_.step(record.step); }
  bool is_hold(const StepRecord& record) const {
    const StepKind kind = step_of(record).kind;
    return kind == StepKind::rest || kind == StepKind::mass;
  }

  void add_hold(const StepRecord& record, const Baseline& baseline) {
    const RecordMean mean = mean_of(record);
    Observation o{.time = mean.time,
                  .displacement = mean.displacement - baseline.drift(mean.time),
                  .displacement_covariance = mean.covariance,
                  .common = {},
                  .products = {},
                  .step = record.step,
                  .zero = record.zero};
    if (step_of(record).kind == StepKind::mass) {
      o.displacement_covariance += baseline.drift_covariance(mean.time);
      set_hanging(plan_, record.step, mean.displacement, o);
    }
    data_.observations.push_back(o);

    for (const TrackedFrame& f : record.frames) add_reading(record.step, baseline, f);
    if (plan_.reference != ReferenceKind::masses) {
      for (const ReferenceSample& r : record.readings)
        reference_.add(r.time, wrench_of(record, baseline, r), r.sigma, record.step);
      return;
    }
    const Vector6 sigma =
        expected_load(plan_, record.step).covariance.diagonal().cwiseSqrt();  // of a rest none
    for (const TrackedFrame* f : {&record.frames.front(), &record.frames.back()})
      reference_.add(f->time, o.wrench, sigma, record.step);
  }

  /// What a movement showed at a frame, or a push around one, and what the reference said then.
  struct Said {
    const TrackedFrame* frame;
    Vector6 displacement;
    Matrix6 covariance;
    Vector6 value;   ///< counted from the rests
    Vector6 change;  ///< of it, within kAxisLag
    Vector6 noise;
  };

  /// What the reference says, counted from the rests: n x 6, at `times` of frames.
  static Eigen::MatrixXd values_at(const StepRecord& record, const Baseline& baseline,
                                   const Eigen::VectorXd& times, double lag) {
    const Eigen::VectorXd read = times_of(record.readings);
    Eigen::MatrixXd values(read.size(), 6);
    for (Eigen::Index i = 0; i < read.size(); ++i) {
      const ReferenceSample& r = record.readings[i];
      values.row(i) = (r.value - baseline.reading(r.time)).transpose();
    }
    return study::reference_at(times, lag, read, values, kMaxGap);
  }

  std::vector<Said> said_during(const StepRecord& record, const Baseline& baseline,
                                std::size_t stride) const {
    const Eigen::VectorXd times = times_of(record.frames);
    const double lag = data_.lag.value;
    const Eigen::MatrixXd values = values_at(record, baseline, times, lag);
    const Eigen::MatrixXd changes = values_at(record, baseline, times, lag - kAxisLag / 2) -
                                    values_at(record, baseline, times, lag + kAxisLag / 2);
    const bool push = step_of(record).kind == StepKind::push;
    const double reach = push ? kPushWindow : 0;
    double next = times[0] + reach;
    std::vector<Said> out;
    for (Eigen::Index i = 0; i < times.size(); i += static_cast<Eigen::Index>(stride)) {
      if (times[i] < next || times[i] + reach > times[times.size() - 1]) continue;
      const Said said = said_around(record, i, reach, values, changes);
      if (!said.value.allFinite() || !said.change.allFinite()) continue;
      if (push) next = times[i] + kPushEvery;
      out.push_back(said);
    }
    return out;
  }

  Said said_around(const StepRecord& record, Eigen::Index middle, double reach,
                   const Eigen::MatrixXd& values, const Eigen::MatrixXd& changes) const {
    const auto frame = [&](Eigen::Index i) -> const TrackedFrame& { return record.frames[i]; };
    const double time = frame(middle).time;
    Eigen::Index from = middle, to = middle + 1;
    while (from > 0 && time - frame(from - 1).time < reach) --from;
    while (to < values.rows() && frame(to).time - time < reach) ++to;
    Eigen::VectorXd weight(to - from);
    for (Eigen::Index i = from; i < to; ++i) {
      const double off = i == middle ? 0 : (frame(i).time - time) / reach;
      weight[i - from] = raised_cosine(off);
    }
    weight /= weight.sum();
    Said said{.frame = &frame(middle),
              .displacement = Vector6::Zero(),
              .covariance = Matrix6::Zero(),
              .value = values.middleRows(from, to - from).transpose() * weight,
              .change = changes.middleRows(from, to - from).transpose() * weight,
              .noise = record.readings.front().sigma * weight.norm()};
    for (Eigen::Index i = from; i < to; ++i) {
      said.displacement += weight[i - from] * frame(i).displacement;
      said.covariance += weight[i - from] * weight[i - from] * frame(i).covariance;
    }
    // What the lag may be off shifts the value along its slope.
    const Vector6 slope = data_.lag.sigma / kAxisLag * said.change;
    said.noise = (said.noise.cwiseAbs2() + slope.cwiseAbs2()).cwiseSqrt();
    return said;
  }

  /// What the platform's own displacement says of the values: without noise and what is faster than
  /// the springs follow, which an error that many observations share would otherwise explain.
  static Eigen::MatrixXd smooth(const std::vector<Said>& said) {
    const auto n = static_cast<Eigen::Index>(said.size());
    Eigen::MatrixXd X(n, 7), V(n, 6);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Said& s = said[i];
      X.row(i) << s.displacement.transpose(), 1;
      V.row(i) = s.value.transpose();
    }
    for (Eigen::Index c = 0; c < 6; ++c) X.col(c) /= std::max(X.col(c).norm(), 1e-12);
    return X * least_squares(X, V).x;
  }

  void set_load(int step, const Vector6& value, const Vector6& noise, const Vector6& displacement,
                Observation& o) const {
    if (plan_.reference == ReferenceKind::load_cell)
      set_push(plan_, step, {value[0], noise[0], gain_sigma_}, displacement, o);
    else
      set_six_axis(plan_, value, noise, o);
  }

  void add_movement(const StepRecord& record, const Baseline& baseline, std::size_t stride) {
    for (const ReferenceSample& r : record.readings)
      reference_.add(r.time, wrench_of(record, baseline, r), r.sigma, record.step);
    for (const TrackedFrame& f : record.frames) add_reading(record.step, baseline, f);
    const std::vector<Said> said = said_during(record, baseline, stride);
    const Eigen::MatrixXd smoothed = smooth(said);
    for (std::size_t i = 0; i < said.size(); ++i) {
      const Said& s = said[i];
      Observation o{.time = s.frame->time,
                    .displacement = s.displacement - baseline.drift(s.frame->time),
                    .displacement_covariance = s.covariance,
                    .common = {},
                    .products = {},
                    .step = record.step,
                    .zero = record.zero};
      set_load(record.step, s.value, s.noise, s.displacement, o);
      Observation change;
      set_load(record.step, s.change, s.noise, s.displacement, change);
      o.wrench_covariance.diagonal() += change.wrench.cwiseAbs2();
      Observation shared;
      set_load(record.step, smoothed.row(i).transpose(), s.noise, s.displacement, shared);
      o.common = std::move(shared.common);
      o.products = std::move(shared.products);
      data_.observations.push_back(std::move(o));
    }
  }

  void add_reading(int step, const Baseline& baseline, const TrackedFrame& f) {
    readings_.add(f.time, f.displacement - baseline.drift(f.time) - baseline.displacement(),
                  f.covariance.diagonal().cwiseSqrt(), step);
  }

  /// What a reading stands for, about the platform origin at rest.
  Vector6 wrench_of(const StepRecord& record, const Baseline& baseline,
                    const ReferenceSample& r) const {
    const Vector6 value = r.value - baseline.reading(r.time);
    if (plan_.reference == ReferenceKind::six_axis) return six_axis_wrench(plan_, value);
    if (step_of(record).kind != StepKind::push) return Vector6::Zero();
    const auto frame =
        std::ranges::lower_bound(record.frames, r.time + data_.lag.value, {}, &TrackedFrame::time);
    const TrackedFrame& at = frame == record.frames.end() ? record.frames.back() : *frame;
    Observation o;
    set_push(plan_, record.step, {value[0], 0, 0}, at.displacement, o);
    return o.wrench;
  }

  void find_lag() {
    std::vector<study::Segment> segments;
    for (const StepRecord& record : records_) {
      const Baseline& baseline = baselines_.at(record.zero);
      if (is_hold(record) || record.frames.empty() || baseline.empty()) continue;
      study::Segment s;
      s.time = times_of(record.frames);
      s.features.resize(s.time.size(), 6);
      for (Eigen::Index i = 0; i < s.time.size(); ++i)
        s.features.row(i) = record.frames[i].displacement.transpose();
      s.reference_time = times_of(record.readings);
      s.reference.resize(s.reference_time.size(), 6);
      for (Eigen::Index i = 0; i < s.reference_time.size(); ++i)
        s.reference.row(i) = wrench_of(record, baseline, record.readings[i]).transpose();
      segments.push_back(std::move(s));
    }
    if (segments.empty()) return;
    data_.lag = study::estimate_lag(segments);
    if (data_.lag.known && data_.lag.explained >= kNoRelation) return;
    throw ConfigError(
        "what the reference said has nothing to do with how the platform moved, at no lag; is it "
        "the instrument that this sensor was pushed with, and on the same clock?");
  }

  void finish_trial() {
    study::Trial& trial = data_.trial;
    trial.name = plan_.name;
    trial.time = Eigen::VectorXd::Map(readings_.time.data(), readings_.time.size());
    trial.features = Rows::matrix(readings_.value);
    trial.feature_sigma = Rows::matrix(readings_.sigma);
    trial.feature_names = study::displacement_names();
    trial.step = Eigen::Map<const Eigen::VectorXi>(
        readings_.step.data(), static_cast<Eigen::Index>(readings_.step.size()));
    trial.reference_time = Eigen::VectorXd::Map(reference_.time.data(), reference_.time.size());
    trial.reference = Rows::matrix(reference_.value);
    trial.reference_sigma = Rows::matrix(reference_.sigma);
    trial.held = plan_.reference == ReferenceKind::masses;
  }

  const WrenchPlan& plan_;
  const std::vector<StepRecord>& records_;
  double gain_sigma_;
  std::map<int, Baseline> baselines_;
  Rows readings_;
  Rows reference_;
  WrenchData data_;
};

/// At the frame in the middle of a push's window, which `rows` are. What it says beside the mean
/// has an error of its own: that of the frame, and how far platform and cell follow a hand's tremor
/// apart, which is what they scatter against each other within the window.
void predict_push(const Matrix6& K, const Eigen::MatrixXd& felt, double time,
                  const std::vector<Eigen::Index>& rows, const HeldOut& held, study::Trial& trial) {
  Eigen::VectorXd weight(rows.size());
  Eigen::Index middle = rows.front();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double off = (trial.time[rows[i]] - time) / kPushWindow;
    weight[i] = raised_cosine(off);
    if (off == 0) middle = rows[i];
  }
  weight /= weight.sum();
  const Eigen::MatrixXd seen = trial.features(rows, Eigen::all) * K.transpose();
  const Eigen::MatrixXd apart = felt(rows, Eigen::all) - seen;
  const Eigen::RowVectorXd mean = weight.transpose() * apart;
  const Vector6 scatter = ((apart.rowwise() - mean).cwiseAbs2().transpose() * weight).cwiseMax(0.0);
  const Eigen::RowVectorXd seen_mean = weight.transpose() * seen;
  trial.predicted.row(middle) =
      held.predicted.transpose() + trial.features.row(middle) * K.transpose() - seen_mean;
  trial.predicted_sigma.row(middle) = (held.sigma.cwiseAbs2() + scatter).cwiseSqrt().transpose();
}

}  // namespace

WrenchData collect(const WrenchPlan& plan, const std::vector<StepRecord>& records,
                   double cell_gain_sigma) {
  if (records.empty()) throw ConfigError("nothing was recorded; do at least one step with a load");
  return Collector(plan, records, cell_gain_sigma).collect();
}

void add_predictions(const WrenchPlan& plan, const WrenchFit& fit, WrenchData& data) {
  study::Trial& trial = data.trial;
  const Eigen::Index n = trial.time.size();
  trial.predicted.setConstant(n, 6, std::nan(""));
  trial.predicted_sigma.setConstant(n, 6, std::nan(""));
  Eigen::MatrixXd felt;
  if (plan.reference == ReferenceKind::load_cell) {
    felt = study::reference_at(trial.time, data.lag.value, trial.reference_time, trial.reference,
                               kMaxGap);
  }
  for (const HeldOut& held : fit.held_out) {
    const Observation& o = data.observations[held.observation];
    const StepKind kind = plan.step(o.step).kind;
    const bool hold = kind == StepKind::rest || kind == StepKind::mass;
    const bool push = kind == StepKind::push;
    const double reach = push ? kPushWindow : 0;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < n; ++i)
      if (trial.step[i] == o.step && (hold || std::abs(trial.time[i] - o.time) <= reach))
        rows.push_back(i);
    if (rows.empty()) continue;
    if (push) {
      predict_push(fit.model.K, felt, o.time, rows, held, trial);
      continue;
    }
    const Eigen::RowVectorXd mean = trial.features(rows, Eigen::all).colwise().mean();
    for (const Eigen::Index row : rows) {
      const Vector6 apart = (trial.features.row(row) - mean).transpose();
      trial.predicted.row(row) = (held.predicted + fit.model.K * apart).transpose();
      // Its own noise beside that of the hold's mean; of a single frame the fit has counted it.
      Vector6 variance = held.sigma.cwiseAbs2();
      if (hold) {
        const Vector6 own = trial.feature_sigma.row(row).transpose();
        variance += fit.model.K.cwiseAbs2() * own.cwiseAbs2();
      }
      trial.predicted_sigma.row(row) = variance.cwiseSqrt().transpose();
    }
  }
}

}  // namespace tagwrench

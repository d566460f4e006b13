#include "host/calibration/wrench/guide.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

using Line = GuideLine::Kind;

constexpr double kOtherClock = 1.0;  // s between what a reading says and when it came
constexpr double kKeep = 3.0;        // s of readings
constexpr double kWellCovered = 0.95;
constexpr const char* kSilent = "nothing comes from the reference; look at its plug and its power";
constexpr double kTouch = 0.1;    // of a push's force: it has begun
constexpr double kFree = 0.05;    // of it: nobody pushes
constexpr double kBegun = 0.05;   // of the range: a movement has begun
constexpr double kExcited = 0.1;  // of the range, standard deviation over a movement
constexpr double kMax = 1.5;      // times its seconds: a movement ends, whatever it has shown

constexpr double kMoved = 0.02;  // of the range: more than this is somebody's doing
constexpr double kBump = 0.01;   // of the range: a rest may differ by so much from the one before
constexpr int kMaxBumps = 6;     // unattended
constexpr double kOwnWeight = 0.03;  // of the range: less does not tell how the sensor lies
constexpr double kTimeToAct = 8.0;   // s that a person has before it is said, or taken as done
// All loads count from the rests: what is steady must have become so before the second that is
// taken began, else the last of a push or of a swing is in it.
constexpr double kSettled = 0.5;  // s

/// Part of `felt` along `expected`, and the cosine between them.
struct Likeness {
  double ratio = 0, cosine = 0;
};
Likeness likeness(const Vector6& felt, const Vector6& expected) {
  const double dot = felt.dot(expected), norms = felt.norm() * expected.norm();
  return {dot / expected.squaredNorm(), norms > 0 ? dot / norms : 0};
}

std::string axes_text(const Vector6& scaled) {
  std::string out;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(scaled[i]) > 0.3 * scaled.cwiseAbs().maxCoeff())
      out +=
          fmt::format("{}{} {:+.0f} %", out.empty() ? "" : ", ", wrench_axis(i), 100 * scaled[i]);
  }
  return out;
}

}  // namespace

WrenchGuide::WrenchGuide(const WrenchPlan& plan, const GuideOptions& options)
    : plan_(plan),
      options_(options),
      hold_({.seconds = options.hold, .stiffness = options.stiffness, .range = options.range}),
      coverage_(options.range) {
  for (std::size_t i = 0; i < plan.steps.size(); ++i) todo_.push_back(static_cast<int>(i));
  ask();
}

/// Says what is to be done now, to the person and to whoever watches asks().
void WrenchGuide::ask() {
  phase_ = Phase::waiting;
  moved_ = let_go_ = repeated_ = false;
  asked_at_.reset();
  asked_time_.reset();
  complaint_.clear();
  steady_since_.reset();
  taking_ = {};
  reminded_ = now_;
  if (todo_.empty()) return;
  ++asks_;
  const bool turn = step().mounting != mounting_;
  mounting_ = step().mounting;
  say(Line::task, instruction(plan_, todo_.front(), turn));
}

/// The present step once more, from the beginning.
void WrenchGuide::again(const std::string& why) {
  ++attempts_;
  if (options_.attempts > 0 && attempts_ >= options_.attempts) {
    leave_out(why);
    return;
  }
  say(Line::warning, fmt::format("{}: {}; once more", describe(plan_, todo_.front()), why));
  ask();
  repeated_ = true;
}

void WrenchGuide::leave_out(const std::string& why) {
  say(Line::warning, fmt::format("{} is left out: {}", describe(plan_, todo_.front()), why));
  skip();
}

/// Said once; an unattended run that `counts` it tries again.
void WrenchGuide::complain(const std::string& why, bool counts) {
  if (why == complaint_) return;
  if (counts && options_.attempts > 0) {
    again(why);
    return;
  }
  complaint_ = why;
  say(Line::warning, fmt::format("{}: {}", describe(plan_, todo_.front()), why));
}

/// Another run's clock may have been another one: what it recorded comes before all of this one.
void WrenchGuide::put_before(double time) {
  constexpr double kBetween = 60;
  double latest = 0;
  for (const StepRecord& record : records_) latest = std::max(latest, record.frames.back().time);
  const double shift = std::min(0.0, time - kBetween - latest);
  for (StepRecord& record : records_) {
    for (TrackedFrame& frame : record.frames) frame.time += shift;
    for (ReferenceSample& sample : record.readings) sample.time += shift;
  }
}

void WrenchGuide::frame(double time, const Track& track) {
  if (resumed_) put_before(time);
  resumed_ = false;
  now_ = time;
  if (!first_frame_) first_frame_ = time;
  if (done()) return;
  if (!asked_time_) asked_time_ = reminded_ = time;
  while (!readings_.empty() && readings_.front().time < time - kKeep - options_.hold)
    readings_.pop_front();
  if (track.status != Status::ok) {
    hold_.clear();
    moved_ = true;  // what is not seen may have moved
    watch_patience(time);
    return;
  }
  hold_.add({time, track.displacement, track.covariance});
  if (!asked_at_) asked_at_ = track.displacement;
  if (step().kind == StepKind::push)
    watch_push(time);
  else if (step().kind == StepKind::six_axis)
    watch_movement(time);
  else
    watch_hold();
  if (!done()) watch_patience(time);
}

void WrenchGuide::reading(const ReferenceSample& sample) {
  if (failed() || !first_frame_) return;
  if (std::abs(sample.time - now_) > kOtherClock) {
    // They may have waited while the camera started.
    if (now_ - *first_frame_ < 2 * kOtherClock && sample.time < *first_frame_) return;
    failure_ = fmt::format(
        "the reference's times are {:.1f} s away from the frames': it is on another clock; give "
        "both the same, or restart the reference",
        sample.time - now_);
    return;
  }
  last_reading_ = sample;
  readings_.push_back(sample);
  if (phase_ == Phase::taking) taking_.readings.push_back(sample);
}

// ---- Pushes and movements ----

/// What a push or a movement counts from; nullptr, and said, where there is nothing to count from
/// or to be counted.
const StepRecord* WrenchGuide::rest_of_reference(double time) {
  const StepRecord* rest = last_rest();
  if (rest == nullptr) {
    leave_out("there is no rest to count it from");
    return nullptr;
  }
  if (last_reading_ && time - last_reading_->time <= kMaxSilence) return rest;
  phase_ = Phase::waiting;
  complain(kSilent, false);
  return nullptr;
}

void WrenchGuide::watch_push(double time) {
  const StepRecord* rest = rest_of_reference(time);
  if (rest == nullptr) return;
  const double force = std::abs(last_reading_->value[0] - mean_reading(*rest)[0]);
  if (phase_ == Phase::waiting) {
    let_go_ = let_go_ || force < kFree * step().force;
    if (!let_go_ || force < kTouch * step().force) return;
    begin_taking(time);
  }
  taking_.frames.push_back(hold_.frames().back());
  if (time - begun_ >= step().seconds) finish_taking();
}

void WrenchGuide::watch_movement(double time) {
  const StepRecord* rest = rest_of_reference(time);
  if (rest == nullptr) return;
  const Vector6 zero = mean_of(*rest).displacement;
  const TrackedFrame& frame = hold_.frames().back();
  if (phase_ == Phase::waiting) {
    if (hold_.scaled(frame.displacement - zero).cwiseAbs().maxCoeff() < kBegun) return;
    begin_taking(time);
  }
  taking_.frames.push_back(frame);
  const double length = time - begun_;
  if (length < step().seconds) return;
  Vector6 squares = Vector6::Zero();
  for (const TrackedFrame& f : taking_.frames)
    squares += hold_.scaled(f.displacement - zero).cwiseAbs2();
  const Vector6 deviation = (squares / static_cast<double>(taking_.frames.size())).cwiseSqrt();
  int weakest = 0;
  if (deviation.minCoeff(&weakest) > kExcited || length > kMax * step().seconds) {
    finish_taking();
    return;
  }
  complain(fmt::format("go on, and more of {}: it was hardly moved", wrench_axis(weakest)), false);
}

void WrenchGuide::begin_taking(double time) {
  phase_ = Phase::taking;
  begun_ = time;
  taking_ = {todo_.front(), 0, {}, {}};
  for (const ReferenceSample& sample : readings_)
    if (sample.time > time - kReadingsBeforeTaking) taking_.readings.push_back(sample);
}

void WrenchGuide::finish_taking() {
  const ReferenceFinding found =
      check_reference(plan_, taking_, *last_rest(), options_.stiffness, options_.range);
  using Verdict = ReferenceFinding::Verdict;
  if (found.verdict == Verdict::fine)
    accept(std::move(taking_));
  else if (found.verdict == Verdict::again)
    again(found.text);
  else
    failure_ = found.text;
}

// ---- Going on ----

/// Of this visit of the mounting; a stopped and resumed one too.
const StepRecord* WrenchGuide::last_rest() const {
  for (auto r = records_.rbegin(); r != records_.rend(); ++r) {
    if (step_of(*r).visit != step().visit) return nullptr;
    if (step_of(*r).kind == StepKind::rest) return &*r;
  }
  return nullptr;
}

void WrenchGuide::accept(StepRecord record) {
  const StepRecord* rest = last_rest();
  const bool new_zero = rest == nullptr || new_zero_;
  record.zero = new_zero ? zeros_++ : rest->zero;
  new_zero_ = false;
  attempts_ = 0;
  records_.push_back(std::move(record));
  todo_.pop_front();
  recount();
  const StepRecord& latest = records_.back();
  say(Line::note, "accepted: " + describe(plan_, latest.step));
  if (step_of(latest).kind != StepKind::rest) {
    const bool open = coverage_.covered().minCoeff() < kWellCovered;
    say(Line::note, "covered:  " + coverage_bar(coverage_) + (open ? most_useful() : ""));
  }
  ask();
}

void WrenchGuide::recount() {
  coverage_ = WrenchCoverage(options_.range);
  const StepRecord* rest = nullptr;
  for (const StepRecord& record : records_) {
    if (step_of(record).kind == StepKind::rest) rest = &record;
    if (step_of(record).kind != StepKind::six_axis) {
      coverage_.add(expected_load(plan_, record.step));
    } else if (rest != nullptr) {
      const Eigen::MatrixXd w = reference_wrenches(plan_, record, *rest);
      const Eigen::MatrixXd off = w.rowwise() - w.colwise().mean();
      coverage_.add_movement(off.transpose() * off / static_cast<double>(w.rows()));
    }
  }
}

void WrenchGuide::skip() {
  if (done()) return;
  const bool first_rest = step().kind == StepKind::rest && last_rest() == nullptr;
  const int visit = step().visit;
  const std::string name = describe(plan_, todo_.front());
  do {  // without a rest, the loads that follow count from nothing
    skipped_.push_back(todo_.front());
    todo_.pop_front();
  } while (first_rest && !todo_.empty() && step().visit == visit && step().kind != StepKind::rest);
  attempts_ = 0;
  WrenchCoverage all = coverage_;  // if nothing else were skipped
  for (const int s : todo_) all.add_expected(plan_, s);
  const std::string missing = fmt::format("{}", fmt::join(all.missing(), "; "));
  say(missing.empty() ? Line::note : Line::warning,
      fmt::format("skipped: {}{}", name, missing.empty() ? "" : "; then " + missing));
  ask();
}

void WrenchGuide::redo() {
  if (failed()) return;
  if (records_.empty()) {
    ask();
    return;
  }
  todo_.push_front(records_.back().step);
  records_.pop_back();
  attempts_ = 0;
  recount();
  ask();
  repeated_ = true;
}

void WrenchGuide::resume(std::vector<StepRecord> records, const std::vector<int>& skipped) {
  records_ = std::move(records);
  std::erase_if(records_, [](const StepRecord& record) { return record.frames.empty(); });
  skipped_ = skipped;
  resumed_ = true;
  std::erase_if(todo_, [&](int s) {
    return std::ranges::find(records_, s, &StepRecord::step) != records_.end() ||
           std::ranges::find(skipped, s) != skipped.end();
  });
  for (const StepRecord& record : records_) zeros_ = std::max(zeros_, record.zero + 1);
  // The sensor may have been moved meanwhile: a rest shows it before anything else is loaded.
  const bool rest_again = !todo_.empty() && !records_.empty() && step().kind != StepKind::rest &&
                          step_of(records_.back()).visit == step().visit;
  if (rest_again) todo_.push_front(last_rest()->step);
  recount();
  lines_.clear();
  if (rest_again)
    say(Line::note, "the rest of this position is taken again: the sensor may have been moved");
  asks_ = 0;
  ask();
}

void WrenchGuide::watch_patience(double time) {
  if (phase_ == Phase::taking || time - reminded_ < options_.patience) return;
  reminded_ = time;
  if (options_.attempts > 0)
    again("nothing came of it: " + waiting_for());
  else
    say(Line::note,
        fmt::format("waiting: {} ({})", waiting_for(), instruction(plan_, todo_.front(), false)));
}

// What the guide says about how far it is.

std::string coverage_bar(const WrenchCoverage& coverage) {
  constexpr int kLength = 5;
  const Vector6 covered = coverage.covered();
  std::string out;
  for (int i = 0; i < 6; ++i) {
    const int full = std::clamp(static_cast<int>(kLength * covered[i] + 0.5), 0, kLength);
    out += fmt::format("{}{} {}{}", i == 0 ? "" : " ", wrench_axis(i),
                       std::string(static_cast<std::size_t>(full), '#'),
                       std::string(static_cast<std::size_t>(kLength - full), '.'));
  }
  return out;
}

std::string WrenchGuide::most_useful() const {
  const auto gain = [&](int s) { return coverage_.gain(expected_load(plan_, s)); };
  const auto which = std::ranges::max_element(todo_, {}, gain);
  if (which == todo_.end() || !(gain(*which) > 0)) return "";
  return fmt::format("; of the steps left, {} tells most ({:.0f} % of what is open)",
                     describe(plan_, *which), 100 * gain(*which));
}

std::string WrenchGuide::waiting_for() const {
  if (hold_.frames().empty()) return "the tags are not seen";
  const Hold hold = hold_.look();
  const bool of_hold = step().kind == StepKind::rest || step().kind == StepKind::mass;
  if (!of_hold) {
    if (phase_ == Phase::taking)
      return fmt::format("{:.0f} s of {:.0f} s", now_ - begun_, step().seconds);
    return step().kind == StepKind::push && !let_go_ ? "take the cell off first"
                                                     : "begin when you are ready";
  }
  if (!complaint_.empty()) return complaint_;
  if (hold.unrest > 1)
    return fmt::format("not steady yet: {:.1f} times too much in {}", hold.unrest,
                       wrench_axis(hold.worst));
  if (!hold.full) return fmt::format("steady for {:.1f} s", hold.to - hold.from);
  return step().kind == StepKind::rest ? "nothing has moved yet" : "nothing hangs there yet";
}

std::string WrenchGuide::live() const {
  if (done()) return "done";
  return fmt::format("step {}/{}: {}  {}", todo_.front() + 1, plan_.steps.size(), waiting_for(),
                     coverage_bar(coverage_));
}

// The guide at rests and masses: what is steady, and whether it is what the step asks for.

void WrenchGuide::watch_hold() {
  const Hold hold = hold_.look();
  const bool of_cell = plan_.reference != ReferenceKind::masses;
  if (of_cell && !(last_reading_ && now_ - last_reading_->time < kMaxSilence)) {
    if (now_ - *asked_time_ > 2 * kMaxSilence) complain(kSilent, false);
    return;
  }
  const bool had_moved = moved_;
  // Whether anything has happened to the platform since it was asked for.
  const Vector6 way = hold_.scaled(hold_.frames().back().displacement - *asked_at_);
  moved_ = moved_ || way.cwiseAbs().maxCoeff() > kMoved || hold.unrest > 3;
  const bool as_it_hangs = repeated_ && now_ - *asked_time_ > kTimeToAct;  // it may be right
  if (moved_ && !had_moved) {  // what was steady until now is what was asked for before
    hold_.clear();
    steady_since_.reset();
    return;
  }
  if (!hold.steady) {
    steady_since_.reset();
    return;
  }
  if (!steady_since_) steady_since_ = now_;
  if (step().kind == StepKind::mass) {
    if (moved_ || as_it_hangs) watch_mass(hold);
    return;
  }
  // The first rest of a mounting comes after the sensor was turned, but for the very first one.
  const bool settled = now_ - *steady_since_ >= kSettled;
  if (settled && (last_rest() != nullptr || moved_ || as_it_hangs || asks_ == 1)) watch_rest(hold);
}

void WrenchGuide::watch_rest(const Hold& hold) {
  const StepRecord* before = last_rest();
  if (before == nullptr) {
    if (check_mounting(hold)) accept_hold();
    return;
  }
  const Vector6 by = hold_.scaled(hold.mean - mean_of(*before).displacement);
  const StepRecord& latest = records_.back();
  if (step_of(latest).kind == StepKind::mass) {
    const KnownLoad load = expected_load(plan_, latest.step);
    const Likeness mass = likeness(by, load.wrench.cwiseQuotient(options_.range));
    if (mass.cosine > 0.8 && mass.ratio > 0.3) {
      if (now_ - *asked_time_ < kTimeToAct) return;
      complain("the weight still hangs there; take it off", false);
      return;
    }
  }
  if (by.cwiseAbs().maxCoeff() > kBump)
    take_again_from_rest(by);
  else
    accept_hold();
}

/// The platform's own weight tells how the sensor lies, once it is turned from how it lay first.
bool WrenchGuide::check_mounting(const Hold& hold) {
  if (records_.empty() || step_of(records_.front()).kind != StepKind::rest) return true;
  const auto gravity = [&](const PlanStep& s) { return plan_.mounting_of(s).gravity; };
  Vector6 expected = Vector6::Zero();
  expected.head<3>() = (gravity(step()) - gravity(step_of(records_.front())))
                           .cwiseQuotient(options_.range.head<3>());
  Vector6 felt = hold_.scaled(hold.mean - mean_of(records_.front()).displacement);
  felt.tail<3>().setZero();
  if (expected.norm() < 1e-6 || felt.norm() < kOwnWeight) return true;
  if (likeness(felt, expected).cosine > 0.6) return true;
  complain(fmt::format("the platform's own weight pulls elsewhere than in this mounting ({}): the "
                       "sensor lies otherwise than the plan says",
                       axes_text(felt)),
           true);
  return false;
}

void WrenchGuide::watch_mass(const Hold& hold) {
  const StepRecord* rest = last_rest();
  if (rest == nullptr) {
    leave_out("there is no rest to count it from");
    return;
  }
  const Vector6 felt = hold_.scaled(hold.mean - mean_of(*rest).displacement);
  const Vector6 expected = expected_load(plan_, todo_.front()).wrench.cwiseQuotient(options_.range);
  const Likeness load = likeness(felt, expected);
  if (felt.norm() < 0.2 * expected.norm()) return;  // nothing hangs yet
  if (load.cosine < -0.5) {
    complain(fmt::format("it pulls the opposite way ({}): gravity or the point of the plan is "
                         "other than how it hangs",
                         axes_text(felt)),
             true);
  } else if (load.cosine < 0.6) {
    complain(fmt::format("it pulls elsewhere ({}) than the plan says ({}): gravity or the point of "
                         "the plan is other than how it hangs",
                         axes_text(felt), axes_text(expected)),
             true);
  } else if (load.ratio < 0.3 || load.ratio > 3) {
    complain(fmt::format("it pulls as {:.0f} g would: is it the weight that the plan says?",
                         1e3 * step().mass * load.ratio),
             true);
  } else {
    accept_hold();
  }
}

void WrenchGuide::accept_hold() {
  StepRecord record{todo_.front(), 0, hold_.frames(), {}};
  for (const ReferenceSample& sample : readings_)
    if (sample.time >= record.frames.front().time && sample.time <= record.frames.back().time)
      record.readings.push_back(sample);
  accept(std::move(record));
}

/// The rest is not where it was: what was measured since counts from nowhere.
void WrenchGuide::take_again_from_rest(const Vector6& by) {
  std::vector<int> lost;
  const StepRecord* rest = last_rest();
  while (&records_.back() != rest) {
    lost.insert(lost.begin(), records_.back().step);
    records_.pop_back();
  }
  int axis = 0;
  const double worst = by.cwiseAbs().maxCoeff(&axis);
  std::string text = fmt::format(
      "the rest is {:.1f} % of full load in {} from where it was: the sensor was bumped, or a tag "
      "has slipped",
      100 * worst, wrench_axis(axis));
  if (options_.attempts > 0 && ++bumps_ > kMaxBumps) {
    failure_ = text + " again and again; fix it better";
    return;
  }
  if (!lost.empty()) {
    text += "; to be done again:";
    for (const int s : lost)
      text += fmt::format(" {}{}", describe(plan_, s), s == lost.back() ? "" : ",");
    lost.push_back(todo_.front());
    todo_.insert(todo_.begin() + 1, lost.begin(), lost.end());
  }
  say(Line::warning, text);
  new_zero_ = true;
  accept_hold();
}

}  // namespace tagwrench

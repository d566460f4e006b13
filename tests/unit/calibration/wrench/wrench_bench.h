// A platform on springs without a camera: loads in, tracks out, for the tests of the guide. Plays a
// person who does what is asked.
#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/plan.h"

namespace tagwrench::test {

/// The paper's springs, about the tags' midpoint: four of 700 and 70 N/m at (+-7.5, +-6.5, -10.9)
/// mm.
inline Matrix6 paper_stiffness() {
  Matrix6 K = Matrix6::Zero();
  for (const double x : {-7.5e-3, 7.5e-3}) {
    for (const double y : {-6.5e-3, 6.5e-3}) {
      Eigen::Matrix3d arm;
      const double z = -10.9e-3;
      arm << 0, -z, y, z, 0, -x, -y, x, 0;
      Eigen::Matrix<double, 3, 6> moves;
      moves << Eigen::Matrix3d::Identity(), -arm;
      K += moves.transpose() * Eigen::Vector3d(70, 70, 700).asDiagonal() * moves;
    }
  }
  K.diagonal().tail<3>() += Eigen::Vector3d(0.0129, 0.0129, 0.0148);
  return K;
}

inline Vector6 paper_range() {
  return (Vector6() << 0.9, 0.9, 2.5, 0.016, 0.016, 0.009).finished();
}

inline GuideOptions paper_options(int attempts = 3) {
  GuideOptions options;
  options.stiffness = paper_stiffness();
  options.range = paper_range();
  options.attempts = attempts;
  return options;
}

/// Standard deviations of the tracker, m and rad.
inline Vector6 tracker_noise() {
  return (Vector6() << 3e-8, 3e-8, 3e-7, 3e-5, 3e-5, 2e-5).finished();
}

class HandsOn {
 public:
  HandsOn(const WrenchPlan& plan, WrenchGuide& guide) : plan_(plan), guide_(guide) {}

  // What goes otherwise than it should.
  std::function<Vector6(int step, int ask)> bump = [](int, int) {
    return Vector6(Vector6::Zero());
  };
  std::function<double(int step)> mass_factor = [](int) { return 1.0; };
  double cell_sign = 1;
  double reading_offset = 0;  ///< s of the reference's clock
  double lag = 0.03;          ///< s by which readings of the reference come late
  double silent_from = 1e9;   ///< s
  bool unrelated = false;     ///< the reference is another's
  double gravity_sign = 1;    ///< of the masses

  /// Until the guide is done, or `seconds` have passed.
  void play(double seconds = 2000) {
    const double end = time_ + seconds;
    while (!guide_.done() && time_ < end) frame();
  }
  void play_until(const std::function<bool()>& enough, double seconds = 2000) {
    const double end = time_ + seconds;
    while (!guide_.done() && !enough() && time_ < end) frame();
  }
  /// All that was said.
  std::vector<GuideLine> said;
  bool told(const std::string& part) {
    for (const GuideLine& line : said) {
      if (line.text.find(part) != std::string::npos) return true;
    }
    return false;
  }
  double time() const { return time_; }

 private:
  static constexpr double kPeriod = 0.04;
  static constexpr double kReaction = 0.5;

  void frame() {
    time_ += kPeriod;
    if (guide_.asks() != ask_) obey();
    const double since = time_ - asked_;
    const Vector6 load = load_at(since);
    Track track;
    track.status = Status::ok;
    track.displacement = paper_stiffness().ldlt().solve(load) + rest_;
    for (int i = 0; i < 6; ++i) track.displacement[i] += tracker_noise()[i] * normal_(random_);
    track.covariance = tracker_noise().cwiseAbs2().asDiagonal();
    for (; next_reading_ <= time_; next_reading_ += 0.0125) {
      if (next_reading_ > silent_from) continue;
      const double then = next_reading_ - lag - asked_;
      ReferenceSample sample;
      sample.time = next_reading_ + reading_offset;
      sample.sigma.setConstant(1e-3);
      if (plan_.reference == ReferenceKind::load_cell)
        sample.value[0] = 0.3 + cell_sign * (unrelated ? 0.5 * normal_(random_) : push_at(then));
      else
        sample.value = six_axis_at(then);
      sample.value += 1e-4 * Vector6::Constant(normal_(random_));
      guide_.reading(sample);
    }
    guide_.frame(time_, track);
    for (GuideLine line; guide_.next(line);) said.push_back(line);
  }

  void obey() {
    ask_ = guide_.asks();
    before_ = load_at(time_ - asked_);
    asked_ = time_;
    step_ = guide_.asked();
    rest_ += bump(step_, ask_);
  }
  const PlanStep& step() const { return plan_.steps[static_cast<std::size_t>(step_)]; }

  /// The platform's own weight of 10 g at 4 mm, counted from how it stands, and what hangs.
  Vector6 load_at(double since) const {
    const double share = std::clamp((since - kReaction) / 0.4, 0.0, 1.0);
    return (1 - share) * before_ + share * target(since);
  }
  Vector6 target(double since) const {
    if (step_ < 0) return Vector6::Zero();
    const Eigen::Vector3d gravity =
        plan_.mountings[static_cast<std::size_t>(step().mounting)].gravity;
    const Eigen::Vector3d own = 0.098 * (gravity + Eigen::Vector3d::UnitZ());
    Vector6 load;
    load << own, Eigen::Vector3d(0, 0, 4e-3).cross(own);
    Observation known;
    if (step().kind == StepKind::mass) {
      set_hanging(plan_, step_, Vector6::Zero(), known);
      const double swing = 0.05 * std::exp(-(since - kReaction) / 0.8) * std::sin(9 * since);
      load += gravity_sign * mass_factor(step_) * (1 + swing) * known.wrench;
    } else if (step().kind == StepKind::push) {
      set_push(plan_, step_, {push_at(since), 0, 0}, Vector6::Zero(), known);
      load += known.wrench;
    } else if (step().kind == StepKind::six_axis) {
      load += six_axis_wrench(plan_, six_axis_at(since));
    }
    return load;
  }
  double push_at(double since) const {
    if (step_ < 0 || step().kind != StepKind::push) return 0;
    const double t = since - kReaction;
    if (t < 0 || t > step().seconds) return 0;
    return step().force * std::pow(std::sin(3 * std::numbers::pi * t / step().seconds), 2);
  }
  Vector6 six_axis_at(double since) const {
    if (step_ < 0 || step().kind != StepKind::six_axis || since < kReaction) return Vector6::Zero();
    Vector6 w;
    for (int i = 0; i < 6; ++i)
      w[i] = 0.5 * paper_range()[i] * std::sin((1.1 + 0.37 * i) * (since - kReaction));
    // About the reference's own origin.
    w.tail<3>() -= plan_.reference_origin.cross(Eigen::Vector3d(w.head<3>()));
    return w;
  }

  const WrenchPlan& plan_;
  WrenchGuide& guide_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
  double time_ = 100;
  double next_reading_ = 100;
  double asked_ = 100;
  int ask_ = -1;
  int step_ = -1;
  Vector6 before_ = Vector6::Zero();
  Vector6 rest_ = Vector6::Zero();
};

}  // namespace tagwrench::test

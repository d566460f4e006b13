// The closed calibration without pictures: the simulated bench loads the simulated springs, a
// tracker with its noise looks at them, the guide leads, the fit finds the stiffness.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/commands/calibrate_wrench/simulated_person.h"
#include "host/source/simulator/bench.h"
#include "host/source/simulator/mechanics.h"
#include "tests/unit/calibration/wrench/wrench_bench.h"

namespace tagwrench::test {

/// As a person describes springs that are not measured: 15 % off.
inline Matrix6 rough_stiffness() {
  sim::Mechanics rough;
  rough.axial_stiffness = 800;
  rough.lateral_stiffness = 60;
  rough.bending_stiffness = 3.6e-3;
  rough.torsion_stiffness = 4.5e-3;
  return sim::stiffness(rough);
}

/// How the tracker's errors of scale and axes break the symmetry of the stiffness that it sees: as
/// large as FitOptions::reciprocity says. Displacement seen = this times the displacement made.
inline Matrix6 tracker_axes(const Matrix6& stiffness, std::uint64_t seed) {
  std::mt19937 random(static_cast<unsigned>(seed + 1000));
  std::normal_distribution<double> normal;
  Matrix6 seen = stiffness;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      const double unit = std::sqrt(stiffness(i, i) * stiffness(j, j));
      const double half = 0.5 * FitOptions{}.reciprocity * unit * normal(random);
      seen(i, j) += half;
      seen(j, i) -= half;
    }
  }
  return seen.inverse() * stiffness;
}

class ClosedBench {
 public:
  ClosedBench(const std::string& plan, const sim::BenchSettings& settings, std::uint64_t seed,
              const sim::Mechanics& mechanics = {})
      : ClosedBench(parse_plan(plan_text(plan), plan), settings, seed, mechanics) {}
  ClosedBench(const WrenchPlan& plan, const sim::BenchSettings& settings, std::uint64_t seed,
              const sim::Mechanics& mechanics = {})
      : plan_(plan),
        mechanics_(mechanics),
        axes_(settings.perfect ? Matrix6(Matrix6::Identity())
                               : tracker_axes(sim::stiffness(mechanics), seed)),
        bench_(settings, seed),
        still_(rest(), seed),
        motion_(mechanics, still_, 0, 1, &bench_),
        guide_(plan_, options()),
        person_(bench_, plan_, paper_range()),
        random_(static_cast<unsigned>(seed)) {
    if (plan_.reference == ReferenceKind::load_cell) instrument_.emplace<1>(bench_);
    if (plan_.reference == ReferenceKind::six_axis) instrument_.emplace<2>(bench_);
  }

  WrenchGuide& guide() { return guide_; }
  const WrenchPlan& plan() const { return plan_; }
  sim::Bench& bench() { return bench_; }
  double time() const { return time_; }
  Matrix6 truth() const { return sim::stiffness(mechanics_); }
  std::vector<GuideLine> said;
  bool told(const std::string& part) const {
    for (const GuideLine& line : said) {
      if (line.text.find(part) != std::string::npos) return true;
    }
    return false;
  }

  void play(double seconds = 3000) {
    const double end = time_ + seconds;
    while (!guide_.done() && time_ < end) frame();
  }
  WrenchData data() const {
    const double gain = plan_.reference == ReferenceKind::load_cell && !bench_.settings().perfect
                            ? bench_.settings().load_cell.scale_error
                            : 0;
    return collect(plan_, guide_.records(), gain);
  }
  WrenchFit fit(const WrenchData& data) const {
    return fit_wrench(
        data.observations, data.path,
        {.prior = rough_stiffness(), .try_richer = false, .zero_in_use = data.zero_in_use});
  }
  /// As the tracker shows it.
  Vector6 noisy(const Vector6& displacement) {
    Vector6 out = axes_ * displacement;
    for (int i = 0; i < 6; ++i) out[i] += tracker_noise()[i] * normal_(random_);
    return out;
  }
  Vector6 random_load() {
    Vector6 w;
    for (int i = 0; i < 6; ++i)
      w[i] = paper_range()[i] * std::uniform_real_distribution<double>(-1, 1)(random_);
    return w;
  }

 private:
  static sim::Trajectory rest() {
    sim::Trajectory trajectory;
    trajectory.motion = sim::Motion::rest;
    return trajectory;
  }
  static GuideOptions options() {
    GuideOptions out = paper_options();
    out.stiffness = rough_stiffness();
    return out;
  }

  void frame() {
    time_ += 0.04;
    motion_.advance_to(time_);
    take_readings();
    Track track;
    track.status = Status::ok;
    track.displacement = noisy(motion_.seen(time_));
    track.covariance = tracker_noise().cwiseAbs2().asDiagonal();
    person_.look_at(guide_);
    guide_.frame(time_, track);
    for (GuideLine line; guide_.next(line);) said.push_back(line);
  }
  void take_readings() {
    const auto take = [&](auto& instrument) {
      for (sim::SimulatedReading r; instrument.next(r);) {
        ReferenceSample sample;
        sample.time = r.time;
        sample.saturated = r.saturated;
        for (int i = 0; i < 6; ++i) {
          sample.value[i] = r.value[static_cast<std::size_t>(i)];
          sample.sigma[i] = r.sigma[static_cast<std::size_t>(i)];
        }
        guide_.reading(sample);
      }
    };
    if (auto* cell = std::get_if<1>(&instrument_)) take(*cell);
    if (auto* six = std::get_if<2>(&instrument_)) take(*six);
  }

  WrenchPlan plan_;
  sim::Mechanics mechanics_;
  Matrix6 axes_;
  sim::Bench bench_;
  sim::TrajectoryPlayer still_;
  sim::PlatformMotion motion_;
  WrenchGuide guide_;
  SimulatedPerson person_;
  std::variant<std::monostate, sim::SimulatedLoadCell, sim::SimulatedSixAxis> instrument_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double time_ = 0;
};

}  // namespace tagwrench::test

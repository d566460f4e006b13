#include "tests/support/hard_run.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench::test {
namespace {

constexpr double kWrongSigmas = 5;
constexpr double kLateralFloor = 3e-6;   // m
constexpr double kDepthFloor = 12e-6;    // m
constexpr double kAngleFloor = 0.6e-3;   // rad
constexpr double kForgivenShare = 0.01;  // of the excursion
constexpr double kLever = 2e-3;          // m, of the tags about the platform's middle
constexpr double kDistance = 20e-3;      // m, of the lens
constexpr double kWhole = 0.99;          // of a tag
constexpr double kSmear_px = 3;
constexpr double kStep = 0.6e-3;    // m
constexpr double kTurn = 52.36e-3;  // rad, 3 degrees
constexpr int kFramesToRecover = 2;

std::uint32_t trouble_of(const sim::Truth& truth, const Vector6& step) {
  std::uint32_t trouble = truth.disturbances & ~sim::bit(sim::DisturbanceKind::light_drift);
  if (truth.smear_px >= kSmear_px || step.head<3>().norm() > kStep ||
      step.tail<3>().norm() > kTurn) {
    trouble |= 1U << kMotionTrouble;
  }
  return trouble;
}

double floor_of(int axis, const Vector6& displacement) {
  const double shift = displacement.head<3>().norm();
  const double turn = displacement.tail<3>().norm();
  if (axis >= 3) return kAngleFloor + kForgivenShare * (turn + shift / kDistance);
  return (axis == 2 ? kDepthFloor : kLateralFloor) + kForgivenShare * (shift + kLever * turn);
}

// Follows one run; every frame goes through judge().
class Judge {
 public:
  explicit Judge(HardRun& run) : run_(run) {}

  void judge(const Track& track, const sim::Truth& truth) {
    const Vector6 step = truth.displacement - last_displacement_;
    last_displacement_ = truth.displacement;
    const double least_visible = *std::min_element(truth.visible.begin(), truth.visible.end());
    const double most_visible = *std::max_element(truth.visible.begin(), truth.visible.end());
    const std::uint32_t trouble = trouble_of(truth, step);
    const bool clear = trouble == 0 && least_visible >= kWhole;
    const bool ok = track.status == Status::ok;
    const Verdict verdict = ok ? verdict_on(track, truth) : Verdict{};
    if (verdict.wrong) {
      const int a = verdict.axis;
      run_.wrong.push_back({truth.sequence, trouble | recent_[0] | recent_[1], a, verdict.error[a],
                            verdict.sigma[a], least_visible, truth.smear_px,
                            truth.exposed_displacement[a] - truth.displacement[a]});
    }
    for (int kind = 0; kind < kTroubleKinds; ++kind) {
      const std::uint32_t kinds = trouble | truth.disturbances;
      if (kind == kNoTrouble ? trouble != 0 : (kinds >> kind & 1U) == 0) continue;
      score(run_.scores[static_cast<std::size_t>(kind)], track.status, verdict);
    }
    if (ok && clear && clear_frames_ >= kFramesToRecover) {
      run_.clear_error_squared += verdict.error.dot(track.covariance.ldlt().solve(verdict.error));
      ++clear_and_ok_;
    }

    if (!clear) {
      lost_in_trouble_ = lost_in_trouble_ || !ok;
      clear_frames_ = 0;
      unrecovered_ = 0;
    } else {
      ++clear_frames_;
      recover(ok, truth.sequence);
      if (!ok && most_visible >= kWhole && clear_frames_ > kFramesToRecover && !lost_in_trouble_) {
        run_.lost_in_the_clear.push_back(truth.sequence);
      }
    }
    recent_ = {trouble, recent_[0]};
    ++run_.frames;
  }

  void finish() {
    if (clear_and_ok_ > 0) run_.clear_error_squared /= clear_and_ok_;
  }

 private:
  struct Verdict {
    bool wrong = false;
    int axis = 0;  ///< the worst
    Vector6 error = Vector6::Zero(), sigma = Vector6::Zero();
    double worst_sigmas = 0;
  };

  static Verdict verdict_on(const Track& track, const sim::Truth& truth) {
    Verdict v;
    v.error = track.displacement - truth.exposed_displacement;
    v.sigma = track.covariance.diagonal().cwiseMax(1e-30).cwiseSqrt();
    v.wrong = !v.error.allFinite() || !v.sigma.allFinite();
    double worst_excess = 1;
    for (int axis = 0; axis < 6; ++axis) {
      const double sigmas = std::abs(v.error[axis]) / v.sigma[axis];
      v.worst_sigmas = std::max(v.worst_sigmas, sigmas);
      const double excess = std::min(sigmas / kWrongSigmas,
                                     std::abs(v.error[axis]) / floor_of(axis, truth.displacement));
      if (excess <= worst_excess) continue;
      worst_excess = excess;
      v.axis = axis;
      v.wrong = true;
    }
    return v;
  }

  static void score(TroubleScore& s, Status status, const Verdict& verdict) {
    ++s.frames;
    s.ok += status == Status::ok ? 1 : 0;
    s.doubtful += status == Status::doubtful ? 1 : 0;
    s.lost += status == Status::lost || status == Status::acquiring ? 1 : 0;
    s.wrong += verdict.wrong ? 1 : 0;
    s.worst_sigmas = std::max(s.worst_sigmas, verdict.worst_sigmas);
  }

  void recover(bool ok, std::uint64_t sequence) {
    if (!lost_in_trouble_) return;
    if (!ok) {
      ++unrecovered_;
      run_.slowest_recovery = std::max(run_.slowest_recovery, unrecovered_);
      if (unrecovered_ == kFramesToRecover + 1) run_.slow_recoveries.push_back(sequence);
      return;
    }
    ++run_.recoveries;
    lost_in_trouble_ = false;
    unrecovered_ = 0;
  }

  HardRun& run_;
  Vector6 last_displacement_ = Vector6::Zero();
  std::array<std::uint32_t, 2> recent_{};  ///< trouble of the last frame and of the one before
  bool lost_in_trouble_ = false;
  int clear_frames_ = 0;
  int unrecovered_ = 0;
  int clear_and_ok_ = 0;
};

std::string trouble_text(std::uint32_t trouble) {
  std::string text;
  for (int kind = 0; kind < kNoTrouble; ++kind) {
    if ((trouble >> kind & 1U) == 0) continue;
    if (!text.empty()) text += '+';
    text += trouble_name(kind);
  }
  return text.empty() ? trouble_name(kNoTrouble) : text;
}

}  // namespace

const char* trouble_name(int kind) {
  if (kind == kMotionTrouble) return "fast motion";
  if (kind == kNoTrouble) return "none";
  return sim::name(static_cast<sim::DisturbanceKind>(kind));
}

HardRun run_hard(const sim::Scenario& scenario, int frames) {
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  SimulatorSource source(scenario, /*live=*/false);
  HardRun run;
  Judge judge(run);
  for (int i = 0; i < frames; ++i) {
    Frame frame;
    source.read(frame);
    run.dropped += static_cast<int>(frame.dropped);
    const Track track = tracker.track(frame);
    if (i >= sensor.rest.frames) judge.judge(track, source.truth());
  }
  judge.finish();
  return run;
}

std::string report(const HardRun& run, int most) {
  std::string text =
      fmt::format("{} frames judged, {} lost by the source\n", run.frames, run.dropped);
  text += fmt::format("{:<12} {:>7} {:>7} {:>9} {:>6} {:>9} {:>13}\n", "trouble", "frames", "ok",
                      "doubtful", "lost", "wrong ok", "worst/sigma");
  for (int kind = 0; kind < kTroubleKinds; ++kind) {
    const TroubleScore& s = run.scores[static_cast<std::size_t>(kind)];
    text += fmt::format("{:<12} {:>7} {:>7} {:>9} {:>6} {:>9} {:>13.1f}\n", trouble_name(kind),
                        s.frames, s.ok, s.doubtful, s.lost, s.wrong, s.worst_sigmas);
  }
  text += fmt::format(
      "wrong oks {}; lost in the clear {}; recoveries {}, slowest after {} frames, slow ones {}; "
      "clear normalised error squared {:.2f} (6 is true)\n",
      run.wrong.size(), run.lost_in_the_clear.size(), run.recoveries, run.slowest_recovery,
      run.slow_recoveries.size(), run.clear_error_squared);
  const char* axes[] = {"x", "y", "z", "rx", "ry", "rz"};
  int shown = 0;
  for (const WrongOk& w : run.wrong) {
    if (shown++ == most) break;
    const double unit = w.axis < 3 ? 1e-6 : 1e-3;
    text += fmt::format(
        "wrong ok at {:>6}: {:<2} off by {:.3f} {} = {:.1f} sigma, least visible {:.2f}, smear "
        "{:.1f} "
        "px, swing {:.3f}, {}\n",
        w.sequence, axes[w.axis], w.error / unit, w.axis < 3 ? "um" : "mrad",
        std::abs(w.error) / w.sigma, w.least_visible, w.smear_px, w.swing / unit,
        trouble_text(w.trouble));
  }
  return text;
}

int hard_frames(int otherwise) {
  const char* text = std::getenv("TAGWRENCH_HARD_FRAMES");
  const int asked = text == nullptr ? 0 : std::atoi(text);
  return asked > 0 ? asked : otherwise;
}

}  // namespace tagwrench::test

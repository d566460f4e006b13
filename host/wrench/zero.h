// What the sensor reads while nobody touches it: springs creep, glue and plastic warm up, and the
// wrench at rest wanders. It is taken off, by hand (`tagwrench zero`) and, slowly, by itself.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "host/core/types.h"

namespace tagwrench {

/// Whether six numbers stand still: their running standard deviation is no more than noise, and
/// has been for a while.
class StationarityDetector {
 public:
  struct Options {
    /// Scatter up to `sigmas` standard deviations of a reading is noise; never less than `least`,
    /// nor more than `most`.
    double sigmas = 2;
    Vector6 least = Vector6::Zero();
    Vector6 most = Vector6::Constant(1e300);
    Duration memory = std::chrono::milliseconds(500);
    Duration settled = std::chrono::seconds(1);
    Duration longest_gap = std::chrono::milliseconds(500);  ///< a longer one starts it again
  };
  explicit StationarityDetector(const Options& options) : options_(options) {}

  /// Times grow; one that does not starts it again.
  void add(TimePoint time, const Vector6& value, const Vector6& sigma) noexcept;
  void reset() noexcept { started_ = false; }

  bool still() const noexcept {
    return started_ && !moves_ && last_ - calm_since_ >= options_.settled;
  }
  /// It moves, more than noise would.
  bool moves() const noexcept { return started_ && moves_; }
  /// Of the last `memory`, exponentially weighted.
  const Vector6& mean() const noexcept { return mean_; }

 private:
  Options options_;
  bool started_ = false;
  bool moves_ = false;
  TimePoint last_{};
  TimePoint calm_since_{};
  Vector6 mean_ = Vector6::Zero();
  Vector6 variance_ = Vector6::Zero();
};

/// Limits in the manner of a weighing instrument's zero-tracking device (OIML R 76-1, 2006, 4.5.1
/// and 4.5.7: only near zero and in stable equilibrium, by no more than 0.5 scale intervals a
/// second, and 4 % of the maximum in all).
struct ZeroOptions {
  bool follow = true;
  /// N and N m, as samples have them: about wrench_origin, along wrench_frame. An axis whose range
  /// is not known (0, or beyond kUnknownRange) is not followed.
  Vector6 range = Vector6::Zero();
  Vector6 set = Vector6::Zero();  ///< what reads as nothing from the start
  double band = 0.02;             ///< of the range: farther from `set` the zero never goes
  /// Of the range: once somebody has been felt, nothing farther from zero is taken for it. Before,
  /// it is the whole band.
  double capture = 0.005;
  double rate = 0.5 / 3000;   ///< of the range a second: half an interval, where 3000 are the range
  double time_constant = 10;  ///< s, of following where the rate allows it
  double reach = 0.1;         ///< of the range: farther from zero is a load, and no zero on demand
  Duration patience = std::chrono::seconds(10);  ///< for a zero on demand to find it at rest
};

/// What became of a zero on demand.
enum class ZeroAnswer : std::uint8_t {
  none,      ///< nothing was asked, or all is said
  waits,     ///< not at rest yet; another answer follows
  done,      ///< what read is zero now
  loaded,    ///< it stands still, but as under a load
  moving,    ///< it did not come to rest: somebody holds it
  no_range,  ///< without a range nobody knows what is still and what is a load
};

/// In words; empty for none.
std::string_view zero_text(ZeroAnswer answer) noexcept;

/// Ranges of a sensor whose range nobody has told are larger than this, N and N m.
inline constexpr double kUnknownRange = 1e8;

/// Takes the zero off samples and, if asked to, lets it follow while nobody touches the sensor: the
/// wrench stands still, to its noise, for a second, is near zero, and no button is pressed. On
/// demand it goes at once to what reads then, as soon as nobody touches the sensor. Depends on
/// samples and their times alone, so that a replay gives the same. No heap.
class ZeroTracking {
 public:
  explicit ZeroTracking(const ZeroOptions& options);

  /// Fills sample.zero and zero_state, and takes zero off sample.wrench. `noise`: one standard
  /// deviation of what scatters from frame to frame, N and N m; see WrenchEstimator::noise.
  void follow(Sample& sample, const Vector6& noise) noexcept;

  bool follows() const noexcept { return follow_; }
  /// Zero on demand, with the next sample at rest. While it waits, asking again changes nothing.
  void ask() noexcept {
    if (!asked_) asked_at_.reset();
    asked_ = true;
  }
  /// The computer has slept, and what it left warm is cold: what reads next at rest is zero, where
  /// the zero may follow and within the band. If it was a load, it is given back when that goes.
  void wake() noexcept { woke_ = woke_ || (follow_ && !asked_); }
  /// Each is told once: for each ask() one that is final, where it takes time after `waits`.
  ZeroAnswer take_answer() noexcept { return std::exchange(answer_, ZeroAnswer::none); }
  /// How far it has moved from the one that was set, N and N m.
  const Vector6& moved() const noexcept { return moved_; }

 private:
  ZeroState judge(const Sample& sample, const Vector6& noise) noexcept;
  bool within(const Vector6& wrench, double part) const noexcept;
  void answer(const Sample& sample) noexcept;
  Vector6 reading() const noexcept { return meter_.mean() - options_.set - moved_; }

  ZeroOptions options_;
  Vector6 range_;  ///< 0 for axes that are not followed
  bool follow_;
  StationarityDetector meter_;
  bool felt_ = false;  ///< somebody, since the start
  bool asked_ = false;
  bool woke_ = false;
  std::optional<Vector6> taken_awake_;  ///< what a wake has taken off, N and N m
  std::optional<TimePoint> asked_at_;
  ZeroAnswer answer_ = ZeroAnswer::none;
  TimePoint last_{};
  Vector6 moved_ = Vector6::Zero();
};

/// The range, N and N m, along the axes and about the origin that `tool` leads to. An axis that
/// mixes in one whose range is not known has none either.
Vector6 range_through(const Matrix6& tool, const Vector6& range);
/// The same along other axes: the rows of `turn`.
Vector6 range_along(const Eigen::Matrix3d& turn, const Vector6& range);

}  // namespace tagwrench

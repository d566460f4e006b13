// Wrench -> motion of an input device: mounting, filter, dead zone, full scale, curve, what moves.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "host/core/types.h"

namespace tagwrench {

// Rest of one axis, with hysteresis and without a jump.

/// An axis leaves rest when it is pushed beyond `outer`, and deflects from zero there. While it is
/// pushed on, to twice `outer`, the place of zero moves down to `inner`; on the way back deflection
/// ends where zero is then. So the edge has a width that noise does not cross to and fro, and the
/// way out and the way back are both continuous.
class DeadZone {
 public:
  struct Edges {
    double outer = 0;
    double inner = 0;       ///< 0..outer
    double full_scale = 1;  ///< greater than outer
  };

  /// Deflection, -1..1. `smooth` counts, but what `raw` says is released is released at once,
  /// however far the smoothing lags behind.
  double deflection(double smooth, double raw, const Edges& edges) noexcept;

  bool resting() const noexcept { return zero_ == 0; }

 private:
  double zero_ = 0;  ///< where deflection begins, with the push's sign; 0: at rest
};

enum class CurveKind : std::uint8_t {
  linear,
  power,   ///< out = in^power: above 1 gentle near rest, below 1 eager
  points,  ///< a smooth curve through points
};

struct CurvePoint {
  double in = 0;
  double out = 0;
  bool operator==(const CurvePoint&) const = default;
};

inline constexpr std::size_t kMaxCurvePoints = 16;

struct CurveOptions {
  CurveKind kind = CurveKind::linear;
  double power = 1;  ///< greater than 0
  /// The first `count` of them, at least two: from (0, 0), `in` growing up to 1, `out` never
  /// falling and at most 1.
  std::array<CurvePoint, kMaxCurvePoints> points{};
  std::size_t count = 0;
  bool operator==(const CurveOptions&) const = default;
};

/// Through points it is the monotone cubic of Fritsch and Carlson, "Monotone piecewise cubic
/// interpolation", SIAM J. Numer. Anal. 17(2), 1980: it rises wherever the points do, and nowhere
/// exceeds them.
class ResponseCurve {
 public:
  ResponseCurve() = default;
  /// `options` must keep to the rules above.
  explicit ResponseCurve(const CurveOptions& options) noexcept;

  /// What is below 0 counts as 0, above 1 as 1.
  double operator()(double in) const noexcept;

 private:
  double between_points(double in) const noexcept;

  CurveOptions options_;
  std::array<double, kMaxCurvePoints> slope_{};  ///< at the points
};

// Smoothing of six axes, all of them alike: what is pushed together stays together.

enum class FilterKind : std::uint8_t { none, exponential, one_euro };

struct FilterOptions {
  FilterKind kind = FilterKind::one_euro;

  /// Exponential: `weight` of the newest value at `weight_hz` frames a second; at other rates its
  /// time constant stays. As in Ouyang and Howe, ICRA 2020: 0.2 at 25 Hz, 179 ms.
  double weight = 0.2;
  double weight_hz = 25;

  /// One Euro (Casiez, Roussel and Vogel, CHI 2012): the cut-off is `cutoff_hz` for a hand that
  /// holds still, and `hz_per_speed` more for each full scale a second that the fastest axis moves;
  /// that speed is itself smoothed with `speed_cutoff_hz`.
  /// The sensor's noise needs little of it (on the simulated published sensor, at rest, 0.0003 of
  /// full scale in Fz, a tenth of a count of a SpaceMouse; other axes less), a hand's tremor more.
  /// At 60 frames a second these leave a third of both; a push to half of full scale within 0.5 s
  /// lags 8 ms, one to a tenth within 1 s lags 38 ms. The exponential filter lags 136 and 153 ms.
  double cutoff_hz = 2;
  double hz_per_speed = 12;
  double speed_cutoff_hz = 3;

  bool operator==(const FilterOptions&) const = default;
};

/// Steps follow the frames' own times: a lost frame is a longer step.
class AxisFilter {
 public:
  /// `full_scale`: what speed counts in, per axis, greater than 0.
  AxisFilter(const FilterOptions& options, const Vector6& full_scale) noexcept
      : options_(options), full_scale_(full_scale) {}

  /// From here on as if `value` had been there for ever.
  void start(const Vector6& value) noexcept {
    smooth_ = last_ = value;
    speed_.setZero();
  }
  /// The next value, `seconds` > 0 after the last.
  const Vector6& step(double seconds, const Vector6& value) noexcept {
    smooth_ += weight(seconds, value) * (value - smooth_);
    last_ = value;
    return smooth_;
  }
  /// One axis, or all of them, forget what they lag behind.
  void settle(int axis) noexcept { smooth_[axis] = last_[axis]; }
  void settle() noexcept { smooth_ = last_; }
  const Vector6& value() const noexcept { return smooth_; }

 private:
  double weight(double seconds, const Vector6& value) noexcept;

  FilterOptions options_;
  Vector6 full_scale_;
  Vector6 smooth_ = Vector6::Zero();
  Vector6 last_ = Vector6::Zero();   ///< as it came
  Vector6 speed_ = Vector6::Zero();  ///< full scales a second, smoothed
};

// How much the wrench scatters while nobody pushes.

/// The larger of two: what the samples say of their own noise, and how they really scatter from
/// frame to frame (second differences, which a slow drift does not touch). Learnt at rest alone,
/// so that a hand's tremor numbs nothing, and a push has the same newtons from its first frame to
/// its last.
///
/// Why eight standard deviations of it are a dead zone: an hour at 60 frames a second on six axes
/// is 1.3 million numbers. Normal noise leaves six once in 390 hours. That of rendered JPEG
/// pictures has longer tails: of 89,850 numbers 40 lay beyond four and two beyond five, where
/// normal noise has 6 and 0.05. If each sigma more is 20 times rarer, eight are left once in 280
/// hours, without a filter and without a dead zone of the user's.
class NoiseFloor {
 public:
  /// `seconds` after the last frame, 0 for the first. `rest`: nobody pushes, as far as is known.
  void add(double seconds, const Vector6& value, const Vector6& sigma, bool rest) noexcept;

  /// One standard deviation; zero before the first frame.
  const Vector6& sigma() const noexcept { return sigma_; }

 private:
  void learn_scatter(double seconds, double weight, const Vector6& value) noexcept;

  int known_ = 0;     ///< of the last two values: those in a row, at rest
  bool any_ = false;  ///< frame, ever
  double last_step_ = 0;
  std::array<Vector6, 2> values_ = {Vector6::Zero(), Vector6::Zero()};  ///< last, and before it
  Vector6 stated_ = Vector6::Zero();                                    ///< variance
  Vector6 scatter_ = Vector6::Zero();                                   ///< variance
  Vector6 sigma_ = Vector6::Zero();
};

// Motion between two frames of a slow camera.

// The platform swings on its springs when a hand lets go at once: that is no push.

/// Knows a release by its suddenness: what was pushed within the last 60 ms or so is gone from one
/// frame to the next, or turned round. Nothing smaller than that push is one then, in any
/// direction, for a time that shrinks as the swing does. A hand that turns round by itself is slow
/// beside that and soon beyond it.
class RingdownSuppressor {
 public:
  /// `decay`: s, in which a swing falls to 1/e; 0: nothing is taken for one.
  explicit RingdownSuppressor(double decay) noexcept : decay_(decay) {}

  void reset() noexcept {
    size_ = 0;
    push_.setZero();
  }
  /// `push` in full scales, `seconds` after the last one.
  void add(double seconds, const Vector6& push) noexcept;
  /// In full scales: what may be swing, on any axis.
  double size() const noexcept { return size_; }

 private:
  double decay_;
  double size_ = 0;
  Vector6 push_ = Vector6::Zero();  ///< the strongest of late
};

enum class Fill : std::uint8_t {
  none,     ///< the newest frame's motion stays until the next
  predict,  ///< it goes on as it went, for one and a half frame periods at most
};

/// Carries motion on from the newest frame, along what the last four agree on. No axis leaves rest,
/// crosses zero, leaves its limit or goes on by more than 0.3 of where it is; and a push that
/// slackens is taken to slacken faster still, so that its end is not overshot. Figures are in
/// tests/unit/motion/motion_extrapolator_test.cpp.
class MotionExtrapolator {
 public:
  void reset() noexcept { *this = {}; }
  /// Times grow.
  void add(TimePoint time, const Vector6& motion) noexcept;

  const Vector6& newest() const noexcept { return motion_; }
  /// `limit`: the largest magnitude, per axis.
  Vector6 at(TimePoint time, const Vector6& limit) const noexcept;

 private:
  TimePoint time_{};
  Vector6 motion_ = Vector6::Zero();
  std::array<Vector6, 3> slopes_ = {Vector6::Zero(), Vector6::Zero(), Vector6::Zero()};
  std::array<double, 3> intervals_{};  ///< s; of these and of slopes_, the newest is the first
  int frames_ = 0;                     ///< seen, up to four
};

enum class Lock : std::uint8_t {
  none,
  translation,  ///< X Y Z stay zero
  rotation,     ///< RX RY RZ stay zero
};

/// Where one axis of the device comes from, and how it answers.
struct AxisOptions {
  int source = 0;       ///< axis of the wrench along HID axes, 0..5
  bool invert = false;  ///< of that
  CurveOptions curve;
  double limit = 1;  ///< largest deflection, 0..1
  bool operator==(const AxisOptions&) const = default;
};

/// Each axis of the device from the same axis of the wrench.
constexpr std::array<AxisOptions, 6> straight_axes() {
  std::array<AxisOptions, 6> axes{};
  for (int i = 0; i < 6; ++i) axes[static_cast<std::size_t>(i)].source = i;
  return axes;
}

struct DominantOptions {
  bool on = false;     ///< only the strongest axis moves
  double ratio = 1.3;  ///< another one takes over when it is so many times stronger, at least 1
  bool operator==(const DominantOptions&) const = default;
};

/// Numbers per axis are in the device's order X Y Z RX RY RZ. No pointers: copied as it is.
struct ShapingOptions {
  /// Rows: HID X, Y, Z as camera axes. Default: the camera looks up from below the platform, its x
  /// to the user's right.
  Eigen::Matrix3d hid_R_camera = Eigen::Vector3d(1, -1, -1).asDiagonal();
  /// N or N m, as the axis' source is, of full deflection; greater than the dead zone.
  Vector6 full_scale = (Vector6() << 0.6, 0.6, 2.0, 0.012, 0.012, 0.008).finished();
  /// N or N m that are still rest; the sensor's noise may demand more (noise_sigmas).
  Vector6 dead_zone = (Vector6() << 0.02, 0.02, 0.08, 0.0006, 0.0006, 0.0003).finished();
  double release = 0.7;     ///< part of the dead zone below which an axis comes to rest again, 0..1
  double noise_sigmas = 8;  ///< standard deviations of the noise at rest that a dead zone holds at
                            ///< least (NoiseFloor); 0: it is not looked at
  /// s, in which the platform's swing after a sudden release falls to 1/e (RingdownSuppressor); 0:
  /// a swing counts as pushes. The published sensor: 26 Hz, 0.1 s.
  double swing = 0.12;
  std::array<AxisOptions, 6> axes = straight_axes();
  double translation = 1;  ///< deflection of X Y Z, times
  double rotation = 1;     ///< deflection of RX RY RZ, times
  DominantOptions dominant;
  Lock lock = Lock::none;
  FilterOptions filter;
  Fill fill = Fill::predict;
  bool operator==(const ShapingOptions&) const = default;
};

/// For a sensor that measures up to +-`range`, N and N m as samples have them: two thirds of it are
/// full deflection, and the dead zone keeps its share of that. An axis whose range is not known (as
/// of range_through() in zero.h) keeps the defaults.
ShapingOptions shaping_for(const Vector6& range, const Eigen::Matrix3d& hid_R_camera);

/// Force and torque along other axes; and their sigmas, of independent errors.
Vector6 turned(const Eigen::Matrix3d& rotation, const Vector6& load);
Vector6 turned_sigma(const Eigen::Matrix3d& rotation, const Vector6& sigma);

/// Depends on the last samples and their times alone, so that a replay gives the same. No heap.
class Shaping {
 public:
  explicit Shaping(const ShapingOptions& options) noexcept;

  /// Other options from the next frame on; motion_at() goes on from the last one meanwhile.
  void change(const ShapingOptions& options) noexcept;
  const ShapingOptions& options() const noexcept { return options_; }

  /// Fills sample.deflection: -1..1 per HID axis, exactly zero at rest and continuous at the edge
  /// of rest. A status that carries no numbers, and a wrench that is not finite, are zero and begin
  /// anew. A frame older than the last one, or one with its time, changes nothing and has the last
  /// one's motion.
  void shape(Sample& sample) noexcept;

  /// Instead of shape(): what this frame says is no motion, a gesture. It is zero, and what is
  /// pushed afterwards begins from rest.
  void suppress(Sample& sample) noexcept;

  /// The motion at `time` by the frames so far, on the clock of capture times: of the newest frame
  /// for Fill::none, carried on from it for Fill::predict.
  Vector6 motion_at(TimePoint time) const noexcept {
    return options_.fill == Fill::predict ? fill_.at(time, limit_) : fill_.newest();
  }

 private:
  enum class Order : std::uint8_t { first, next, stale };

  Order order(TimePoint time) const noexcept;
  Vector6 felt(const Vector6& wrench) const noexcept;
  Vector6 felt_sigma(const Vector6& sigma) const noexcept;
  Vector6 rest_edge() const noexcept;
  Vector6 meant(double seconds, const Vector6& raw) noexcept;
  Vector6 deflection(const Vector6& raw) noexcept;
  void keep_strongest(Vector6& motion) noexcept;
  void begin_anew() noexcept {
    started_ = false;
    zones_ = {};
    swing_.reset();
    fill_.reset();
    strongest_ = -1;
  }

  ShapingOptions options_;
  std::array<ResponseCurve, 6> curves_;
  std::array<DeadZone, 6> zones_;
  AxisFilter filter_;
  RingdownSuppressor swing_;
  NoiseFloor noise_;
  MotionExtrapolator fill_;
  Vector6 limit_;
  TimePoint last_{};
  bool started_ = false;
  int strongest_ = -1;  ///< the axis that moves in dominant mode, -1: none
};

}  // namespace tagwrench

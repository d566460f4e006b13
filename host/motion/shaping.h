// Wrench -> motion of an input device: mounting, filter, dead zone, full scale, curve, and what
// moves at all.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "host/core/types.h"
#include "host/motion/axis_filter.h"
#include "host/motion/motion_extrapolator.h"
#include "host/motion/response_curve.h"

namespace tagwrench {

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
                            ///< least (host/motion/noise_floor.h); 0: it is not looked at
  /// s, in which the platform's swing after a sudden release falls to 1/e
  /// (host/motion/ringdown_suppressor.h); 0: a swing counts as pushes. The published sensor: 26 Hz,
  /// 0.1 s.
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

/// Remembers the last frames. Depends on samples and their times alone, so that a replay gives the
/// same. No heap.
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
  /// for Fill::none, carried on from it for Fill::predict (host/motion/motion_extrapolator.h).
  Vector6 motion_at(TimePoint time) const noexcept;

 private:
  enum class Order : std::uint8_t { first, next, stale };

  Order order(TimePoint time) const noexcept;
  Vector6 felt(const Vector6& wrench) const noexcept;
  Vector6 felt_sigma(const Vector6& sigma) const noexcept;
  Vector6 rest_edge() const noexcept;
  Vector6 meant(double seconds, const Vector6& raw) noexcept;
  Vector6 deflection(const Vector6& raw) noexcept;
  void keep_strongest(Vector6& motion) noexcept;
  void begin_anew() noexcept;

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

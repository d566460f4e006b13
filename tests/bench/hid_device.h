// The way from samples to a SpaceMouse's counts as the program goes it: zero, gestures, shaping,
// and moves between frames; in simulated time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/motion/profile_manager.h"
#include "host/output/hid_report.h"
#include "host/sensor/sensor_config.h"
#include "host/wrench/zero.h"

namespace tagwrench::bench {

class SimulatedDevice {
 public:
  /// `profiles`: as --profile names them; none: the sensor's own shaping.
  explicit SimulatedDevice(const SensorConfig& sensor,
                           const std::vector<std::string>& profiles = {})
      : desk_(ProfileFiles(profiles, default_profile(sensor)), {}, {}),
        zero_(zero_options(sensor)) {}

  /// Moves the device, if it has a rate of its own, up to the sample's time by the frames so far,
  /// then takes the sample in. `moved(TimePoint, Counts6)` is told of each move.
  template <typename Moved>
  void take(Sample& sample, const Vector6& noise, Moved moved) {
    while (next_move_ && *next_move_ <= sample.capture_time) {
      Sample between = last_;
      desk_.move_on(between, *next_move_);
      moved(*next_move_, to_counts(between.deflection, kSpacemouseLimit_counts));
      *next_move_ += desk_.period();
    }
    zero_.follow(sample, noise);
    desk_.shape(sample);
    last_ = sample;
    if (!carries_numbers(sample.status) || desk_.period() == Duration::zero()) {
      next_move_.reset();
      moved(sample.capture_time, to_counts(sample.deflection, kSpacemouseLimit_counts));
    } else if (!next_move_) {
      next_move_ = sample.capture_time;
    }
  }

 private:
  static ZeroOptions zero_options(const SensorConfig& sensor) {
    ZeroOptions options;
    options.range = sensor.wrench.range;
    return options;
  }

  ProfileManager desk_;
  ZeroTracking zero_;
  Sample last_;
  std::optional<TimePoint> next_move_;
};

}  // namespace tagwrench::bench

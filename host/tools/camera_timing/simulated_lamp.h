// The lamp of a simulated sensor: no board, no cable, and a clock that is the camera's own.
#pragma once

#include <vector>

#include "host/source/simulator/mechanics.h"
#include "host/tools/camera_timing/pattern_lamp.h"
#include "host/tools/camera_timing/screen_measurement.h"

namespace tagwrench {

class SimulatedLamp final : public PatternLamp, public FlipPatch, public sim::LedLight {
 public:
  /// `live`: orders are carried out now, by the steady clock; else after the last instant that a
  /// picture has seen.
  explicit SimulatedLamp(bool live) : live_(live) {}

  /// Where the host's clock is at simulation time 0.
  void set_time_zero(TimePoint zero) noexcept { zero_ = zero; }

  void off() override { begin({.kind = Kind::steady, .level = 0}); }
  /// As a patch on a screen without latency.
  void show(bool white, TimePoint when) override;
  std::optional<TimePoint> shown() override;
  void steady(int level_permille) override;
  void pattern(Duration bit, std::uint16_t seed) override;
  std::optional<PatternTiming> timing() const override;

  double mean(double from, double to) noexcept override;

 private:
  enum class Kind : std::uint8_t { steady, pattern };
  struct Order {
    double since = 0;  ///< simulation time, s
    Kind kind = Kind::steady;
    double level = 0;  ///< of steady, 0..1
    double bit = 0;    ///< of pattern, s
    std::uint16_t seed = 1;
  };
  double now() const noexcept;
  void begin(Order order);
  double on_time(const Order& order, double from, double to) const noexcept;

  bool live_;
  TimePoint zero_{};
  double seen_ = 0;            ///< newest instant that a picture has seen, simulation time, s
  std::vector<Order> orders_;  ///< oldest first
  std::vector<bool> bits_;     ///< of the pattern ordered last
};

}  // namespace tagwrench

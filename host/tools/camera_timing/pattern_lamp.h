// A lamp that flashes a known pattern by a clock that the host knows: the LED of a board, or the
// simulator's.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/board/board_session.h"
#include "host/core/types.h"
#include "host/source/simulator/mechanics.h"
#include "host/tools/camera_timing/measurement.h"

namespace tagwrench {

/// When a pattern's bits begin: bit k at start + k * period.
struct PatternTiming {
  TimePoint start{};       ///< host clock
  double period = 0;       ///< of a bit, on the host's clock, s
  double start_sigma = 0;  ///< of all bits together, s
  double rate_sigma = 0;   ///< of the period, relative
  std::uint16_t seed = 1;  ///< protocol/pattern.h
};

/// Orders are carried out soon, not at once. Nothing throws but setup.
class PatternLamp {
 public:
  PatternLamp() = default;
  PatternLamp(const PatternLamp&) = delete;
  PatternLamp& operator=(const PatternLamp&) = delete;
  virtual ~PatternLamp() = default;

  virtual void off() = 0;
  virtual void steady(int level_permille) = 0;
  /// Pseudo-random bits; the light is off until the first.
  virtual void pattern(Duration bit, std::uint16_t seed) = 0;

  /// Of the running pattern, as well as it is known by now. Nothing: it did not start, or the clock
  /// is not known.
  virtual std::optional<PatternTiming> timing() const = 0;

  /// Readable when service() has something to do; -1: never.
  virtual int poll_fd() const noexcept { return -1; }
  /// Keeps clock and lamp alive; to be called after each frame and when poll_fd() is readable.
  virtual void service() noexcept {}
  /// One line once the lamp can no longer be trusted (unplugged, limited by the board); else empty.
  virtual std::string trouble() const { return {}; }
  /// The pattern cannot flash faster.
  virtual Duration shortest_bit() const noexcept { return std::chrono::microseconds(200); }
};

// A board's LED as the lamp of a measurement.

class BoardPatternLamp final : public PatternLamp {
 public:
  /// `session`, borrowed, is ready and its clock known. `pump` carries bytes between it and the
  /// board whenever it is called; `poll_fd` is readable when that is worth it.
  BoardPatternLamp(link::BoardSession& session, std::function<void()> pump, int poll_fd);

  void off() override { order({}); }
  void steady(int level_permille) override;
  void pattern(Duration bit, std::uint16_t seed) override;
  std::optional<PatternTiming> timing() const override;
  int poll_fd() const noexcept override { return poll_fd_; }
  void service() noexcept override;
  std::string trouble() const override { return trouble_; }
  Duration shortest_bit() const noexcept override;

 private:
  void order(const link::Led& led);

  link::BoardSession& session_;
  std::function<void()> pump_;
  int poll_fd_;
  std::uint32_t restarts_;
  link::Led led_{};
  std::string trouble_;
};

// The lamp of a simulated sensor: no board, no cable, and a clock that is the camera's own.

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
  std::optional<TimePoint> shown() override { return time_of(orders_.back()); }
  void steady(int level_permille) override {
    begin({.kind = Kind::steady, .level = 1e-3 * level_permille});
  }
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
  TimePoint time_of(const Order& order) const {
    return zero_ + Duration(std::llround(1e9 * order.since));
  }
  double on_time(const Order& order, double from, double to) const noexcept;

  bool live_;
  TimePoint zero_{};
  double seen_ = 0;            ///< newest instant that a picture has seen, simulation time, s
  std::vector<Order> orders_;  ///< oldest first
  std::vector<bool> bits_;     ///< of the pattern ordered last
};

}  // namespace tagwrench

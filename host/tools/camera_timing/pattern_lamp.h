// A lamp that flashes a known pattern by a clock that the host knows: the LED of a board, or the
// simulator's.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "host/core/types.h"

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

}  // namespace tagwrench

// The board beside a run, as far as a page may touch it. In the loop's thread.
#pragma once

#include <array>
#include <cstdint>

namespace tagwrench {

struct BoardReading {
  struct Cell {
    bool known = false;  ///< calibrated, and it has spoken
    double newtons = 0;
    double sigma_n = 0;
  };
  double led = 0;          ///< 0..1
  double exposure_us = 0;  ///< 0: not known
  std::array<Cell, 4> cells{};
};

class BoardControl {
 public:
  BoardControl() = default;
  BoardControl(const BoardControl&) = delete;
  BoardControl& operator=(const BoardControl&) = delete;
  virtual ~BoardControl() = default;

  virtual BoardReading reading() const noexcept = 0;
  /// 0..1, what the LED may have for ever at most.
  virtual void set_led(double level) noexcept = 0;
  /// The level that was found when the light was set.
  virtual void set_led_as_settled() noexcept = 0;
  /// From now on this cell reads nothing, until the run ends. False: it is not calibrated.
  virtual bool tare(std::size_t channel) noexcept = 0;
};

}  // namespace tagwrench

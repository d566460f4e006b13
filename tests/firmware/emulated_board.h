// The board of firmware/README.md's wiring table around an emulated ATmega328P that runs the
// flashable image: four load cells, two buttons, two voltages, the LED and the serial line, in
// virtual time.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "tests/firmware/adc.h"
#include "tests/firmware/avr_core.h"
#include "tests/firmware/hx711.h"
#include "tests/firmware/led_log.h"
#include "tests/firmware/timer1.h"
#include "tests/firmware/usart.h"

namespace tagwrench::emulator {

constexpr unsigned kCells = 4;
constexpr unsigned kButtons = 2;

struct BoardOptions {
  double clock_ppm = 0;  ///< how much the board's crystal is fast
  /// Oscillators of the cells differ, as real ones do.
  std::array<double, kCells> cell_rate_error{0.004, -0.011, 0.019, -0.003};
  unsigned seed = 1;
};

class EmulatedBoard {
 public:
  /// Throws std::runtime_error if the image cannot be loaded.
  explicit EmulatedBoard(const std::filesystem::path& elf, const BoardOptions& options = {});

  VirtualTime now() const { return core_.now(); }
  /// What the board's clock shows now (us), unwrapped, if it were perfect.
  double board_us() const;
  void advance_to(VirtualTime time) { core_.run_until(time); }
  void advance_by(VirtualTime duration) { advance_to(now() + duration); }

  // The serial line.
  void write(std::span<const std::uint8_t> bytes) {
    usart_.send(bytes.data(), bytes.size(), now());
  }
  void write_at(VirtualTime earliest, std::span<const std::uint8_t> bytes) {
    usart_.send(bytes.data(), bytes.size(), std::max(earliest, now()));
  }
  std::vector<SentByte> read() { return usart_.take_sent(); }
  Usart& usart() { return usart_; }

  /// True time at which the board's own clock was zero, since its last reset.
  VirtualTime clock_zero() const { return core_.time_of(timer1_.started()); }
  /// True time of a board time stamp that is `stamp_us` after clock_zero(), unwrapped.
  VirtualTime true_time(std::int64_t stamp_us) const;

  // What is wired to it.
  Hx711& cell(unsigned channel) { return *cells_.at(channel); }
  void set_force(unsigned channel, double newton);
  void set_adc(unsigned channel, double volts);
  Adc& adc() { return adc_; }
  /// Closes or opens a button at `at`; the contact bounces `bounces` times within `bounce_time`.
  void move_button(unsigned button, bool pressed, VirtualTime at, unsigned bounces = 0,
                   VirtualTime bounce_time = std::chrono::milliseconds(2));
  const LedLog& led() const { return led_; }
  LedLog& led() { return led_; }
  /// Times at which both LED pins drove the gate against each other.
  std::uint64_t gate_conflicts() const { return gate_conflicts_; }
  bool lamp() { return pin('B', 5).value_or(false); }  ///< D13
  bool fast_cells() { return pin('D', 2).value_or(false); }

  // Resets and mishaps.
  void press_reset() { core_.reset(1 << 1); }
  /// Memory is random afterwards, the EEPROM as it was.
  void power_cycle();
  void hang(bool interrupts_off = false) { core_.hang(interrupts_off); }

  AvrCore& core() { return core_; }
  const CoreFigures& figures() const { return core_.figures(); }
  /// RAM between the static data and the deepest stack that was seen.
  unsigned stack_free_bytes() const;
  unsigned stack_used_bytes() const;

 private:
  struct ContactMove {
    VirtualTime time;
    bool closed;
  };

  std::optional<bool> pin(char port, unsigned bit);
  std::optional<double> pwm_level();
  void pins_changed(Cycle when);
  void contact_event(unsigned button);

  AvrCore core_;
  Usart usart_;
  Timer1 timer1_;
  Adc adc_;
  std::vector<std::unique_ptr<Hx711>> cells_;
  std::array<std::vector<ContactMove>, kButtons> contacts_;
  std::vector<std::unique_ptr<CycleTimer>> contact_timers_;
  LedLog led_;
  bool gate_fight_ = false;
  std::uint64_t gate_conflicts_ = 0;
  std::mt19937 random_;
};

}  // namespace tagwrench::emulator

// Timer 1 of the emulated board in normal mode, exact where simavr is not: output compare pins act
// on matches alone, FOC1A works, a flag is cleared by writing its own bit, enabling an interrupt
// whose flag is set fires it, and the 16-bit registers share one temporary byte (datasheet,
// section 15).
#pragma once

#include "tests/firmware/avr_core.h"

namespace tagwrench::emulator {

class Timer1 {
 public:
  explicit Timer1(AvrCore& core);

  /// Level that the compare unit gives pin OC1A; empty while it does not drive the pin.
  std::optional<bool> output_a();
  /// Called when output_a() may have changed, with the cycle at which it did.
  void on_output(std::function<void(Cycle)> callback) { output_changed_ = std::move(callback); }
  /// Called at each rising edge of the flag of compare B, which can trigger the ADC.
  void on_compare_b(std::function<void(Cycle)> callback) { compare_b_ = std::move(callback); }

  std::uint16_t count();
  /// When the timer last began to run, from a count of zero: the board's own time zero.
  Cycle started() const { return started_; }

 private:
  void reset();
  Cycle prescale();
  void configure(std::uint8_t control_b);
  void write_count(std::uint16_t count);
  void match(std::uint8_t vector, Cycle when);
  void act_on_a(Cycle when);
  void schedule(CycleTimer& timer, std::uint32_t ticks_after_zero);
  void schedule_all();
  void raise_enabled();

  AvrCore& core_;
  CycleTimer a_;
  CycleTimer b_;
  CycleTimer overflow_;
  std::function<void(Cycle)> output_changed_;
  std::function<void(Cycle)> compare_b_;
  Cycle zero_ = 0;  ///< a cycle at which the count was 0, or would have been
  Cycle started_ = 0;
  std::uint16_t stopped_at_ = 0;
  std::uint8_t temporary_ = 0;
  bool latch_ = false;
};

}  // namespace tagwrench::emulator

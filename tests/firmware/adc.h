// The ADC of the emulated board: conversions started by ADSC or by timer 1's compare B, which
// simavr does not have, sampled when silicon samples (datasheet, section 23).
#pragma once

#include "tests/firmware/avr_core.h"

namespace tagwrench::emulator {

struct AdcConversion {
  std::uint8_t channel = 0;
  VirtualTime trigger{};
  VirtualTime sampled{};
  std::uint16_t counts = 0;
};

class Adc {
 public:
  explicit Adc(AvrCore& core);

  /// Voltage (V) at an input 0..7 over time.
  void set_input(std::uint8_t channel, std::function<double(VirtualTime)> volts);
  void set_supply(double volts) { supply_ = volts; }
  void set_temperature(double celsius) { temperature_ = celsius; }
  /// From the timer: compare B's flag went up.
  void trigger(Cycle when);

  /// Every conversion since the last call.
  std::vector<AdcConversion> take_conversions();

 private:
  void write_control(std::uint8_t value);
  void start(Cycle when, bool automatic);
  void finish(Cycle when);
  std::uint16_t convert(std::uint8_t multiplexer, VirtualTime at) const;
  Cycle clock();

  AvrCore& core_;
  CycleTimer done_;
  std::array<std::function<double(VirtualTime)>, 8> inputs_{};
  double supply_ = 5.0;
  double temperature_ = 25.0;
  bool first_ = true;
  bool locked_ = false;  ///< ADCL was read, ADCH not yet
  std::uint16_t result_ = 0;
  AdcConversion running_;
  std::vector<AdcConversion> conversions_;
};

}  // namespace tagwrench::emulator

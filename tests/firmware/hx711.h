// A load-cell amplifier HX711 with its bridge (Avia's datasheet): conversions at its own
// oscillator's rate, data line, clock pulses, gain by the number of pulses, power-down, settling.
#pragma once

#include <random>

#include "tests/firmware/avr_core.h"

namespace tagwrench::emulator {

/// One conversion, delivered or not.
struct Conversion {
  VirtualTime ready{};  ///< falling edge of DOUT
  std::int32_t counts = 0;
  bool saturated = false;
};

class Hx711 {
 public:
  enum class Wiring : std::uint8_t { connected, disconnected, stuck_low, stuck_high };

  struct Bridge {
    std::function<double(VirtualTime)> force;  ///< N
    double counts_per_newton = 100000;         ///< at gain 128
    double offset_counts = 20000;              ///< at gain 128
    double noise_counts = 0;                   ///< one standard deviation
  };

  /// DOUT on port C, bit `channel`. The oscillator deviates by `rate_error` (0.01: 1 % fast).
  Hx711(AvrCore& core, std::uint8_t channel, double rate_error, unsigned seed);

  Bridge& bridge() { return bridge_; }
  void set_wiring(Wiring wiring);
  void set_rate_error(double rate_error) { rate_error_ = rate_error; }
  /// Level of SCK and of RATE, as the board drives them.
  void clock(bool level, Cycle when);
  void rate(bool fast) { fast_ = fast; }

  const std::vector<Conversion>& conversions() const { return conversions_; }
  void forget_conversions() {
    conversions_.clear();
    reads_ = CycleCount();
  }
  double period() const;                                    ///< s
  std::uint64_t unread() const { return unread_; }          ///< replaced before they were read
  std::uint64_t collisions() const { return collisions_; }  ///< fell into a read-out
  const CycleCount& reads() const { return reads_; }        ///< first to last clock pulse
  unsigned gain() const { return gain_; }
  bool powered_down() const { return powered_down_; }

 private:
  void convert(Cycle when);
  void restart(Cycle when);
  void set_data(bool level);
  void end_pulses();

  AvrCore& core_;
  std::uint8_t channel_;
  double rate_error_;
  std::mt19937 random_;
  Bridge bridge_;
  Wiring wiring_ = Wiring::connected;
  CycleTimer conversion_;
  CycleTimer ready_edge_;
  CycleTimer power_down_;
  CycleTimer last_pulse_;
  bool fast_ = false;
  bool clock_ = false;
  bool data_ = true;
  bool powered_down_ = false;
  bool unread_now_ = false;
  unsigned pulses_ = 0;
  unsigned gain_ = 128;
  std::uint32_t shift_ = 0;
  std::vector<Conversion> conversions_;
  Cycle read_begin_ = 0;
  Cycle last_pulse_at_ = 0;
  CycleCount reads_;
  std::uint64_t unread_ = 0;
  std::uint64_t collisions_ = 0;
};

}  // namespace tagwrench::emulator

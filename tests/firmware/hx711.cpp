#include "tests/firmware/hx711.h"

#include <algorithm>
#include <cmath>

namespace tagwrench::emulator {

namespace {

constexpr std::int32_t kMax = 0x7FFFFF;
constexpr std::int32_t kMin = -0x800000;
constexpr VirtualTime kPowerDown = std::chrono::microseconds(60);
/// No further pulse for so long: the read-out is over. The datasheet limits the clock's high time
/// only.
constexpr VirtualTime kPulsesOver = std::chrono::milliseconds(2);
/// The data line shows an unread conversion's replacement by a short high level.
constexpr VirtualTime kReplaced = std::chrono::microseconds(20);
constexpr int kSettlingPeriods = 4;  // "settling time": 400 ms at 10/s, 50 ms at 80/s

}  // namespace

Hx711::Hx711(AvrCore& core, std::uint8_t channel, double rate_error, unsigned seed)
    : core_(core),
      channel_(channel),
      rate_error_(rate_error),
      random_(seed),
      conversion_(core, [this](Cycle when) { convert(when); }),
      ready_edge_(core, [this](Cycle) { set_data(false); }),
      power_down_(core,
                  [this](Cycle) {
                    powered_down_ = true;
                    conversion_.cancel();
                    ready_edge_.cancel();
                    set_data(true);
                  }),
      last_pulse_(core, [this](Cycle) { end_pulses(); }) {
  bridge_.force = [](VirtualTime) { return 0.0; };
  // Amplifiers are not in step with each other.
  restart(core.cycle() + core.cycles_of(std::chrono::microseconds(1700)) * channel);
}

double Hx711::period() const { return 1 / ((fast_ ? 80.0 : 10.0) * (1 + rate_error_)); }

void Hx711::set_wiring(Wiring wiring) {
  wiring_ = wiring;
  set_data(data_);
}

void Hx711::set_data(bool level) {
  data_ = level;
  switch (wiring_) {
    case Wiring::connected: core_.drive('C', channel_, level); break;
    case Wiring::disconnected: core_.release('C', channel_); break;
    case Wiring::stuck_low: core_.drive('C', channel_, false); break;
    case Wiring::stuck_high: core_.drive('C', channel_, true); break;
  }
}

void Hx711::restart(Cycle when) {
  unread_now_ = false;
  pulses_ = 0;
  set_data(true);
  const VirtualTime settling(std::llround(kSettlingPeriods * period() * 1e9));
  conversion_.at(when + core_.cycles_of(settling));
}

void Hx711::convert(Cycle when) {
  const VirtualTime period_ns(std::llround(period() * 1e9));
  conversion_.at(when + core_.cycles_of(period_ns));
  if (pulses_ > 24) {
    const unsigned gain = gain_;
    end_pulses();
    if (gain_ != gain) return;  // it settles anew
  }
  if (pulses_ != 0) {  // what is shifted out stays what it was; this conversion is lost
    ++collisions_;
    return;
  }
  const VirtualTime now = core_.time_of(when);
  std::normal_distribution<double> noise(0.0, 1.0);
  const double scale = gain_ / 128.0;
  const double counts =
      scale * (bridge_.offset_counts + bridge_.counts_per_newton * bridge_.force(now)) +
      bridge_.noise_counts * noise(random_);
  const auto clipped =
      static_cast<std::int32_t>(std::clamp(std::round(counts), double{kMin}, double{kMax}));
  shift_ = static_cast<std::uint32_t>(clipped) & 0xFFFFFF;
  if (unread_now_) {
    ++unread_;
    const Cycle edge = when + core_.cycles_of(kReplaced);
    conversions_.push_back({core_.time_of(edge), clipped, clipped == kMax || clipped == kMin});
    set_data(true);
    ready_edge_.at(edge);
  } else {
    conversions_.push_back({now, clipped, clipped == kMax || clipped == kMin});
    set_data(false);
  }
  unread_now_ = true;
}

void Hx711::clock(bool level, Cycle when) {
  if (level == clock_) return;
  clock_ = level;
  if (!level) {
    power_down_.cancel();
    if (powered_down_) {
      powered_down_ = false;
      gain_ = 128;
      restart(when);
    }
    return;
  }
  power_down_.at(when + core_.cycles_of(kPowerDown));
  last_pulse_.at(when + core_.cycles_of(kPulsesOver));
  if (pulses_ == 0 && !unread_now_) return;  // nothing to shift out
  if (pulses_ == 0) read_begin_ = when;
  last_pulse_at_ = when;
  ++pulses_;
  if (pulses_ <= 24) {
    set_data((shift_ >> (24 - pulses_) & 1) != 0);
  } else {
    set_data(true);
    unread_now_ = false;
  }
}

void Hx711::end_pulses() {
  const unsigned pulses = pulses_;
  pulses_ = 0;
  last_pulse_.cancel();
  if (powered_down_ || pulses == 0) return;
  reads_.add(last_pulse_at_ - read_begin_);
  if (pulses < 25) {  // an interrupted read-out leaves the line where it was
    unread_now_ = false;
    set_data(true);
    return;
  }
  const unsigned gain = pulses == 25 ? 128 : pulses == 26 ? 32 : 64;
  if (gain != gain_) {
    gain_ = gain;
    restart(last_pulse_at_);
  }
}

}  // namespace tagwrench::emulator

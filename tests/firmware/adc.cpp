#include "tests/firmware/adc.h"

#include <algorithm>
#include <cmath>

#include "tests/firmware/avr_registers.h"

namespace tagwrench::emulator {

namespace {

constexpr std::uint8_t kEnable = 0x80, kStart = 0x40, kAuto = 0x20, kFlag = 0x10;
constexpr std::uint8_t kSourceCompareB = 5;
constexpr double kBandgap = 1.1;  // V

}  // namespace

Adc::Adc(AvrCore& core) : core_(core), done_(core, [this](Cycle when) { finish(when); }) {
  core.replace_write(reg::kAdcsra, [this](std::uint8_t value) { write_control(value); });
  for (const std::uint16_t address : {reg::kAdmux, reg::kAdcsrb})
    core.replace_write(address,
                       [this, address](std::uint8_t value) { core_.data(address) = value; });
  core.replace_read(reg::kAdcl, [this] {
    locked_ = true;
    core_.data(reg::kAdch) = static_cast<std::uint8_t>(result_ >> 8);
    return static_cast<std::uint8_t>(result_);
  });
  core.replace_read(reg::kAdch, [this] {
    if (!locked_) core_.data(reg::kAdch) = static_cast<std::uint8_t>(result_ >> 8);
    locked_ = false;
    return core_.data(reg::kAdch);
  });
  core.after_reset([this] {
    done_.cancel();
    first_ = true;
    locked_ = false;
  });
}

void Adc::set_input(std::uint8_t channel, std::function<double(VirtualTime)> volts) {
  inputs_.at(channel) = std::move(volts);
}

Cycle Adc::clock() {
  const unsigned select = core_.data(reg::kAdcsra) & 7;
  return Cycle{1} << std::max(select, 1U);
}

void Adc::write_control(std::uint8_t value) {
  std::uint8_t& control = core_.data(reg::kAdcsra);
  const bool running = done_.pending();
  if ((value & kFlag) != 0) core_.clear(reg::kAdcDone);
  const bool flag = (control & kFlag) != 0;
  control = static_cast<std::uint8_t>((value & ~(kStart | kFlag)) | (flag ? kFlag : 0) |
                                      (running ? kStart : 0));
  if ((value & kEnable) == 0) {
    done_.cancel();
    control = static_cast<std::uint8_t>(control & ~kStart);
    first_ = true;
    return;
  }
  if (flag && core_.enabled(reg::kAdcDone)) core_.raise(reg::kAdcDone);
  if ((value & kStart) != 0 && !running) start(core_.cycle(), false);
}

void Adc::trigger(Cycle when) {
  const std::uint8_t control = core_.data(reg::kAdcsra);
  if ((control & (kEnable | kAuto)) != (kEnable | kAuto) || done_.pending()) return;
  if ((core_.data(reg::kAdcsrb) & 7) == kSourceCompareB) start(when, true);
}

void Adc::start(Cycle when, bool automatic) {
  core_.data(reg::kAdcsra) |= kStart;
  const Cycle tick = clock();
  // Table 23-1, in half ticks: sample and hold, end of conversion.
  const Cycle sample = first_ ? 27 : automatic ? 4 : 3;
  const Cycle end = first_ ? 50 : automatic ? 27 : 26;
  first_ = false;
  running_.channel = core_.data(reg::kAdmux) & 15;
  running_.trigger = core_.time_of(when);
  running_.sampled = core_.time_of(when + sample * tick / 2);
  done_.at(when + end * tick / 2);
}

void Adc::finish(Cycle) {
  std::uint8_t& control = core_.data(reg::kAdcsra);
  control = static_cast<std::uint8_t>(control & ~kStart);
  running_.counts = convert(core_.data(reg::kAdmux), running_.sampled);
  conversions_.push_back(running_);
  if (!locked_) result_ = running_.counts;
  core_.raise(reg::kAdcDone);
}

std::uint16_t Adc::convert(std::uint8_t multiplexer, VirtualTime at) const {
  const std::uint8_t channel = running_.channel;
  double volts = 0;
  if (channel < inputs_.size()) {
    volts = inputs_[channel] ? inputs_[channel](at) : 0.0;
  } else if (channel == 8) {
    volts = 0.314 + (temperature_ - 25) * 0.00095;  // table 23-2: 314 mV at 25 C, about 1 mV/K
  } else if (channel == 14) {
    volts = kBandgap;
  }
  const unsigned reference = multiplexer >> 6;
  const double full_scale = reference == 3 ? kBandgap : supply_;
  const double counts = std::floor(volts / full_scale * 1024);
  const auto right = static_cast<std::uint16_t>(std::clamp(counts, 0.0, 1023.0));
  const bool left_adjusted = (multiplexer & 0x20) != 0;
  return left_adjusted ? static_cast<std::uint16_t>(right << 6) : right;
}

std::vector<AdcConversion> Adc::take_conversions() {
  std::vector<AdcConversion> taken;
  taken.swap(conversions_);
  return taken;
}

}  // namespace tagwrench::emulator

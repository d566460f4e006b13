#include "tests/firmware/timer1.h"

#include "tests/firmware/avr_registers.h"

namespace tagwrench::emulator {

namespace {

constexpr std::uint32_t kTicks = 65536;

}  // namespace

Timer1::Timer1(AvrCore& core)
    : core_(core),
      a_(core, [this](Cycle when) { match(reg::kTimer1CompA, when); }),
      b_(core, [this](Cycle when) { match(reg::kTimer1CompB, when); }),
      overflow_(core, [this](Cycle when) { match(reg::kTimer1Overflow, when); }) {
  core.replace_write(reg::kTccr1a, [this](std::uint8_t value) {
    core_.data(reg::kTccr1a) = value;
    if ((value & 3) != 0) core_.fail("timer 1 has no model but for normal mode");
    if (output_changed_) output_changed_(core_.cycle());
  });
  core.replace_write(reg::kTccr1b, [this](std::uint8_t value) { configure(value); });
  core.replace_write(reg::kTccr1c, [this](std::uint8_t value) {
    if ((value & 0x80) != 0) act_on_a(core_.cycle());
  });
  core.replace_read(reg::kTcnt1l, [this] {
    const std::uint16_t now = count();
    temporary_ = static_cast<std::uint8_t>(now >> 8);
    return static_cast<std::uint8_t>(now);
  });
  core.replace_read(reg::kTcnt1h, [this] { return temporary_; });
  for (const std::uint16_t high : {reg::kTcnt1h, reg::kOcr1ah, reg::kOcr1bh})
    core.replace_write(high, [this](std::uint8_t value) { temporary_ = value; });
  core.replace_write(reg::kTcnt1l, [this](std::uint8_t value) {
    write_count(static_cast<std::uint16_t>(value | temporary_ << 8));
  });
  // Only the match of the register written: one of the others may be due within this instruction.
  core.replace_write(reg::kOcr1al, [this](std::uint8_t value) {
    core_.data(reg::kOcr1al) = value;
    core_.data(reg::kOcr1ah) = temporary_;
    schedule(a_, core_.word(reg::kOcr1al) + 1U);
  });
  core.replace_write(reg::kOcr1bl, [this](std::uint8_t value) {
    core_.data(reg::kOcr1bl) = value;
    core_.data(reg::kOcr1bh) = temporary_;
    schedule(b_, core_.word(reg::kOcr1bl) + 1U);
  });
  core.replace_write(reg::kTifr1, [this](std::uint8_t value) {
    const std::uint8_t flags = core_.written_flags(value);
    if ((flags & 1) != 0) core_.clear(reg::kTimer1Overflow);
    if ((flags & 2) != 0) core_.clear(reg::kTimer1CompA);
    if ((flags & 4) != 0) core_.clear(reg::kTimer1CompB);
  });
  core.replace_write(reg::kTimsk1, [this](std::uint8_t value) {
    core_.data(reg::kTimsk1) = value;
    raise_enabled();
  });
  core.after_reset([this] { reset(); });
}

void Timer1::reset() {
  a_.cancel();
  b_.cancel();
  overflow_.cancel();
  stopped_at_ = 0;
  temporary_ = 0;
  latch_ = false;
}

Cycle Timer1::prescale() {
  switch (core_.data(reg::kTccr1b) & 7) {
    case 1: return 1;
    case 2: return 8;
    case 3: return 64;
    case 4: return 256;
    case 5: return 1024;
    default: return 0;
  }
}

std::uint16_t Timer1::count() {
  const Cycle divider = prescale();
  if (divider == 0) return stopped_at_;
  return static_cast<std::uint16_t>((core_.cycle() - zero_) / divider);
}

void Timer1::configure(std::uint8_t control_b) {
  const std::uint16_t now = count();
  const bool stopped = prescale() == 0;
  core_.data(reg::kTccr1b) = control_b;
  if ((control_b & 0x18) != 0 || (control_b & 7) > 5)
    core_.fail("timer 1 has no model but for normal mode and the system clock");
  write_count(now);
  if (stopped) started_ = zero_;
}

void Timer1::write_count(std::uint16_t count) {
  stopped_at_ = count;
  const Cycle divider = prescale();
  // The prescaler runs on, whoever writes the count (section 17.2).
  if (divider != 0) {
    const Cycle tick = core_.cycle() / divider * divider;
    zero_ = tick - std::min(tick, count * divider);
  }
  schedule_all();
}

void Timer1::schedule(CycleTimer& timer, std::uint32_t ticks_after_zero) {
  const Cycle divider = prescale();
  if (divider == 0) {
    timer.cancel();
    return;
  }
  const Cycle turn = kTicks * divider;
  const Cycle first = zero_ + ticks_after_zero * divider;
  const Cycle now = core_.cycle();
  timer.at(now < first ? first : first + ((now - first) / turn + 1) * turn);
}

/// A match shows one tick after the count equals the register (section 15.7).
void Timer1::schedule_all() {
  schedule(a_, core_.word(reg::kOcr1al) + 1U);
  schedule(b_, core_.word(reg::kOcr1bl) + 1U);
  schedule(overflow_, kTicks);
}

void Timer1::match(std::uint8_t vector, Cycle when) {
  const bool rising = !core_.flag(vector);
  if (vector == reg::kTimer1CompA) act_on_a(when);
  core_.raise(vector);
  if (vector == reg::kTimer1CompB && rising && compare_b_) compare_b_(when);
  CycleTimer& timer = vector == reg::kTimer1CompA   ? a_
                      : vector == reg::kTimer1CompB ? b_
                                                    : overflow_;
  timer.at(when + kTicks * prescale());
}

void Timer1::act_on_a(Cycle when) {
  switch (core_.data(reg::kTccr1a) >> 6) {
    case 1: latch_ = !latch_; break;
    case 2: latch_ = false; break;
    case 3: latch_ = true; break;
    default: return;
  }
  if (output_changed_) output_changed_(when);
}

std::optional<bool> Timer1::output_a() {
  if ((core_.data(reg::kTccr1a) & 0xC0) == 0) return std::nullopt;
  return latch_;
}

void Timer1::raise_enabled() {
  for (const std::uint8_t vector : {reg::kTimer1Overflow, reg::kTimer1CompA, reg::kTimer1CompB}) {
    if (core_.flag(vector) && core_.enabled(vector)) core_.raise(vector);
  }
}

}  // namespace tagwrench::emulator

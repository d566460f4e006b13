#include "tests/firmware/emulated_board.h"

#include <algorithm>

#include "tests/firmware/avr_registers.h"

namespace tagwrench::emulator {

namespace {

constexpr std::array<std::uint8_t, kButtons> kButtonPins{0, 4};  // PB0, PB4
constexpr unsigned kPwmPin = 3;                                  // PD3
constexpr unsigned kPulsePin = 1;                                // PB1
constexpr unsigned kFirstClockPin = 4;                           // PD4..PD7

}  // namespace

EmulatedBoard::EmulatedBoard(const std::filesystem::path& elf, const BoardOptions& options)
    : core_(elf, options.clock_ppm),
      usart_(core_),
      timer1_(core_),
      adc_(core_),
      random_(options.seed) {
  for (unsigned i = 0; i < kCells; ++i) {
    cells_.push_back(std::make_unique<Hx711>(core_, static_cast<std::uint8_t>(i),
                                             options.cell_rate_error[i], options.seed + i));
  }
  for (unsigned i = 0; i < kButtons; ++i) {
    contact_timers_.push_back(
        std::make_unique<CycleTimer>(core_, [this, i](Cycle) { contact_event(i); }));
  }
  timer1_.on_output([this](Cycle when) { pins_changed(when); });
  timer1_.on_compare_b([this](Cycle when) { adc_.trigger(when); });
  for (const std::uint16_t address : {reg::kPortB, reg::kDdrB, reg::kPortD, reg::kDdrD}) {
    core_.replace_write(address, [this, address](std::uint8_t value) {
      if (core_.data(address) == value) return;
      core_.original_write(address, value);
      pins_changed(core_.cycle());
    });
  }
  for (const std::uint16_t address : {reg::kPinB, reg::kPinD})
    core_.after_write(address, [this](std::uint8_t) { pins_changed(core_.cycle()); });
  // Timer 2 makes the LED's level alone; its edges are not simulated one by one.
  for (const std::uint16_t address :
       {reg::kTccr2a, reg::kTccr2b, reg::kOcr2a, reg::kOcr2b, reg::kTcnt2}) {
    core_.replace_write(address, [this, address](std::uint8_t value) {
      core_.data(address) = value;
      pins_changed(core_.cycle());
    });
  }
  core_.after_write(reg::kTimsk2, [this](std::uint8_t value) {
    if (value != 0) core_.fail("timer 2 has no model of its interrupts");
  });
  core_.after_reset([this] { pins_changed(core_.cycle()); });
}

double EmulatedBoard::board_us() const {
  return static_cast<double>(core_.cycle() - timer1_.started()) / (kNominalHz * 1e-6);
}

VirtualTime EmulatedBoard::true_time(std::int64_t stamp_us) const {
  constexpr Cycle kCyclesPerUs = 16;
  return core_.time_of(timer1_.started() + static_cast<Cycle>(stamp_us) * kCyclesPerUs);
}

/// Level of a pin that the board drives.
std::optional<bool> EmulatedBoard::pin(char port, unsigned bit) {
  const auto base = static_cast<std::uint16_t>(reg::kPinB + 3 * (port - 'B'));
  if ((core_.data(static_cast<std::uint16_t>(base + 1)) >> bit & 1) == 0) return std::nullopt;
  if (port == 'B' && bit == kPulsePin) {
    if (const auto output = timer1_.output_a()) return output;
  }
  return (core_.data(static_cast<std::uint16_t>(base + 2)) >> bit & 1) != 0;
}

/// Mean level of PD3 with timer 2's output OC2B (datasheet, section 18.7).
std::optional<double> EmulatedBoard::pwm_level() {
  const std::uint8_t control = core_.data(reg::kTccr2a);
  const auto plain = pin('D', kPwmPin);
  if (!plain) return std::nullopt;
  const unsigned output = control >> 4 & 3;
  if (output < 2) return *plain ? 1.0 : 0.0;
  const unsigned mode = (control & 3) | (core_.data(reg::kTccr2b) >> 1 & 4);
  const bool clocked = (core_.data(reg::kTccr2b) & 7) != 0;
  const bool fast = mode == 3 || mode == 7;
  if (!clocked || (!fast && mode != 1 && mode != 5)) return 0.0;
  const double top = mode == 3 || mode == 1 ? 255 : core_.data(reg::kOcr2a);
  const double compare = core_.data(reg::kOcr2b);
  const double duty = fast ? (compare + 1) / (top + 1) : compare / std::max(top, 1.0);
  return output == 2 ? std::min(duty, 1.0) : 1 - std::min(duty, 1.0);
}

void EmulatedBoard::pins_changed(Cycle when) {
  const auto level = pwm_level();
  const auto pulse = pin('B', kPulsePin);
  double gate = 0;  // the pull-down holds it
  if (level && pulse) {
    gate = (*level + (*pulse ? 1.0 : 0.0)) / 2;  // two equal resistors
    const bool fight = *level != (*pulse ? 1.0 : 0.0);
    if (fight && !gate_fight_) ++gate_conflicts_;
    gate_fight_ = fight;
  } else {
    gate = level ? *level : (pulse.value_or(false) ? 1.0 : 0.0);
    gate_fight_ = false;
  }
  led_.set(core_.time_of(when), gate);
  const bool fast = fast_cells();
  for (unsigned i = 0; i < cells_.size(); ++i) {
    cells_[i]->rate(fast);
    cells_[i]->clock(pin('D', kFirstClockPin + i).value_or(false), when);
  }
}

void EmulatedBoard::set_force(unsigned channel, double newton) {
  cell(channel).bridge().force = [newton](VirtualTime) { return newton; };
}

void EmulatedBoard::set_adc(unsigned channel, double volts) {
  adc_.set_input(static_cast<std::uint8_t>(4 + channel), [volts](VirtualTime) { return volts; });
}

void EmulatedBoard::move_button(unsigned button, bool pressed, VirtualTime at, unsigned bounces,
                                VirtualTime bounce_time) {
  auto& moves = contacts_.at(button);
  moves.push_back({at, pressed});
  std::vector<VirtualTime> times;
  // Shorter contacts than an interrupt takes to look are seen by nobody.
  std::uniform_int_distribution<std::int64_t> when(100000, bounce_time.count());
  for (unsigned i = 0; i < 2 * bounces; ++i) times.push_back(at + VirtualTime(when(random_)));
  std::sort(times.begin(), times.end());
  for (unsigned i = 0; i < times.size(); ++i)
    moves.push_back({times[i], i % 2 == 0 ? !pressed : pressed});
  if (!contact_timers_[button]->pending())
    contact_timers_[button]->at(core_.cycle_at(moves.front().time));
}

void EmulatedBoard::contact_event(unsigned button) {
  auto& moves = contacts_[button];
  if (moves.front().closed) {
    core_.drive('B', kButtonPins[button], false);
  } else {
    core_.release('B', kButtonPins[button]);
  }
  moves.erase(moves.begin());
  if (!moves.empty()) contact_timers_[button]->at(core_.cycle_at(moves.front().time));
}

void EmulatedBoard::power_cycle() {
  std::uniform_int_distribution<unsigned> byte(0, 255);
  for (unsigned address = reg::kRamBegin; address <= core_.sizes().ram_end; ++address)
    core_.data(static_cast<std::uint16_t>(address)) = static_cast<std::uint8_t>(byte(random_));
  core_.reset(1);
}

unsigned EmulatedBoard::stack_used_bytes() const {
  return figures().lowest_stack > core_.sizes().ram_end
             ? 0U
             : static_cast<unsigned>(core_.sizes().ram_end - figures().lowest_stack);
}

unsigned EmulatedBoard::stack_free_bytes() const {
  const unsigned static_end = 0x100 + core_.sizes().static_bytes;
  return figures().lowest_stack + 1U > static_end ? figures().lowest_stack + 1U - static_end : 0U;
}

}  // namespace tagwrench::emulator

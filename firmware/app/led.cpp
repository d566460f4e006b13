#include "firmware/app/led.h"

#include "firmware/app/elapsed.h"
#include "protocol/pattern.h"

namespace tagwrench {
namespace firmware {
namespace {

/// Light is looked at in steps of 64 us, or longer ones if a loop takes longer; no schedule of
/// pulses keeps step with that. Heat is in permille steps above the sustained level.
constexpr uint8_t kStepShift = 6;
constexpr uint32_t kStepsPerSecond = 1000000ul >> kStepShift;
constexpr uint32_t kMaxSteps = 8 * kStepsPerSecond;  ///< at once: no overflow
constexpr int32_t kMaxHeat =
    static_cast<int32_t>(kStepsPerSecond / 1000.0 * (1000 - kSustainedPermille) * kFullTimeMs);
/// Cool enough for full light again.
constexpr int32_t kCool = kMaxHeat / 2;
/// Of light that is limited and yet too much (orders that begin their pulses anew all the time),
/// this much is borne, then it is dark.
constexpr int32_t kGrace = kMaxHeat / 20;
/// Half of the pattern's bits shine.
constexpr uint16_t kPatternPermille = 500;
/// Of a bit that shines, when limited.
constexpr uint16_t kLimitedBitPermille = 1000ul * kSustainedPermille / kPatternPermille;

constexpr uint32_t kMaxAheadUs = 60000000;
/// An edge is queued at least this long before its time, which is longer than queueing it takes,
constexpr uint32_t kLeadUs = 500;
/// and no earlier than this, so that a change of the limit is soon seen.
constexpr uint32_t kHorizonUs = 200000;
/// Steps of the pattern in one poll: half a millisecond at 16 MHz.
constexpr uint16_t kStepsAtOnce = 400;

bool in_range(const link::Led& command) {
  const board::Traits& can = board::kTraits;
  if (command.mode == link::LedMode::off) return true;
  if (command.mode == link::LedMode::steady) return command.level_permille <= 1000;
  if (command.period_us < can.strobe_period_min_us || command.period_us > can.strobe_period_max_us)
    return false;
  if (command.mode == link::LedMode::pattern)
    return command.pattern_seed >= 1 && command.pattern_seed <= link::kPatternBits;
  // Dark between two pulses for as long as a pulse lasts at least.
  return command.width_us >= can.strobe_width_min_us &&
         command.width_us <= can.strobe_width_max_us &&
         command.width_us + can.strobe_width_min_us <= command.period_us;
}

uint16_t mean_permille(const link::Led& command) {
  switch (command.mode) {
    case link::LedMode::steady: return command.level_permille;
    case link::LedMode::strobe:
      return static_cast<uint16_t>(command.width_us * 1000ul / command.period_us);
    case link::LedMode::pattern: return kPatternPermille;
    default: return 0;
  }
}

bool same(const link::Led& a, const link::Led& b) {
  return a.mode == b.mode && a.period_us == b.period_us && a.width_us == b.width_us &&
         a.start_us == b.start_us && a.pattern_seed == b.pattern_seed;
}

}  // namespace

LedDriver::LedDriver(uint32_t now_us)
    : limited_(board::kept_heat() >= kCool), accounted_us_(now_us) {}

link::Result LedDriver::command(const link::Led& command, uint32_t now_us) {
  if (!in_range(command)) return link::Result::out_of_range;
  // A host repeats its order as a sign of life; pulses under way are not to stumble over that.
  if (command.mode >= link::LedMode::strobe && same(command, command_)) return link::Result::ok;
  account(now_us);
  command_ = command;
  wanted_permille_ = mean_permille(command);
  drive();
  if (command_.mode >= link::LedMode::strobe) begin_pulses(now_us);
  return link::Result::ok;
}

void LedDriver::off() {
  command_.mode = link::LedMode::off;
  wanted_permille_ = 0;
  drive();
}

void LedDriver::drive() {
  if (command_.mode < link::LedMode::strobe) {
    board::led_steady(level_permille());
  } else if (command_.mode == link::LedMode::strobe) {
    const uint32_t most_us = command_.period_us * kSustainedPermille / 1000;
    pulse_us_ = limited_ && command_.width_us > most_us ? most_us : command_.width_us;
  } else {
    pulse_us_ = command_.period_us * kLimitedBitPermille / 1000;
  }
}

void LedDriver::begin_pulses(uint32_t now_us) {
  board::led_pulses();
  shining_ = false;
  skip_ = 0;
  state_ = command_.pattern_seed;
  next_us_ = command_.start_us;
  if (next_us_ - now_us <= kMaxAheadUs) return;
  const uint32_t periods = (now_us - next_us_) / command_.period_us + 1;
  next_us_ += periods * command_.period_us;
  if (command_.mode == link::LedMode::pattern)
    skip_ = static_cast<uint16_t>(periods % link::kPatternBits);
}

void LedDriver::poll(uint32_t now_us, Faults& faults) {
  const int32_t heat = account(now_us);
  if (limited_ ? heat < kCool : heat >= kMaxHeat) {
    limited_ = !limited_;
    drive();
    if (limited_) faults.raise(link::FaultCode::led_limited, 0, now_us);
  }
  if (heat >= kMaxHeat + kGrace) off();
  if (command_.mode < link::LedMode::strobe) return;
  // Catching up takes time: what is due, the next call sees.
  if (skip_ != 0) {
    catch_up();
  } else {
    schedule(now_us);
  }
}

/// Of this moment.
uint16_t LedDriver::light_permille() const {
  if (command_.mode >= link::LedMode::strobe) return board::led_shining() ? 1000 : 0;
  return level_permille();
}

int32_t LedDriver::account(uint32_t now_us) {
  uint32_t steps = (now_us - accounted_us_) >> kStepShift;
  accounted_us_ += steps << kStepShift;
  if (steps > kMaxSteps) steps = kMaxSteps;
  int32_t heat = board::kept_heat();
  if (steps == 0) return heat;
  heat += static_cast<int32_t>(steps) *
          (static_cast<int16_t>(light_permille()) - static_cast<int16_t>(kSustainedPermille));
  if (heat < 0) heat = 0;
  if (heat > kMaxHeat + kGrace) heat = kMaxHeat + kGrace;
  board::keep_heat(heat);
  if (command_.mode == link::LedMode::off) return heat;
  on_time_steps_ = static_cast<uint16_t>(on_time_steps_ + steps);
  if (on_time_steps_ >= kStepsPerSecond) {
    on_time_steps_ = static_cast<uint16_t>(on_time_steps_ - kStepsPerSecond);
    ++on_time_s_;
  }
  return heat;
}

void LedDriver::catch_up() {
  for (uint16_t i = 0; skip_ != 0 && i < kStepsAtOnce; ++i, --skip_)
    state_ = link::next_pattern_state(state_);
}

void LedDriver::schedule(uint32_t now_us) {
  for (uint16_t i = 0; i < kStepsAtOnce && !reached(now_us + kLeadUs, next_us_); ++i) {
    if (!reached(now_us + kHorizonUs, next_us_) || board::led_edge_room() < 2) return;
    add_edges();
    step();
  }
  for (uint16_t i = 0; i < kStepsAtOnce && reached(now_us + kLeadUs, next_us_); ++i) step();
}

void LedDriver::add_edges() {
  const bool pattern = command_.mode == link::LedMode::pattern;
  const bool shine = !pattern || link::pattern_light(state_);
  if (shine != shining_) board::led_edge(next_us_, shine);
  shining_ = shine && pattern && !limited_;
  if (shine && !shining_) board::led_edge(next_us_ + pulse_us_, false);
}

void LedDriver::step() {
  next_us_ += command_.period_us;
  state_ = link::next_pattern_state(state_);
}

}  // namespace firmware
}  // namespace tagwrench

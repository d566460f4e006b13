#include "firmware/app/app.h"

#include "firmware/app/elapsed.h"
#include "protocol/version.h"

namespace tagwrench {
namespace firmware {
namespace {

/// Bit 20 of the microseconds: on and off for a second each.
constexpr uint32_t kBlinkBit = 1ul << 20;

/// USB gives 4.75 V or more, a Nano's diode takes up to 0.4 V.
constexpr uint16_t kSupplyLowMv = 4200;
constexpr uint16_t kSupplyGoodMv = 4300;

/// Reports have this bit; so two boards, or a board and an echo, do not answer each other for ever.
constexpr uint8_t kReportBit = 0x80;

bool in_range(const link::Configure& wanted) {
  const board::Traits& has = board::kTraits;
  bool cells_on = false;
  for (uint8_t i = 0; i < wanted.cell_count; ++i) {
    const bool on = wanted.cells[i] != link::CellInput::off;
    if (on && i >= has.cells) return false;
    cells_on = cells_on || on;
  }
  if (cells_on && wanted.cell_rate_sps != 10 && wanted.cell_rate_sps != 80) return false;
  if ((wanted.adc_mask >> has.adc_channels) != 0) return false;
  if (wanted.adc_mask != 0 && (wanted.adc_rate_hz < 1 || wanted.adc_rate_hz > 200)) return false;
  return wanted.host_timeout_ms >= 200 && wanted.host_timeout_ms <= 60000 &&
         wanted.status_period_ms >= 100 && wanted.status_period_ms <= 60000;
}

/// Copies a text of at most N - 1 characters.
template <uint8_t N>
void copy(const char* text, char (&to)[N]) {
  uint8_t i = 0;
  for (; i + 1 < N && text[i] != 0; ++i) to[i] = text[i];
  to[i] = 0;
}

}  // namespace

void App::poll(uint32_t now_us) {
  measure_loop(now_us);
  watch_host(now_us);
  led_.poll(now_us, faults_);
  cells_.watch(now_us, faults_);
  // What waits for room is not lost yet: an amplifier holds its conversion until the next one.
  if (link_.has_room()) cells_.poll(link_, faults_);
  if (link_.has_room()) adc_.poll(link_);
  buttons_.poll(now_us);
  // The slow ones, a millisecond or two each: one at a time.
  if (link_.receive()) {
    handle_request(now_us);
  } else if (link_.roomy()) {
    send_slow_report(now_us);
  }
  board::host_lamp(host_there_ || (now_us & kBlinkBit) != 0);
}

void App::measure_loop(uint32_t now_us) {
  const uint32_t took_us = now_us - polled_us_;
  polled_us_ = now_us;
  if (took_us > longest_loop_us_) longest_loop_us_ = took_us;
}

void App::watch_host(uint32_t now_us) {
  if (!host_there_ || !reached(now_us, heard_us_ + host_timeout_ms_ * 1000ul)) return;
  host_there_ = false;
  led_.off();
  faults_.raise(link::FaultCode::host_silent, 0, now_us);
}

void App::handle_request(uint32_t now_us) {
  const uint8_t kind = link_.kind();
  // An echo of the board's own reports is no host.
  if (kind & kReportBit) {
    ++unknown_kinds_;
    return;
  }
  host_there_ = true;
  heard_us_ = now_us;
  if (kind == static_cast<uint8_t>(link::Kind::hello_request)) {
    handle_hello(now_us);
  } else if (refused_) {
    link_.answer(link::Result::wrong_version);
  } else if (kind == static_cast<uint8_t>(link::Kind::time_request)) {
    link::TimeRequest request;
    if (link_.read(request)) {
      link_.answer_time();
    } else {
      link_.answer(link::Result::malformed);
    }
  } else {
    link_.answer(handle(kind, now_us));
  }
}

void App::handle_hello(uint32_t now_us) {
  link::HelloRequest request;
  if (!link_.read(request)) {
    link_.answer(link::Result::malformed);
    return;
  }
  session_ = request.session;
  refused_ =
      link::needed_update(request.protocol_major, link::kProtocolMajor) != link::Update::none;
  if (refused_) {
    led_.off();
    link_.answer(link::Result::wrong_version);
  }
  if (!greeted_) status_us_ = now_us;
  greeted_ = true;
  hello_due_ = true;
  capabilities_due_ = !refused_;
}

link::Result App::handle(uint8_t kind, uint32_t now_us) {
  switch (static_cast<link::Kind>(kind)) {
    case link::Kind::configure: return configure(now_us);
    case link::Kind::led: return set_led(now_us);
    case link::Kind::tare: return tare();
    case link::Kind::set_id: return set_id();
    default: ++unknown_kinds_; return link::Result::unknown_kind;
  }
}

link::Result App::configure(uint32_t now_us) {
  link::Configure wanted;
  if (!link_.read(wanted)) return link::Result::malformed;
  if (!in_range(wanted)) return link::Result::out_of_range;
  for (uint8_t i = wanted.cell_count; i < link::kMaxCells; ++i)
    wanted.cells[i] = link::CellInput::off;
  host_timeout_ms_ = wanted.host_timeout_ms;
  status_period_ms_ = wanted.status_period_ms;
  cells_.configure(wanted.cells, wanted.cell_rate_sps, now_us);
  board::adc_start(wanted.adc_mask, wanted.adc_rate_hz);
  return link::Result::ok;
}

link::Result App::set_led(uint32_t now_us) {
  link::Led command;
  if (!link_.read(command)) return link::Result::malformed;
  return led_.command(command, now_us);
}

link::Result App::tare() {
  link::Tare request;
  if (!link_.read(request)) return link::Result::malformed;
  return cells_.tare(request.cell_mask, request.conversions);
}

link::Result App::set_id() {
  link::SetId request;
  if (!link_.read(request)) return link::Result::malformed;
  if (request.unique_id.count == 0) return link::Result::out_of_range;
  if (board::unique_id().count != 0) return link::Result::already_set;
  board::keep_unique_id(request.unique_id);
  return link::Result::ok;
}

void App::send_slow_report(uint32_t now_us) {
  if (hello_due_) {
    send_hello();
  } else if (capabilities_due_) {
    send_capabilities();
  } else if (faults_.waiting()) {
    faults_.send_one(link_);
  } else if (!buttons_.send_one(link_) && !cells_.send_tare(link_) && greeted_ &&
             reached(now_us, status_us_ + status_period_ms_ * 1000ul)) {
    send_status(now_us);
  }
}

void App::send_hello() {
  link::Hello hello = {};
  hello.protocol_major = link::kProtocolMajor;
  hello.protocol_minor = link::kProtocolMinor;
  copy(board::kTraits.name, hello.board);
  copy(TAGWRENCH_VERSION, hello.firmware);
  hello.unique_id = board::unique_id();
  hello.boot_id = board::boot_id();
  hello.reset_cause = board::reset_cause();
  hello.session = session_;
  hello_due_ = !link_.send(hello);
}

void App::send_capabilities() {
  const board::Traits& has = board::kTraits;
  link::Capabilities report = {};
  report.cells = has.cells;
  report.adc_channels = has.adc_channels;
  report.adc_bits = has.adc_bits;
  report.buttons = has.buttons;
  report.led_levels = has.led_levels;
  report.led_sustained_permille = kSustainedPermille;
  report.led_full_time_ms = kFullTimeMs;
  report.strobe_width_min_us = has.strobe_width_min_us;
  report.strobe_width_max_us = has.strobe_width_max_us;
  report.strobe_period_min_us = has.strobe_period_min_us;
  report.strobe_period_max_us = has.strobe_period_max_us;
  report.time_step_ns = has.time_step_ns;
  report.measures_supply = has.measures_supply;
  capabilities_due_ = !link_.send(report);
}

void App::send_status(uint32_t now_us) {
  link::Status status = {};
  status.time_us = now_us;
  status.session = session_;
  status.led_level_permille = led_.level_permille();
  status.led_limited = led_.limited();
  status.led_on_time_s = led_.on_time_s();
  status.supply_mv = board::supply_mv();
  status.bad_frames = link_.damaged_frames();
  status.unknown_kinds = unknown_kinds_;
  status.overruns = board::serial_overruns();
  status.dropped_reports = static_cast<uint16_t>(link_.dropped_reports() + faults_.lost());
  status.cell_count = board::kTraits.cells;
  for (uint8_t i = 0; i < status.cell_count; ++i)
    status.cell_rate_centihertz[i] = cells_.rate_centihertz(i);
  status.stack_free_bytes = board::stack_free_bytes();
  status.longest_loop_us = longest_loop_us_;
  link_.send(status);
  status_us_ = now_us;
  watch_supply(status.supply_mv, now_us);
}

void App::watch_supply(uint16_t supply_mv, uint32_t now_us) {
  if (supply_mv == 0 || supply_mv >= kSupplyGoodMv) {
    supply_low_ = false;
  } else if (supply_mv < kSupplyLowMv && !supply_low_) {
    supply_low_ = true;
    faults_.raise(link::FaultCode::supply_low, 0, now_us);
  }
}

}  // namespace firmware
}  // namespace tagwrench

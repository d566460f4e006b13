#include "protocol/codec_body.h"
#include "protocol/codec_fields.h"

namespace tagwrench {
namespace link {

uint8_t encode(const Hello& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Hello wire = {};
  wire.protocol_major = message.protocol_major;
  wire.protocol_minor = message.protocol_minor;
  put_text(message.board, wire.board);
  put_text(message.firmware, wire.firmware);
  put_id(message.unique_id, wire.unique_id);
  wire.boot_id = message.boot_id;
  wire.reset_cause = static_cast<tagwrench_link_ResetCause>(message.reset_cause);
  wire.session = message.session;
  return encode_body(Kind::hello, sequence, tagwrench_link_Hello_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Hello& message) {
  message = Hello{};
  tagwrench_link_Hello wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Hello_msg, &wire)) return false;
  if (!take_enum(wire.reset_cause, ResetCause::watchdog, message.reset_cause)) return false;
  message.protocol_major = wire.protocol_major;
  message.protocol_minor = wire.protocol_minor;
  take_text(wire.board, message.board);
  take_text(wire.firmware, message.firmware);
  take_id(wire.unique_id, message.unique_id);
  message.boot_id = wire.boot_id;
  message.session = wire.session;
  return true;
}

uint8_t encode(const Capabilities& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Capabilities wire = {};
  wire.cells = message.cells;
  wire.adc_channels = message.adc_channels;
  wire.adc_bits = message.adc_bits;
  wire.buttons = message.buttons;
  wire.led_levels = message.led_levels;
  wire.led_sustained_permille = message.led_sustained_permille;
  wire.led_full_time_ms = message.led_full_time_ms;
  wire.strobe_width_min_us = message.strobe_width_min_us;
  wire.strobe_width_max_us = message.strobe_width_max_us;
  wire.strobe_period_min_us = message.strobe_period_min_us;
  wire.strobe_period_max_us = message.strobe_period_max_us;
  wire.time_step_ns = message.time_step_ns;
  wire.measures_supply = message.measures_supply;
  wire.measures_temperature = message.measures_temperature;
  return encode_body(Kind::capabilities, sequence, tagwrench_link_Capabilities_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Capabilities& message) {
  message = Capabilities{};
  tagwrench_link_Capabilities wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Capabilities_msg, &wire)) return false;
  message.cells = wire.cells;
  message.adc_channels = wire.adc_channels;
  message.adc_bits = wire.adc_bits;
  message.buttons = wire.buttons;
  message.led_levels = wire.led_levels;
  message.led_sustained_permille = wire.led_sustained_permille;
  message.led_full_time_ms = wire.led_full_time_ms;
  message.strobe_width_min_us = wire.strobe_width_min_us;
  message.strobe_width_max_us = wire.strobe_width_max_us;
  message.strobe_period_min_us = wire.strobe_period_min_us;
  message.strobe_period_max_us = wire.strobe_period_max_us;
  message.time_step_ns = wire.time_step_ns;
  message.measures_supply = wire.measures_supply;
  message.measures_temperature = wire.measures_temperature;
  return true;
}

uint8_t encode(const ButtonEvent& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_ButtonEvent wire = {};
  wire.button = message.button;
  wire.pressed = message.pressed;
  wire.time_us = message.time_us;
  wire.sequence = message.sequence;
  return encode_body(Kind::button_event, sequence, tagwrench_link_ButtonEvent_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, ButtonEvent& message) {
  message = ButtonEvent{};
  tagwrench_link_ButtonEvent wire = {};
  if (!decode_message(bytes, count, tagwrench_link_ButtonEvent_msg, &wire)) return false;
  message.button = wire.button;
  message.pressed = wire.pressed;
  message.time_us = wire.time_us;
  message.sequence = wire.sequence;
  return true;
}

uint8_t encode(const Status& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Status wire = {};
  wire.time_us = message.time_us;
  wire.session = message.session;
  wire.led_level_permille = message.led_level_permille;
  wire.led_limited = message.led_limited;
  wire.led_on_time_s = message.led_on_time_s;
  wire.supply_mv = message.supply_mv;
  wire.temperature_centidegree = message.temperature_centidegree;
  wire.bad_frames = message.bad_frames;
  wire.unknown_kinds = message.unknown_kinds;
  wire.overruns = message.overruns;
  wire.dropped_reports = message.dropped_reports;
  wire.cell_rate_centihertz_count =
      message.cell_count < kMostCells ? message.cell_count : kMostCells;
  for (uint8_t i = 0; i < wire.cell_rate_centihertz_count; ++i) {
    wire.cell_rate_centihertz[i] = message.cell_rate_centihertz[i];
  }
  wire.stack_free_bytes = message.stack_free_bytes;
  wire.longest_loop_us = message.longest_loop_us;
  return encode_body(Kind::status, sequence, tagwrench_link_Status_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Status& message) {
  message = Status{};
  tagwrench_link_Status wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Status_msg, &wire)) return false;
  message.time_us = wire.time_us;
  message.session = wire.session;
  message.led_level_permille = wire.led_level_permille;
  message.led_limited = wire.led_limited;
  message.led_on_time_s = wire.led_on_time_s;
  message.supply_mv = wire.supply_mv;
  message.temperature_centidegree = wire.temperature_centidegree;
  message.bad_frames = wire.bad_frames;
  message.unknown_kinds = wire.unknown_kinds;
  message.overruns = wire.overruns;
  message.dropped_reports = wire.dropped_reports;
  message.cell_count = static_cast<uint8_t>(wire.cell_rate_centihertz_count);
  for (uint8_t i = 0; i < message.cell_count; ++i) {
    message.cell_rate_centihertz[i] = wire.cell_rate_centihertz[i];
  }
  message.stack_free_bytes = wire.stack_free_bytes;
  message.longest_loop_us = wire.longest_loop_us;
  return true;
}

uint8_t encode(const Answer& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Answer wire = {};
  wire.request_kind = message.request_kind;
  wire.request_sequence = message.request_sequence;
  wire.result = static_cast<tagwrench_link_Result>(message.result);
  return encode_body(Kind::answer, sequence, tagwrench_link_Answer_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Answer& message) {
  message = Answer{};
  tagwrench_link_Answer wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Answer_msg, &wire)) return false;
  if (!take_enum(wire.result, Result::already_set, message.result)) return false;
  message.request_kind = wire.request_kind;
  message.request_sequence = wire.request_sequence;
  return true;
}

uint8_t encode(const TareResult& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_TareResult wire = {};
  wire.channel = message.channel;
  wire.mean_counts = message.mean_counts;
  wire.spread_counts = message.spread_counts;
  wire.conversions = message.conversions;
  return encode_body(Kind::tare_result, sequence, tagwrench_link_TareResult_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, TareResult& message) {
  message = TareResult{};
  tagwrench_link_TareResult wire = {};
  if (!decode_message(bytes, count, tagwrench_link_TareResult_msg, &wire)) return false;
  message.channel = wire.channel;
  message.mean_counts = wire.mean_counts;
  message.spread_counts = wire.spread_counts;
  message.conversions = wire.conversions;
  return true;
}

uint8_t encode(const Fault& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Fault wire = {};
  wire.code = static_cast<tagwrench_link_FaultCode>(message.code);
  wire.channel = message.channel;
  wire.time_us = message.time_us;
  return encode_body(Kind::fault, sequence, tagwrench_link_Fault_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Fault& message) {
  message = Fault{};
  tagwrench_link_Fault wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Fault_msg, &wire)) return false;
  if (!take_enum(wire.code, FaultCode::supply_low, message.code)) return false;
  message.channel = wire.channel;
  message.time_us = wire.time_us;
  return true;
}

}  // namespace link
}  // namespace tagwrench

// The host's half of the codec: decodes reports, with nanopb.
#include "protocol/codec_body.h"
#include "protocol/codec_fields.h"

namespace tagwrench {
namespace link {

bool decode(const uint8_t* bytes, uint8_t count, Hello& message) {
  message = Hello{};
  tagwrench_link_Hello wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Hello_msg, &wire)) return false;
  message.protocol_major = wire.protocol_major;
  message.protocol_minor = wire.protocol_minor;
  take_text(wire.board, message.board);
  take_text(wire.firmware, message.firmware);
  take_id(wire.unique_id, message.unique_id);
  message.boot_id = wire.boot_id;
  // Whatever else a later version says, its version must be read.
  if (!take_enum(wire.reset_cause, ResetCause::watchdog, message.reset_cause)) {
    message.reset_cause = ResetCause::unknown;
  }
  message.session = wire.session;
  return true;
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

bool decode(const uint8_t* bytes, uint8_t count, Answer& message) {
  message = Answer{};
  tagwrench_link_Answer wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Answer_msg, &wire)) return false;
  if (!take_enum(wire.result, Result::already_set, message.result)) return false;
  message.request_kind = wire.request_kind;
  message.request_sequence = wire.request_sequence;
  return true;
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

bool decode(const uint8_t* bytes, uint8_t count, Fault& message) {
  message = Fault{};
  tagwrench_link_Fault wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Fault_msg, &wire)) return false;
  if (!take_enum(wire.code, FaultCode::supply_low, message.code)) return false;
  message.channel = wire.channel;
  message.time_us = wire.time_us;
  return true;
}

bool decode(const uint8_t* bytes, uint8_t count, CellSample& message) {
  message = CellSample{};
  tagwrench_link_CellSample wire = {};
  if (!decode_message(bytes, count, tagwrench_link_CellSample_msg, &wire)) return false;
  message.channel = wire.channel;
  message.counts = wire.counts;
  message.time_us = wire.time_us;
  message.sequence = wire.sequence;
  message.missed = wire.missed;
  message.saturated = wire.saturated;
  return true;
}

bool decode(const uint8_t* bytes, uint8_t count, AdcSample& message) {
  message = AdcSample{};
  tagwrench_link_AdcSample wire = {};
  if (!decode_message(bytes, count, tagwrench_link_AdcSample_msg, &wire)) return false;
  message.channel = wire.channel;
  message.counts = wire.counts;
  message.time_us = wire.time_us;
  message.sequence = wire.sequence;
  return true;
}

bool decode(const uint8_t* bytes, uint8_t count, TimeReply& message) {
  message = TimeReply{};
  tagwrench_link_TimeReply wire = {};
  if (!decode_message(bytes, count, tagwrench_link_TimeReply_msg, &wire)) return false;
  message.request_sequence = wire.request_sequence;
  message.received_us = wire.received_us;
  message.previous_request_sequence = wire.previous_request_sequence;
  message.previous_sent_us = wire.previous_sent_us;
  message.previous_valid = wire.previous_valid;
  return true;
}

}  // namespace link
}  // namespace tagwrench

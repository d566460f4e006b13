#include "protocol/codec_body.h"
#include "protocol/codec_fields.h"

namespace tagwrench {
namespace link {

uint8_t encode(const HelloRequest& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_HelloRequest wire = {};
  wire.protocol_major = message.protocol_major;
  wire.protocol_minor = message.protocol_minor;
  wire.session = message.session;
  return encode_body(Kind::hello_request, sequence, tagwrench_link_HelloRequest_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, HelloRequest& message) {
  message = HelloRequest{};
  tagwrench_link_HelloRequest wire = {};
  if (!decode_message(bytes, count, tagwrench_link_HelloRequest_msg, &wire)) return false;
  message.protocol_major = wire.protocol_major;
  message.protocol_minor = wire.protocol_minor;
  message.session = wire.session;
  return true;
}

uint8_t encode(const Configure& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Configure wire = {};
  wire.host_timeout_ms = message.host_timeout_ms;
  wire.cells_count = message.cell_count < kMostCells ? message.cell_count : kMostCells;
  for (uint8_t i = 0; i < wire.cells_count; ++i) {
    wire.cells[i] = static_cast<tagwrench_link_CellInput>(message.cells[i]);
  }
  wire.cell_rate_sps = message.cell_rate_sps;
  wire.adc_mask = message.adc_mask;
  wire.adc_rate_hz = message.adc_rate_hz;
  wire.status_period_ms = message.status_period_ms;
  return encode_body(Kind::configure, sequence, tagwrench_link_Configure_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Configure& message) {
  message = Configure{};
  tagwrench_link_Configure wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Configure_msg, &wire)) return false;
  Configure read = {};
  read.host_timeout_ms = wire.host_timeout_ms;
  read.cell_count = static_cast<uint8_t>(wire.cells_count);
  for (uint8_t i = 0; i < read.cell_count; ++i) {
    if (!take_enum(wire.cells[i], CellInput::a64, read.cells[i])) return false;
  }
  read.cell_rate_sps = wire.cell_rate_sps;
  read.adc_mask = wire.adc_mask;
  read.adc_rate_hz = wire.adc_rate_hz;
  read.status_period_ms = wire.status_period_ms;
  message = read;
  return true;
}

uint8_t encode(const Led& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Led wire = {};
  wire.mode = static_cast<tagwrench_link_LedMode>(message.mode);
  wire.level_permille = message.level_permille;
  wire.period_us = message.period_us;
  wire.width_us = message.width_us;
  wire.start_us = message.start_us;
  wire.pattern_seed = message.pattern_seed;
  return encode_body(Kind::led, sequence, tagwrench_link_Led_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Led& message) {
  message = Led{};
  tagwrench_link_Led wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Led_msg, &wire)) return false;
  if (!take_enum(wire.mode, LedMode::pattern, message.mode)) return false;
  message.level_permille = wire.level_permille;
  message.period_us = wire.period_us;
  message.width_us = wire.width_us;
  message.start_us = wire.start_us;
  message.pattern_seed = wire.pattern_seed;
  return true;
}

uint8_t encode(const TimeRequest&, uint8_t sequence, uint8_t* body) {
  const tagwrench_link_TimeRequest wire = {};
  return encode_body(Kind::time_request, sequence, tagwrench_link_TimeRequest_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, TimeRequest& message) {
  message = TimeRequest{};
  tagwrench_link_TimeRequest wire = {};
  return decode_message(bytes, count, tagwrench_link_TimeRequest_msg, &wire);
}

uint8_t encode(const Tare& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Tare wire = {};
  wire.cell_mask = message.cell_mask;
  wire.conversions = message.conversions;
  return encode_body(Kind::tare, sequence, tagwrench_link_Tare_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, Tare& message) {
  message = Tare{};
  tagwrench_link_Tare wire = {};
  if (!decode_message(bytes, count, tagwrench_link_Tare_msg, &wire)) return false;
  message.cell_mask = wire.cell_mask;
  message.conversions = wire.conversions;
  return true;
}

uint8_t encode(const SetId& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_SetId wire = {};
  put_id(message.unique_id, wire.unique_id);
  return encode_body(Kind::set_id, sequence, tagwrench_link_SetId_msg, &wire, body);
}

bool decode(const uint8_t* bytes, uint8_t count, SetId& message) {
  message = SetId{};
  tagwrench_link_SetId wire = {};
  if (!decode_message(bytes, count, tagwrench_link_SetId_msg, &wire)) return false;
  take_id(wire.unique_id, message.unique_id);
  return true;
}

}  // namespace link
}  // namespace tagwrench

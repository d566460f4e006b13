// The host's half of the codec: encodes requests, with nanopb.
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

uint8_t encode(const Configure& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Configure wire = {};
  wire.host_timeout_ms = message.host_timeout_ms;
  const uint8_t cells = message.cell_count < kMaxCells ? message.cell_count : kMaxCells;
  wire.cells_count = cells;
  for (uint8_t i = 0; i < cells; ++i) {
    wire.cells[i] = static_cast<tagwrench_link_CellInput>(message.cells[i]);
  }
  wire.cell_rate_sps = message.cell_rate_sps;
  wire.adc_mask = message.adc_mask;
  wire.adc_rate_hz = message.adc_rate_hz;
  wire.status_period_ms = message.status_period_ms;
  return encode_body(Kind::configure, sequence, tagwrench_link_Configure_msg, &wire, body);
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

uint8_t encode(const TimeRequest&, uint8_t sequence, uint8_t* body) {
  const tagwrench_link_TimeRequest wire = {};
  return encode_body(Kind::time_request, sequence, tagwrench_link_TimeRequest_msg, &wire, body);
}

uint8_t encode(const Tare& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_Tare wire = {};
  wire.cell_mask = message.cell_mask;
  wire.conversions = message.conversions;
  return encode_body(Kind::tare, sequence, tagwrench_link_Tare_msg, &wire, body);
}

uint8_t encode(const SetId& message, uint8_t sequence, uint8_t* body) {
  tagwrench_link_SetId wire = {};
  put_id(message.unique_id, wire.unique_id);
  return encode_body(Kind::set_id, sequence, tagwrench_link_SetId_msg, &wire, body);
}

}  // namespace link
}  // namespace tagwrench

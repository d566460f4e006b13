// The board's half of the codec: encodes reports, decodes requests. By hand, because nanopb takes a
// millisecond for a report on an ATmega328P and its descriptors take a third of the flash. It
// writes nanopb's bytes, and reads and refuses what nanopb does.
#include "protocol/field_reader.h"
#include "protocol/field_writer.h"
#include "protocol/link.pb.h"

namespace tagwrench {
namespace link {
namespace {

void write_text(FieldWriter& writer, uint8_t field, const char* text, uint8_t room) {
  uint8_t length = 0;
  while (length < room - 1 && text[length] != '\0') ++length;
  writer.bytes(field, text, length);
}

/// `read` into `message` if all of it could be read.
template <class Message>
bool take(const FieldReader& reader, const Message& read, Message& message) {
  if (reader.failed()) {
    message = Message{};
    return false;
  }
  message = read;
  return true;
}

}  // namespace

uint8_t encode(const Hello& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::hello, sequence, body);
  writer.varint(tagwrench_link_Hello_protocol_major_tag, message.protocol_major);
  writer.varint(tagwrench_link_Hello_protocol_minor_tag, message.protocol_minor);
  write_text(writer, tagwrench_link_Hello_board_tag, message.board, sizeof message.board);
  write_text(writer, tagwrench_link_Hello_firmware_tag, message.firmware, sizeof message.firmware);
  const UniqueId& id = message.unique_id;
  writer.bytes(tagwrench_link_Hello_unique_id_tag, id.bytes,
               id.count < kIdBytes ? id.count : kIdBytes);
  writer.fixed32(tagwrench_link_Hello_boot_id_tag, message.boot_id);
  writer.varint(tagwrench_link_Hello_reset_cause_tag, static_cast<uint8_t>(message.reset_cause));
  writer.fixed32(tagwrench_link_Hello_session_tag, message.session);
  return writer.count();
}

uint8_t encode(const Capabilities& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::capabilities, sequence, body);
  writer.varint(tagwrench_link_Capabilities_cells_tag, message.cells);
  writer.varint(tagwrench_link_Capabilities_adc_channels_tag, message.adc_channels);
  writer.varint(tagwrench_link_Capabilities_adc_bits_tag, message.adc_bits);
  writer.varint(tagwrench_link_Capabilities_buttons_tag, message.buttons);
  writer.varint(tagwrench_link_Capabilities_led_levels_tag, message.led_levels);
  writer.varint(tagwrench_link_Capabilities_led_sustained_permille_tag,
                message.led_sustained_permille);
  writer.varint(tagwrench_link_Capabilities_led_full_time_ms_tag, message.led_full_time_ms);
  writer.varint(tagwrench_link_Capabilities_strobe_width_min_us_tag, message.strobe_width_min_us);
  writer.varint(tagwrench_link_Capabilities_strobe_width_max_us_tag, message.strobe_width_max_us);
  writer.varint(tagwrench_link_Capabilities_strobe_period_min_us_tag, message.strobe_period_min_us);
  writer.varint32(tagwrench_link_Capabilities_strobe_period_max_us_tag,
                  message.strobe_period_max_us);
  writer.varint32(tagwrench_link_Capabilities_time_step_ns_tag, message.time_step_ns);
  writer.varint(tagwrench_link_Capabilities_measures_supply_tag, message.measures_supply);
  writer.varint(tagwrench_link_Capabilities_measures_temperature_tag, message.measures_temperature);
  return writer.count();
}

uint8_t encode(const CellSample& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::cell_sample, sequence, body);
  writer.varint(tagwrench_link_CellSample_channel_tag, message.channel);
  writer.sint32(tagwrench_link_CellSample_counts_tag, message.counts);
  writer.fixed32(tagwrench_link_CellSample_time_us_tag, message.time_us);
  writer.varint(tagwrench_link_CellSample_sequence_tag, message.sequence);
  writer.varint(tagwrench_link_CellSample_missed_tag, message.missed);
  writer.varint(tagwrench_link_CellSample_saturated_tag, message.saturated);
  return writer.count();
}

uint8_t encode(const AdcSample& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::adc_sample, sequence, body);
  writer.varint(tagwrench_link_AdcSample_channel_tag, message.channel);
  writer.varint(tagwrench_link_AdcSample_counts_tag, message.counts);
  writer.fixed32(tagwrench_link_AdcSample_time_us_tag, message.time_us);
  writer.varint(tagwrench_link_AdcSample_sequence_tag, message.sequence);
  return writer.count();
}

uint8_t encode(const ButtonEvent& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::button_event, sequence, body);
  writer.varint(tagwrench_link_ButtonEvent_button_tag, message.button);
  writer.varint(tagwrench_link_ButtonEvent_pressed_tag, message.pressed);
  writer.fixed32(tagwrench_link_ButtonEvent_time_us_tag, message.time_us);
  writer.varint(tagwrench_link_ButtonEvent_sequence_tag, message.sequence);
  return writer.count();
}

uint8_t encode(const TimeReply& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::time_reply, sequence, body);
  writer.varint(tagwrench_link_TimeReply_request_sequence_tag, message.request_sequence);
  writer.fixed32(tagwrench_link_TimeReply_received_us_tag, message.received_us);
  writer.varint(tagwrench_link_TimeReply_previous_request_sequence_tag,
                message.previous_request_sequence);
  writer.fixed32(tagwrench_link_TimeReply_previous_sent_us_tag, message.previous_sent_us);
  writer.varint(tagwrench_link_TimeReply_previous_valid_tag, message.previous_valid);
  return writer.count();
}

uint8_t encode(const Status& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::status, sequence, body);
  writer.fixed32(tagwrench_link_Status_time_us_tag, message.time_us);
  writer.fixed32(tagwrench_link_Status_session_tag, message.session);
  writer.varint(tagwrench_link_Status_led_level_permille_tag, message.led_level_permille);
  writer.varint(tagwrench_link_Status_led_limited_tag, message.led_limited);
  writer.varint32(tagwrench_link_Status_led_on_time_s_tag, message.led_on_time_s);
  writer.varint(tagwrench_link_Status_supply_mv_tag, message.supply_mv);
  writer.sint32(tagwrench_link_Status_temperature_centidegree_tag, message.temperature_centidegree);
  writer.varint(tagwrench_link_Status_bad_frames_tag, message.bad_frames);
  writer.varint(tagwrench_link_Status_unknown_kinds_tag, message.unknown_kinds);
  writer.varint(tagwrench_link_Status_overruns_tag, message.overruns);
  writer.varint(tagwrench_link_Status_dropped_reports_tag, message.dropped_reports);
  writer.packed(tagwrench_link_Status_cell_rate_centihertz_tag, message.cell_rate_centihertz,
                message.cell_count < kMaxCells ? message.cell_count : kMaxCells);
  writer.varint(tagwrench_link_Status_stack_free_bytes_tag, message.stack_free_bytes);
  writer.varint32(tagwrench_link_Status_longest_loop_us_tag, message.longest_loop_us);
  return writer.count();
}

uint8_t encode(const Answer& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::answer, sequence, body);
  writer.varint(tagwrench_link_Answer_request_kind_tag, message.request_kind);
  writer.varint(tagwrench_link_Answer_request_sequence_tag, message.request_sequence);
  writer.varint(tagwrench_link_Answer_result_tag, static_cast<uint8_t>(message.result));
  return writer.count();
}

uint8_t encode(const TareResult& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::tare_result, sequence, body);
  writer.varint(tagwrench_link_TareResult_channel_tag, message.channel);
  writer.sint32(tagwrench_link_TareResult_mean_counts_tag, message.mean_counts);
  writer.varint32(tagwrench_link_TareResult_spread_counts_tag, message.spread_counts);
  writer.varint(tagwrench_link_TareResult_conversions_tag, message.conversions);
  return writer.count();
}

uint8_t encode(const Fault& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::fault, sequence, body);
  writer.varint(tagwrench_link_Fault_code_tag, static_cast<uint8_t>(message.code));
  writer.varint(tagwrench_link_Fault_channel_tag, message.channel);
  writer.fixed32(tagwrench_link_Fault_time_us_tag, message.time_us);
  return writer.count();
}

bool decode(const uint8_t* bytes, uint8_t count, HelloRequest& message) {
  HelloRequest read = {};
  FieldReader reader(bytes, count);
  while (reader.next()) {
    switch (reader.field()) {
      case tagwrench_link_HelloRequest_protocol_major_tag:
        reader.varint(read.protocol_major);
        break;
      case tagwrench_link_HelloRequest_protocol_minor_tag:
        reader.varint(read.protocol_minor);
        break;
      case tagwrench_link_HelloRequest_session_tag: reader.fixed32(read.session); break;
      default: reader.skip();
    }
  }
  return take(reader, read, message);
}

bool decode(const uint8_t* bytes, uint8_t count, Configure& message) {
  Configure read = {};
  FieldReader reader(bytes, count);
  while (reader.next()) {
    switch (reader.field()) {
      case tagwrench_link_Configure_host_timeout_ms_tag: reader.varint(read.host_timeout_ms); break;
      case tagwrench_link_Configure_cells_tag:
        reader.enumerations(read.cells, read.cell_count, CellInput::a64);
        break;
      case tagwrench_link_Configure_cell_rate_sps_tag: reader.varint(read.cell_rate_sps); break;
      case tagwrench_link_Configure_adc_mask_tag: reader.varint(read.adc_mask); break;
      case tagwrench_link_Configure_adc_rate_hz_tag: reader.varint(read.adc_rate_hz); break;
      case tagwrench_link_Configure_status_period_ms_tag:
        reader.varint(read.status_period_ms);
        break;
      default: reader.skip();
    }
  }
  return take(reader, read, message);
}

bool decode(const uint8_t* bytes, uint8_t count, Led& message) {
  Led read = {};
  FieldReader reader(bytes, count);
  while (reader.next()) {
    switch (reader.field()) {
      case tagwrench_link_Led_mode_tag: reader.enumeration(read.mode, LedMode::pattern); break;
      case tagwrench_link_Led_level_permille_tag: reader.varint(read.level_permille); break;
      case tagwrench_link_Led_period_us_tag: reader.fixed32(read.period_us); break;
      case tagwrench_link_Led_width_us_tag: reader.varint(read.width_us); break;
      case tagwrench_link_Led_start_us_tag: reader.fixed32(read.start_us); break;
      case tagwrench_link_Led_pattern_seed_tag: reader.varint(read.pattern_seed); break;
      default: reader.skip();
    }
  }
  return take(reader, read, message);
}

bool decode(const uint8_t* bytes, uint8_t count, TimeRequest& message) {
  FieldReader reader(bytes, count);
  while (reader.next()) reader.skip();
  return take(reader, TimeRequest{}, message);
}

bool decode(const uint8_t* bytes, uint8_t count, Tare& message) {
  Tare read = {};
  FieldReader reader(bytes, count);
  while (reader.next()) {
    switch (reader.field()) {
      case tagwrench_link_Tare_cell_mask_tag: reader.varint(read.cell_mask); break;
      case tagwrench_link_Tare_conversions_tag: reader.varint(read.conversions); break;
      default: reader.skip();
    }
  }
  return take(reader, read, message);
}

bool decode(const uint8_t* bytes, uint8_t count, SetId& message) {
  SetId read = {};
  FieldReader reader(bytes, count);
  while (reader.next()) {
    if (reader.field() == tagwrench_link_SetId_unique_id_tag) {
      read.unique_id = UniqueId{};
      reader.bytes(read.unique_id.bytes, kIdBytes, read.unique_id.count);
    } else {
      reader.skip();
    }
  }
  return take(reader, read, message);
}

}  // namespace link
}  // namespace tagwrench

// What codec_board.cpp does by hand, done by nanopb with its descriptors instead: reports encoded,
// requests decoded.
#pragma once

#include <pb_decode.h>
#include <pb_encode.h>

#include <algorithm>
#include <stdexcept>

#include "protocol/codec_fields.h"
#include "protocol/link.pb.h"
#include "tests/unit/protocol/messages.h"

namespace tagwrench::link {

inline Bytes nanopb_encoded(Kind kind, std::uint8_t sequence, const pb_msgdesc_t& type,
                            const void* wire) {
  Bytes body{static_cast<std::uint8_t>(kind), sequence};
  body.resize(kMaxBodyBytes);
  pb_ostream_t stream = pb_ostream_from_buffer(body.data() + kHeaderBytes, kMaxMessageBytes);
  if (!pb_encode(&stream, &type, wire)) throw std::logic_error("nanopb could not encode");
  body.resize(kHeaderBytes + stream.bytes_written);
  return body;
}

inline Bytes nanopb_body(const Hello& m, std::uint8_t sequence) {
  tagwrench_link_Hello wire{};
  wire.protocol_major = m.protocol_major;
  wire.protocol_minor = m.protocol_minor;
  put_text(m.board, wire.board);
  put_text(m.firmware, wire.firmware);
  put_id(m.unique_id, wire.unique_id);
  wire.boot_id = m.boot_id;
  wire.reset_cause = static_cast<tagwrench_link_ResetCause>(m.reset_cause);
  wire.session = m.session;
  return nanopb_encoded(Kind::hello, sequence, tagwrench_link_Hello_msg, &wire);
}

inline Bytes nanopb_body(const Capabilities& m, std::uint8_t sequence) {
  const tagwrench_link_Capabilities wire{m.cells,
                                         m.adc_channels,
                                         m.adc_bits,
                                         m.buttons,
                                         m.led_levels,
                                         m.led_sustained_permille,
                                         m.led_full_time_ms,
                                         m.strobe_width_min_us,
                                         m.strobe_width_max_us,
                                         m.strobe_period_min_us,
                                         m.strobe_period_max_us,
                                         m.time_step_ns,
                                         m.measures_supply,
                                         m.measures_temperature};
  return nanopb_encoded(Kind::capabilities, sequence, tagwrench_link_Capabilities_msg, &wire);
}

inline Bytes nanopb_body(const CellSample& m, std::uint8_t sequence) {
  const tagwrench_link_CellSample wire{m.channel,  m.counts, m.time_us,
                                       m.sequence, m.missed, m.saturated};
  return nanopb_encoded(Kind::cell_sample, sequence, tagwrench_link_CellSample_msg, &wire);
}

inline Bytes nanopb_body(const AdcSample& m, std::uint8_t sequence) {
  const tagwrench_link_AdcSample wire{m.channel, m.counts, m.time_us, m.sequence};
  return nanopb_encoded(Kind::adc_sample, sequence, tagwrench_link_AdcSample_msg, &wire);
}

inline Bytes nanopb_body(const ButtonEvent& m, std::uint8_t sequence) {
  const tagwrench_link_ButtonEvent wire{m.button, m.pressed, m.time_us, m.sequence};
  return nanopb_encoded(Kind::button_event, sequence, tagwrench_link_ButtonEvent_msg, &wire);
}

inline Bytes nanopb_body(const TimeReply& m, std::uint8_t sequence) {
  const tagwrench_link_TimeReply wire{m.request_sequence, m.received_us,
                                      m.previous_request_sequence, m.previous_sent_us,
                                      m.previous_valid};
  return nanopb_encoded(Kind::time_reply, sequence, tagwrench_link_TimeReply_msg, &wire);
}

inline Bytes nanopb_body(const Status& m, std::uint8_t sequence) {
  tagwrench_link_Status wire{};
  wire.time_us = m.time_us;
  wire.session = m.session;
  wire.led_level_permille = m.led_level_permille;
  wire.led_limited = m.led_limited;
  wire.led_on_time_s = m.led_on_time_s;
  wire.supply_mv = m.supply_mv;
  wire.temperature_centidegree = m.temperature_centidegree;
  wire.bad_frames = m.bad_frames;
  wire.unknown_kinds = m.unknown_kinds;
  wire.overruns = m.overruns;
  wire.dropped_reports = m.dropped_reports;
  wire.cell_rate_centihertz_count = std::min(m.cell_count, kMaxCells);
  std::copy_n(m.cell_rate_centihertz, wire.cell_rate_centihertz_count, wire.cell_rate_centihertz);
  wire.stack_free_bytes = m.stack_free_bytes;
  wire.longest_loop_us = m.longest_loop_us;
  return nanopb_encoded(Kind::status, sequence, tagwrench_link_Status_msg, &wire);
}

inline Bytes nanopb_body(const Answer& m, std::uint8_t sequence) {
  const tagwrench_link_Answer wire{m.request_kind, m.request_sequence,
                                   static_cast<tagwrench_link_Result>(m.result)};
  return nanopb_encoded(Kind::answer, sequence, tagwrench_link_Answer_msg, &wire);
}

inline Bytes nanopb_body(const TareResult& m, std::uint8_t sequence) {
  const tagwrench_link_TareResult wire{m.channel, m.mean_counts, m.spread_counts, m.conversions};
  return nanopb_encoded(Kind::tare_result, sequence, tagwrench_link_TareResult_msg, &wire);
}

inline Bytes nanopb_body(const Fault& m, std::uint8_t sequence) {
  const tagwrench_link_Fault wire{static_cast<tagwrench_link_FaultCode>(m.code), m.channel,
                                  m.time_us};
  return nanopb_encoded(Kind::fault, sequence, tagwrench_link_Fault_msg, &wire);
}

/// Into the generated struct; false as decode() says false, but for enums, which nanopb takes
/// unseen.
template <class Wire>
bool nanopb_decoded(const Bytes& bytes, const pb_msgdesc_t& type, Wire& wire) {
  pb_istream_t stream = pb_istream_from_buffer(bytes.data(), bytes.size());
  return pb_decode(&stream, &type, &wire);
}

inline bool nanopb_decode(const Bytes& bytes, HelloRequest& m) {
  tagwrench_link_HelloRequest wire{};
  if (!nanopb_decoded(bytes, tagwrench_link_HelloRequest_msg, wire)) return false;
  m = {wire.protocol_major, wire.protocol_minor, wire.session};
  return true;
}

inline bool nanopb_decode(const Bytes& bytes, Configure& m) {
  tagwrench_link_Configure wire{};
  if (!nanopb_decoded(bytes, tagwrench_link_Configure_msg, wire)) return false;
  m = {};
  m.host_timeout_ms = wire.host_timeout_ms;
  m.cell_count = static_cast<std::uint8_t>(wire.cells_count);
  for (std::uint8_t i = 0; i < m.cell_count; ++i) {
    if (!take_enum(wire.cells[i], CellInput::a64, m.cells[i])) return false;
  }
  m.cell_rate_sps = wire.cell_rate_sps;
  m.adc_mask = wire.adc_mask;
  m.adc_rate_hz = wire.adc_rate_hz;
  m.status_period_ms = wire.status_period_ms;
  return true;
}

inline bool nanopb_decode(const Bytes& bytes, Led& m) {
  tagwrench_link_Led wire{};
  if (!nanopb_decoded(bytes, tagwrench_link_Led_msg, wire)) return false;
  LedMode mode;
  if (!take_enum(wire.mode, LedMode::pattern, mode)) return false;
  m = {mode, wire.level_permille, wire.period_us, wire.width_us, wire.start_us, wire.pattern_seed};
  return true;
}

inline bool nanopb_decode(const Bytes& bytes, TimeRequest&) {
  tagwrench_link_TimeRequest wire{};
  return nanopb_decoded(bytes, tagwrench_link_TimeRequest_msg, wire);
}

inline bool nanopb_decode(const Bytes& bytes, Tare& m) {
  tagwrench_link_Tare wire{};
  if (!nanopb_decoded(bytes, tagwrench_link_Tare_msg, wire)) return false;
  m = {wire.cell_mask, wire.conversions};
  return true;
}

inline bool nanopb_decode(const Bytes& bytes, SetId& m) {
  tagwrench_link_SetId wire{};
  if (!nanopb_decoded(bytes, tagwrench_link_SetId_msg, wire)) return false;
  take_id(wire.unique_id, m.unique_id);
  return true;
}

template <class Message>
concept Report = requires(const Message& message) {
  nanopb_body(message, std::uint8_t{0});
};
template <class Message>
concept Request = requires(const Bytes& bytes, Message& message) {
  nanopb_decode(bytes, message);
};

/// decode() and nanopb agree on these bytes. One difference is allowed: a Led that says its mode
/// twice, the first time unknown, is refused, where nanopb takes the last one.
template <Request Message>
bool decodes_as_nanopb(const Bytes& bytes) {
  Message by_hand{};
  Message by_nanopb{};
  const bool hand = decode(bytes.data(), static_cast<std::uint8_t>(bytes.size()), by_hand);
  const bool nanopb = nanopb_decode(bytes, by_nanopb);
  if (hand) return nanopb && same(by_hand, by_nanopb);
  if (!same(by_hand, Message{})) return false;
  if (!nanopb) return true;
  const Bytes canonical = body_of(by_nanopb, 0);
  return std::is_same_v<Message, Led> &&
         !std::equal(canonical.begin() + kHeaderBytes, canonical.end(), bytes.begin(), bytes.end());
}

}  // namespace tagwrench::link

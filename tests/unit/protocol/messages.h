// Every message type at a glance, for tests and fuzzers: a type's kind, its fields and one example.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "protocol/codec.h"

namespace tagwrench::link {

using Bytes = std::vector<std::uint8_t>;

/// References to all fields, so that two messages can be compared and one can be filled.
inline auto fields(HelloRequest& m) {
  return std::tie(m.protocol_major, m.protocol_minor, m.session);
}
inline auto fields(Configure& m) {
  return std::tie(m.host_timeout_ms, m.cells, m.cell_count, m.cell_rate_sps, m.adc_mask,
                  m.adc_rate_hz, m.status_period_ms);
}
inline auto fields(Led& m) {
  return std::tie(m.mode, m.level_permille, m.period_us, m.width_us, m.start_us, m.pattern_seed);
}
inline auto fields(TimeRequest&) { return std::tie(); }
inline auto fields(Tare& m) { return std::tie(m.cell_mask, m.conversions); }
inline auto fields(SetId& m) { return std::tie(m.unique_id); }
inline auto fields(Hello& m) {
  return std::tie(m.protocol_major, m.protocol_minor, m.board, m.firmware, m.unique_id, m.boot_id,
                  m.reset_cause, m.session);
}
inline auto fields(Capabilities& m) {
  return std::tie(m.cells, m.adc_channels, m.adc_bits, m.buttons, m.led_levels,
                  m.led_sustained_permille, m.led_full_time_ms, m.strobe_width_min_us,
                  m.strobe_width_max_us, m.strobe_period_min_us, m.strobe_period_max_us,
                  m.time_step_ns, m.measures_supply, m.measures_temperature);
}
inline auto fields(CellSample& m) {
  return std::tie(m.channel, m.counts, m.time_us, m.sequence, m.missed, m.saturated);
}
inline auto fields(AdcSample& m) { return std::tie(m.channel, m.counts, m.time_us, m.sequence); }
inline auto fields(ButtonEvent& m) { return std::tie(m.button, m.pressed, m.time_us, m.sequence); }
inline auto fields(TimeReply& m) {
  return std::tie(m.request_sequence, m.received_us, m.previous_request_sequence,
                  m.previous_sent_us, m.previous_valid);
}
inline auto fields(Status& m) {
  return std::tie(m.time_us, m.session, m.led_level_permille, m.led_limited, m.led_on_time_s,
                  m.supply_mv, m.temperature_centidegree, m.bad_frames, m.unknown_kinds, m.overruns,
                  m.dropped_reports, m.cell_rate_centihertz, m.cell_count, m.stack_free_bytes,
                  m.longest_loop_us);
}
inline auto fields(Answer& m) { return std::tie(m.request_kind, m.request_sequence, m.result); }
inline auto fields(TareResult& m) {
  return std::tie(m.channel, m.mean_counts, m.spread_counts, m.conversions);
}
inline auto fields(Fault& m) { return std::tie(m.code, m.channel, m.time_us); }

inline bool same_field(const UniqueId& a, const UniqueId& b) {
  return a.count == b.count && std::equal(a.bytes, a.bytes + kIdBytes, b.bytes);
}
template <class T, std::size_t n>
bool same_field(const T (&a)[n], const T (&b)[n]) {
  return std::equal(a, a + n, b);
}
template <class T>
requires std::is_arithmetic_v<T> || std::is_enum_v<T>
bool same_field(const T& a, const T& b) { return a == b; }

/// Field by field; what lies between them does not count.
template <class Message>
bool same(Message a, Message b) {
  const auto left = fields(a);
  const auto right = fields(b);
  return [&]<std::size_t... i>(std::index_sequence<i...>) {
    return (same_field(std::get<i>(left), std::get<i>(right)) && ...);
  }
  (std::make_index_sequence<std::tuple_size_v<decltype(left)>>{});
}

/// One of every type, as on an ordinary day. protocol/README.md shows their bytes.
struct Examples {
  HelloRequest hello_request{.protocol_major = 1, .protocol_minor = 0, .session = 0x5EA51234};
  Configure configure{.host_timeout_ms = 5000,
                      .cells = {CellInput::a128, CellInput::a128, CellInput::off, CellInput::a64},
                      .cell_count = 4,
                      .cell_rate_sps = 80,
                      .adc_mask = 3,
                      .adc_rate_hz = 100,
                      .status_period_ms = 1000};
  Led led{.mode = LedMode::strobe,
          .level_permille = 0,
          .period_us = 33333,
          .width_us = 500,
          .start_us = 0x00C0FFEE,
          .pattern_seed = 0};
  TimeRequest time_request{};
  Tare tare{.cell_mask = 0b1011, .conversions = 80};
  SetId set_id{{.bytes = {0x54, 0x57, 0, 0, 0, 0, 0, 0x2A}, .count = 8}};
  Hello hello{.protocol_major = 1,
              .protocol_minor = 0,
              .board = "atmega328p",
              .firmware = "0.1.0",
              .unique_id = {.bytes = {0x54, 0x57, 0, 0, 0, 0, 0, 0x2A}, .count = 8},
              .boot_id = 0xB007B007,
              .reset_cause = ResetCause::watchdog,
              .session = 0x5EA51234};
  Capabilities capabilities{.cells = 4,
                            .adc_channels = 2,
                            .adc_bits = 10,
                            .buttons = 2,
                            .led_levels = 256,
                            .led_sustained_permille = 300,
                            .led_full_time_ms = 10000,
                            .strobe_width_min_us = 20,
                            .strobe_width_max_us = 30000,
                            .strobe_period_min_us = 1000,
                            .strobe_period_max_us = 1000000,
                            .time_step_ns = 500,
                            .measures_supply = true,
                            .measures_temperature = true};
  CellSample cell_sample{.channel = 2,
                         .counts = -123456,
                         .time_us = 0x01020304,
                         .sequence = 4660,
                         .missed = 0,
                         .saturated = false};
  AdcSample adc_sample{.channel = 1, .counts = 512, .time_us = 0x0000FFFF, .sequence = 300};
  ButtonEvent button_event{.button = 1, .pressed = true, .time_us = 3000000, .sequence = 7};
  TimeReply time_reply{.request_sequence = 200,
                       .received_us = 0xFFFFFFF0,
                       .previous_request_sequence = 199,
                       .previous_sent_us = 0xFFFFB2E0,
                       .previous_valid = true};
  Status status{.time_us = 60000000,
                .session = 0x5EA51234,
                .led_level_permille = 300,
                .led_limited = true,
                .led_on_time_s = 59,
                .supply_mv = 4985,
                .temperature_centidegree = -250,
                .bad_frames = 1,
                .unknown_kinds = 0,
                .overruns = 0,
                .dropped_reports = 0,
                .cell_rate_centihertz = {8012, 7990, 0, 8003},
                .cell_count = 4,
                .stack_free_bytes = 975,
                .longest_loop_us = 2300};
  Answer answer{.request_kind = 0x7E, .request_sequence = 9, .result = Result::unknown_kind};
  TareResult tare_result{
      .channel = 3, .mean_counts = 84213, .spread_counts = 190, .conversions = 80};
  Fault fault{.code = FaultCode::host_silent, .channel = 0, .time_us = 65000000};

  /// `visit(kind, name, message)` for each.
  template <class Visit>
  void each(Visit visit) const {
    visit(Kind::hello_request, "HelloRequest", hello_request);
    visit(Kind::configure, "Configure", configure);
    visit(Kind::led, "Led", led);
    visit(Kind::time_request, "TimeRequest", time_request);
    visit(Kind::tare, "Tare", tare);
    visit(Kind::set_id, "SetId", set_id);
    visit(Kind::hello, "Hello", hello);
    visit(Kind::capabilities, "Capabilities", capabilities);
    visit(Kind::cell_sample, "CellSample", cell_sample);
    visit(Kind::adc_sample, "AdcSample", adc_sample);
    visit(Kind::button_event, "ButtonEvent", button_event);
    visit(Kind::time_reply, "TimeReply", time_reply);
    visit(Kind::status, "Status", status);
    visit(Kind::answer, "Answer", answer);
    visit(Kind::tare_result, "TareResult", tare_result);
    visit(Kind::fault, "Fault", fault);
  }
};

template <class Message>
Bytes body_of(const Message& message, std::uint8_t sequence) {
  Bytes body(kMaxBodyBytes);
  body.resize(encode(message, sequence, body.data()));
  return body;
}

inline Bytes frame_of(const Bytes& body) {
  Bytes frame(kMaxFrameBytes);
  frame.resize(write_frame(body.data(), static_cast<std::uint8_t>(body.size()), frame.data()));
  return frame;
}

template <class Message>
Bytes frame_of(const Message& message, std::uint8_t sequence) {
  return frame_of(body_of(message, sequence));
}

}  // namespace tagwrench::link

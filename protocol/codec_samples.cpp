// The frequent messages. Encoding by hand follows the protobuf encoding (protobuf.dev, "Encoding"):
// a field is a tag (number * 8 + wire type) and a value, and proto3 omits fields that are zero.
#include "protocol/codec_body.h"

namespace tagwrench {
namespace link {
namespace {

/// A field's first byte: what it is on the wire, and its number in link.proto.
constexpr uint8_t varint_tag(uint8_t field) { return static_cast<uint8_t>(field << 3); }
constexpr uint8_t fixed32_tag(uint8_t field) { return static_cast<uint8_t>((field << 3) | 5); }

/// Writes fields of fewer than 16 in number behind a body's header.
class FieldWriter {
 public:
  FieldWriter(Kind kind, uint8_t sequence, uint8_t* body) : body_(body), end_(kHeaderBytes) {
    body[0] = static_cast<uint8_t>(kind);
    body[1] = sequence;
  }

  void varint(uint8_t field, uint32_t value) {
    if (value == 0) return;
    add(varint_tag(field));
    while (value >= 0x80) {
      add(static_cast<uint8_t>(value | 0x80));
      value >>= 7;
    }
    add(static_cast<uint8_t>(value));
  }

  /// Zigzag: 0, -1, 1, -2 ... become 0, 1, 2, 3 ...
  void sint32(uint8_t field, int32_t value) {
    const uint32_t doubled = static_cast<uint32_t>(value) << 1;
    varint(field, value < 0 ? ~doubled : doubled);
  }

  void fixed32(uint8_t field, uint32_t value) {
    if (value == 0) return;
    add(fixed32_tag(field));
    add(static_cast<uint8_t>(value));
    add(static_cast<uint8_t>(value >> 8));
    add(static_cast<uint8_t>(value >> 16));
    add(static_cast<uint8_t>(value >> 24));
  }

  uint8_t bytes() const { return end_; }

 private:
  void add(uint8_t byte) { body_[end_++] = byte; }

  uint8_t* body_;
  uint8_t end_;
};

}  // namespace

uint8_t encode(const CellSample& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::cell_sample, sequence, body);
  writer.varint(tagwrench_link_CellSample_channel_tag, message.channel);
  writer.sint32(tagwrench_link_CellSample_counts_tag, message.counts);
  writer.fixed32(tagwrench_link_CellSample_time_us_tag, message.time_us);
  writer.varint(tagwrench_link_CellSample_sequence_tag, message.sequence);
  writer.varint(tagwrench_link_CellSample_missed_tag, message.missed);
  writer.varint(tagwrench_link_CellSample_saturated_tag, message.saturated ? 1 : 0);
  return writer.bytes();
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

uint8_t encode(const AdcSample& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::adc_sample, sequence, body);
  writer.varint(tagwrench_link_AdcSample_channel_tag, message.channel);
  writer.varint(tagwrench_link_AdcSample_counts_tag, message.counts);
  writer.fixed32(tagwrench_link_AdcSample_time_us_tag, message.time_us);
  writer.varint(tagwrench_link_AdcSample_sequence_tag, message.sequence);
  return writer.bytes();
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

uint8_t encode(const TimeReply& message, uint8_t sequence, uint8_t* body) {
  FieldWriter writer(Kind::time_reply, sequence, body);
  writer.varint(tagwrench_link_TimeReply_request_sequence_tag, message.request_sequence);
  writer.fixed32(tagwrench_link_TimeReply_received_us_tag, message.received_us);
  writer.varint(tagwrench_link_TimeReply_previous_request_sequence_tag,
                message.previous_request_sequence);
  writer.fixed32(tagwrench_link_TimeReply_previous_sent_us_tag, message.previous_sent_us);
  writer.varint(tagwrench_link_TimeReply_previous_valid_tag, message.previous_valid ? 1 : 0);
  return writer.bytes();
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

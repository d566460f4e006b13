#include "firmware/app/link.h"

namespace tagwrench {
namespace firmware {
namespace {

/// A poll that is fed without end must come to its end.
constexpr uint8_t kMaxBytesAtOnce = 2 * link::kMaxFrameBytes;

}  // namespace

bool Link::receive() {
  if (board::serial_room() < kMaxAnswerBytes) return false;
  board::SerialByte byte;
  for (uint8_t i = 0; i < kMaxBytesAtOnce && board::serial_take(byte); ++i) {
    const link::Received received = reader_.take(byte.value);
    if (received == link::Received::frame) {
      received_us_ = byte.time_us;
      return true;
    }
    if (received == link::Received::damaged) return false;
  }
  return false;
}

bool Link::post(uint8_t* frame, uint8_t body_bytes, bool stamped) {
  const uint8_t count = link::write_frame(frame + 1, body_bytes, frame);
  if (board::serial_room() < count) {
    ++dropped_;
    return false;
  }
  board::serial_send(frame, count, stamped);
  ++sequence_;
  return true;
}

void Link::answer(link::Result result) {
  send(link::Answer{reader_.kind(), reader_.sequence(), result});
}

void Link::answer_time() {
  link::TimeReply reply = {};
  reply.request_sequence = reader_.sequence();
  reply.received_us = received_us_;
  uint32_t sent_us;
  if (previous_answered_ && board::serial_departure(sent_us)) {
    reply.previous_request_sequence = previous_request_;
    reply.previous_sent_us = sent_us;
    reply.previous_valid = true;
  }
  uint8_t frame[link::kMaxFrameBytes];
  previous_answered_ = post(frame, encode(reply, sequence_, frame + 1), true);
  previous_request_ = reply.request_sequence;
}

}  // namespace firmware
}  // namespace tagwrench

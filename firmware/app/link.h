// The wire as the application sees it: whole requests in, whole reports out.
#pragma once

#include "firmware/board/board.h"
#include "protocol/frame.h"

namespace tagwrench {
namespace firmware {

class Link {
 public:
  /// On the wire, of a sample (CellSample has at most 22 bytes of message), and of an answer
  /// (TimeReply: 18).
  static constexpr uint8_t kMaxSampleBytes = 1 + link::kHeaderBytes + 22 + link::kCrcBytes + 1;
  static constexpr uint8_t kMaxAnswerBytes = 1 + link::kHeaderBytes + 18 + link::kCrcBytes + 1;

  /// Takes bytes that have come, up to the end of one frame. True: that frame is a good one, and
  /// kind() and the others speak of it until the next call. Takes nothing while there is no room
  /// for an answer, so that a request is never taken and then left unanswered.
  bool receive();
  uint8_t kind() const { return reader_.kind(); }
  template <class Message>
  bool read(Message& message) const {
    return decode(reader_.message(), reader_.message_bytes(), message);
  }

  /// Sends the whole report or, if there is no room for it, drops and counts it and returns false.
  template <class Message>
  bool send(const Message& message) {
    uint8_t frame[link::kMaxFrameBytes];
    return post(frame, encode(message, sequence_, frame + 1), false);
  }
  /// Is there room for a sample, and for the longest report?
  bool has_room() const { return board::serial_room() >= kMaxSampleBytes; }
  bool roomy() const { return board::serial_room() >= link::kMaxFrameBytes; }

  void answer(link::Result result);
  /// Answers a TimeRequest, whose arrival the board has stamped.
  void answer_time();

  uint16_t damaged_frames() const { return reader_.damaged_frames(); }
  /// Reports that were never made, because what they are of was gone when there was room.
  void count_dropped(uint8_t reports) { dropped_ = static_cast<uint16_t>(dropped_ + reports); }
  uint16_t dropped_reports() const { return dropped_; }

 private:
  /// Of a body that stands at frame + 1.
  bool post(uint8_t* frame, uint8_t body_bytes, bool stamped);

  link::FrameReader reader_;
  uint32_t received_us_ = 0;  ///< end of the last good frame
  uint16_t dropped_ = 0;
  uint8_t sequence_ = 0;
  uint8_t previous_request_ = 0;  ///< that was answered by answer_time()
  bool previous_answered_ = false;
};

}  // namespace firmware
}  // namespace tagwrench

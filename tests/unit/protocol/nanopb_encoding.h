// The messages that codec_samples.cpp encodes by hand, encoded by nanopb instead.
#pragma once

#include <pb_encode.h>

#include <stdexcept>

#include "protocol/link.pb.h"
#include "tests/unit/protocol/messages.h"

namespace tagwrench::link {

inline Bytes nanopb_body(Kind kind, std::uint8_t sequence, const pb_msgdesc_t& type,
                         const void* message) {
  Bytes body{static_cast<std::uint8_t>(kind), sequence};
  body.resize(kMostBodyBytes);
  pb_ostream_t stream = pb_ostream_from_buffer(body.data() + kHeaderBytes, kMostMessageBytes);
  if (!pb_encode(&stream, &type, message)) throw std::logic_error("nanopb could not encode");
  body.resize(kHeaderBytes + stream.bytes_written);
  return body;
}

inline Bytes nanopb_body(const CellSample& m, std::uint8_t sequence) {
  const tagwrench_link_CellSample wire{m.channel,  m.counts, m.time_us,
                                       m.sequence, m.missed, m.saturated};
  return nanopb_body(Kind::cell_sample, sequence, tagwrench_link_CellSample_msg, &wire);
}

inline Bytes nanopb_body(const AdcSample& m, std::uint8_t sequence) {
  const tagwrench_link_AdcSample wire{m.channel, m.counts, m.time_us, m.sequence};
  return nanopb_body(Kind::adc_sample, sequence, tagwrench_link_AdcSample_msg, &wire);
}

inline Bytes nanopb_body(const TimeReply& m, std::uint8_t sequence) {
  const tagwrench_link_TimeReply wire{m.request_sequence, m.received_us,
                                      m.previous_request_sequence, m.previous_sent_us,
                                      m.previous_valid};
  return nanopb_body(Kind::time_reply, sequence, tagwrench_link_TimeReply_msg, &wire);
}

}  // namespace tagwrench::link

#include "protocol/codec_body.h"

#include <pb_decode.h>
#include <pb_encode.h>

namespace tagwrench {
namespace link {

static_assert(tagwrench_link_HelloRequest_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Configure_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Led_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Tare_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_SetId_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Hello_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Capabilities_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_CellSample_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_AdcSample_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_ButtonEvent_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_TimeReply_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Status_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Answer_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_TareResult_size <= kMaxMessageBytes, "fits");
static_assert(tagwrench_link_Fault_size <= kMaxMessageBytes, "fits");

uint8_t encode_body(Kind kind, uint8_t sequence, const pb_msgdesc_t& fields, const void* message,
                    uint8_t* body) {
  body[0] = static_cast<uint8_t>(kind);
  body[1] = sequence;
  pb_ostream_t stream = pb_ostream_from_buffer(body + kHeaderBytes, kMaxMessageBytes);
  pb_encode(&stream, &fields, message);
  return static_cast<uint8_t>(kHeaderBytes + stream.bytes_written);
}

bool decode_message(const uint8_t* bytes, uint8_t count, const pb_msgdesc_t& fields,
                    void* message) {
  pb_istream_t stream = pb_istream_from_buffer(bytes, count);
  return pb_decode(&stream, &fields, message);
}

}  // namespace link
}  // namespace tagwrench

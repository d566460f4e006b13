// What the codec's files share: nanopb around one body.
#pragma once

#include <pb.h>

#include "protocol/codec.h"
#include "protocol/link.pb.h"

namespace tagwrench {
namespace link {

/// Writes header and message to `body`, kMaxBodyBytes of room, and returns the length. `message`
/// is the generated struct of `fields`, which cannot be longer than kMaxMessageBytes.
uint8_t encode_body(Kind kind, uint8_t sequence, const pb_msgdesc_t& fields, const void* message,
                    uint8_t* body);

/// False: not a message of this type.
bool decode_message(const uint8_t* bytes, uint8_t count, const pb_msgdesc_t& fields, void* message);

}  // namespace link
}  // namespace tagwrench

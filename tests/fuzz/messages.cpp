// Messages: the first byte names a kind, the rest is decoded as one. What decodes re-encodes, and
// decodes to the same again; what is encoded or decoded by hand agrees with nanopb.
#include "tests/unit/protocol/messages.h"

#include <vector>

#include "tests/fuzz/expect.h"
#include "tests/unit/protocol/nanopb_codec.h"

namespace {

using namespace tagwrench::link;
using tagwrench::expect;

template <class Message>
void check(Kind kind, const std::vector<std::uint8_t>& bytes) {
  if constexpr (Request<Message>) {
    expect(decodes_as_nanopb<Message>(bytes), "the hand decoder reads and refuses as nanopb");
  }
  Message read{};
  if (!decode(bytes.data(), static_cast<std::uint8_t>(bytes.size()), read)) {
    expect(same(read, Message{}), "a message that is refused is all zero");
    return;
  }
  const Bytes body = body_of(read, 0xA5);
  expect(body.size() >= kHeaderBytes && body.size() <= kMaxBodyBytes, "a message fits in a body");
  expect(body[0] == static_cast<std::uint8_t>(kind) && body[1] == 0xA5, "the header is right");
  Message again{};
  expect(decode(body.data() + kHeaderBytes, static_cast<std::uint8_t>(body.size() - kHeaderBytes),
                again),
         "what was encoded decodes");
  expect(same(read, again), "to the same message");
  if constexpr (Report<Message>) {
    expect(body == nanopb_body(read, 0xA5), "the hand encoder writes nanopb's bytes");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  if (count == 0 || count > 256) return 0;
  // In a buffer of its own size, so that the sanitizer sees one byte too many.
  const std::vector<std::uint8_t> message(bytes + 1, bytes + count);
  Examples{}.each([&]<class Message>(Kind kind, const char*, const Message&) {
    if (static_cast<std::uint8_t>(kind) == bytes[0]) check<Message>(kind, message);
  });
  return 0;
}

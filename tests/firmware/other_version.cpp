#include "tests/firmware/other_version.h"

#include <array>

namespace tagwrench::emulator {

std::vector<std::uint8_t> OtherVersion::pass(const std::vector<std::uint8_t>& bytes) {
  if (!major_) return bytes;
  std::vector<std::uint8_t> passed;
  for (const std::uint8_t byte : bytes) {
    frame_.push_back(byte);
    const link::Received received = reader_.take(byte);
    if (byte != 0) continue;
    const bool hello = received == link::Received::frame &&
                       static_cast<link::Kind>(reader_.kind()) == link::Kind::hello;
    if (hello) forge();
    passed.insert(passed.end(), frame_.begin(), frame_.end());
    frame_.clear();
  }
  return passed;
}

void OtherVersion::forge() {
  link::Hello hello{};
  if (!link::decode(reader_.message(), reader_.message_bytes(), hello)) return;
  hello.protocol_major = *major_;
  std::array<std::uint8_t, link::kMaxBodyBytes> body{};
  std::array<std::uint8_t, link::kMaxFrameBytes> frame{};
  const std::uint8_t count = link::encode(hello, reader_.sequence(), body.data());
  const std::uint8_t bytes = link::write_frame(body.data(), count, frame.data());
  frame_.assign(frame.begin(), frame.begin() + bytes);
}

}  // namespace tagwrench::emulator

#include "host/board/hex_image.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "host/core/parse.h"

namespace tagwrench {
namespace {

enum class HexRecord : std::uint8_t { wrong, data, end };

/// One line: ":", then length, address (2), type, data and checksum in hex digits; all bytes
/// together are 0 modulo 256.
HexRecord hex_record(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (line.size() < 11 || line.size() % 2 == 0 || line[0] != ':') return HexRecord::wrong;
  unsigned sum = 0;
  std::array<unsigned, 4> head{};
  for (std::size_t i = 0; i < line.size() / 2; ++i) {
    const auto byte = parse_whole<unsigned>(line.substr(1 + 2 * i, 2), 16);
    if (!byte) return HexRecord::wrong;
    if (i < head.size()) head[i] = *byte;
    sum += *byte;
  }
  if (sum % 256 != 0 || line.size() != 11 + 2 * head[0]) return HexRecord::wrong;
  return head[3] == 1 ? HexRecord::end : HexRecord::data;
}

}  // namespace

bool is_whole_hex_image(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const HexRecord record = hex_record(text.substr(0, end));
    if (record != HexRecord::data) return record == HexRecord::end;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return false;
}

}  // namespace tagwrench

#include "host/core/printable.h"

#include <cstddef>
#include <cstdint>

namespace tagwrench {
namespace {

struct Character {
  char32_t code = 0;
  std::size_t bytes = 0;  ///< none: not UTF-8
};

/// The first of the text (RFC 3629): shortest form, no surrogates, up to U+10FFFF.
Character first_of(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) return {first, 1};
  const std::size_t bytes = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < bytes) return {};
  char32_t code = first & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr char32_t kFirstOfLength[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  if (code < kFirstOfLength[bytes] || surrogate || code > 0x10ffff) return {};
  return {code, bytes};
}

/// Shown as it is, where it is.
bool is_harmless(char32_t code) noexcept {
  const auto within = [code](char32_t first, char32_t last) {
    return code >= first && code <= last;
  };
  const bool control = code < 0x20 || within(0x7f, 0x9f) || code == 0x2028 || code == 0x2029;
  const bool direction = code == 0x061c || within(0x200e, 0x200f) || within(0x202a, 0x202e) ||
                         within(0x2066, 0x2069) || code == 0xfeff;
  return !control && !direction;
}

}  // namespace

std::size_t write_printable(std::span<char> into, std::string_view text) noexcept {
  constexpr std::string_view kDigits = "0123456789abcdef";
  constexpr std::size_t kEscape = 4;  // bytes of "\\x1b"
  std::size_t size = 0;
  while (!text.empty()) {
    const Character next = first_of(text);
    const bool shown = next.bytes > 0 && is_harmless(next.code);
    const std::string_view bytes = text.substr(0, next.bytes > 0 ? next.bytes : 1);
    if (into.size() - size < bytes.size() * (shown ? 1 : kEscape)) break;
    for (const char c : bytes) {
      const auto byte = static_cast<std::uint8_t>(c);
      if (shown) {
        into[size++] = c;
        continue;
      }
      for (const char escape : {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]})
        into[size++] = escape;
    }
    text.remove_prefix(bytes.size());
  }
  return size;
}

std::string printable(std::string_view text) {
  std::string out(4 * text.size(), '\0');
  out.resize(write_printable(out, text));
  return out;
}

}  // namespace tagwrench

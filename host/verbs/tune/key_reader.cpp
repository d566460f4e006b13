#include "host/verbs/tune/key_reader.h"

namespace tagwrench {
namespace {

constexpr char kEscape = '\x1b';
constexpr char kControlC = '\x03';

/// Takes "[A" or "O1;2B" behind an escape, and says which arrow it is; anything else is none.
Key::Kind arrow(std::string_view& rest) {
  std::size_t size = 1;
  while (size < rest.size() && (rest[size] < '@' || rest[size] > '~')) ++size;
  const char last = size < rest.size() ? rest[size] : '\0';
  rest.remove_prefix(size < rest.size() ? size + 1 : rest.size());
  switch (last) {
    case 'A':
      return Key::Kind::up;
    case 'B':
      return Key::Kind::down;
    case 'C':
      return Key::Kind::right;
    case 'D':
      return Key::Kind::left;
    default:
      return Key::Kind::character;
  }
}

}  // namespace

std::vector<Key> keys_in(std::string_view bytes) {
  std::vector<Key> keys;
  while (!bytes.empty()) {
    const char c = bytes.front();
    bytes.remove_prefix(1);
    if (c == kEscape && !bytes.empty() && (bytes.front() == '[' || bytes.front() == 'O')) {
      const Key::Kind kind = arrow(bytes);
      if (kind != Key::Kind::character) keys.push_back({kind});
    } else if (c == kEscape) {
      keys.push_back({Key::Kind::escape});
    } else if (c == kControlC) {
      keys.push_back({Key::Kind::stop});
    } else if (c == '\r' || c == '\n') {
      keys.push_back({Key::Kind::enter});
    } else if (c == '\x7f' || c == '\b') {
      keys.push_back({Key::Kind::erase});
    } else if (c >= ' ' && c < '\x7f') {
      keys.push_back({Key::Kind::character, c});
    }
  }
  return keys;
}

}  // namespace tagwrench

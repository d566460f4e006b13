// i3's IPC as pure bytes, which sway speaks too (i3-ipc(7), sway-ipc(7)): "i3-ipc", the length and
// the type of what follows in host byte order, then JSON.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host/motion/focus_watch.h"

namespace tagwrench {

enum class I3Type : std::uint32_t {
  subscribe = 2,
  tree = 4,
  window_event = 0x80000003U,
};

std::string i3_message(I3Type type, std::string_view payload);

struct I3Message {
  std::uint32_t type = 0;
  std::string payload;
};

/// Bytes as they come, cut into messages. Of a message longer than kMax the payload is passed
/// over and counts as empty.
class I3Stream {
 public:
  static constexpr std::size_t kMax = 1 << 20;

  /// False: this is not i3's IPC.
  bool put(std::string_view bytes);
  std::optional<I3Message> next();

 private:
  static constexpr std::size_t kHead = 14;

  std::string bytes_;
  std::size_t passed_over_ = 0;  ///< bytes still to come of a payload that is too long
};

/// The window with the focus, in the answer to `tree` or in a window's event. Nothing: the text
/// does not say which one it is now.
std::optional<Focus> focus_in(const I3Message& message);

}  // namespace tagwrench

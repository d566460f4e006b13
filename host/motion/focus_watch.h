// Which program has the focus, where the desktop tells: window managers of X11, i3, sway, KDE.
// Other Wayland desktops tell nobody but their own extensions, and those may say it by `tagwrench
// control window`.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tagwrench {

/// What is said of the focus.
struct Focus {
  bool told = false;      ///< false: nobody knows which window has it
  std::string program{};  ///< the class or the application id of that window, in lower case; empty
                          ///< if it has none
  bool ended = false;     ///< nothing will ever be said any more
};

class FocusWatch {
 public:
  FocusWatch() = default;
  FocusWatch(const FocusWatch&) = delete;
  FocusWatch& operator=(const FocusWatch&) = delete;
  virtual ~FocusWatch() = default;

  /// Of the desktop that $SWAYSOCK, $I3SOCK, the session's D-Bus or $DISPLAY lead to, the first
  /// that answers; null if there is none.
  static std::unique_ptr<FocusWatch> open();

  /// Readable when changed() has something to do.
  virtual int fd() const noexcept = 0;
  /// What is new since the last call; nothing: it is where it was.
  virtual std::optional<Focus> changed() noexcept = 0;
};

inline std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

// i3's IPC as pure bytes, which sway speaks too (i3-ipc(7), sway-ipc(7)): "i3-ipc", the length and
// the type of what follows in host byte order, then JSON.

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

/// Bytes as they come, cut into messages. Of one longer than kMax the payload counts as empty.
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

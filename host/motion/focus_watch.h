// Which program has the focus, where the desktop tells: window managers of X11, i3, sway, KDE.
// Other Wayland desktops tell nobody but their own extensions, and those may say it by `tagwrench
// control window`.
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace tagwrench {

class FocusSource;

/// What is said of the focus.
struct Focus {
  bool told = false;      ///< false: nobody knows which window has it
  std::string program{};  ///< the class or the application id of that window, in lower case; empty
                          ///< if it has none
  bool ended = false;     ///< nothing will ever be said any more
};

class FocusWatch {
 public:
  /// Of the desktop that $SWAYSOCK, $I3SOCK, the session's D-Bus or $DISPLAY lead to, the first
  /// that answers; nothing if there is none.
  static std::optional<FocusWatch> open();

  FocusWatch(FocusWatch&&) noexcept;
  FocusWatch& operator=(FocusWatch&&) noexcept;
  ~FocusWatch();

  /// Readable when changed() has something to do.
  int fd() const noexcept;
  /// What is new since the last call; nothing: it is where it was.
  std::optional<Focus> changed() noexcept;

 private:
  explicit FocusWatch(std::unique_ptr<FocusSource> source);

  std::unique_ptr<FocusSource> source_;
};

}  // namespace tagwrench

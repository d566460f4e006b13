// Which program has the focus, as an X11 window manager tells (Extended Window Manager Hints 1.5,
// _NET_ACTIVE_WINDOW; ICCCM 4.1.2.5, WM_CLASS). Wayland tells nobody.
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace tagwrench {

class FocusWatch {
 public:
  /// Of the display that $DISPLAY names; nothing if there is none.
  static std::optional<FocusWatch> open();

  FocusWatch(FocusWatch&&) noexcept;
  FocusWatch& operator=(FocusWatch&&) = delete;
  ~FocusWatch();

  /// Readable when changed() has something to do.
  int fd() const noexcept;
  /// The class of the window that got the focus since the last call, in lower case; empty for one
  /// without a class. Nothing: it is where it was, or nobody tells any more.
  std::optional<std::string> changed() noexcept;

 private:
  struct Connection;
  explicit FocusWatch(std::unique_ptr<Connection> connection);

  std::unique_ptr<Connection> connection_;
};

}  // namespace tagwrench

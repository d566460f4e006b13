// Which program has the focus, where the desktop tells: window managers of X11, i3, sway, KDE.
// Other Wayland desktops tell nobody but their own extensions, and those may say it by `tagwrench
// control window`.
#pragma once

#include <algorithm>
#include <cctype>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

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

// Who tells the focus: one kind for each way that desktops have.

class FocusSource {
 public:
  FocusSource() = default;
  FocusSource(const FocusSource&) = delete;
  FocusSource& operator=(const FocusSource&) = delete;
  virtual ~FocusSource() = default;

  /// As FocusWatch has them.
  virtual int fd() const noexcept = 0;
  virtual std::optional<Focus> changed() noexcept = 0;
};

/// Extended Window Manager Hints 1.5, _NET_ACTIVE_WINDOW; ICCCM 4.1.2.5, WM_CLASS. Null: no
/// $DISPLAY, or nobody answers there.
std::unique_ptr<FocusSource> focus_on_x11();
/// i3's IPC, which sway has too (i3-ipc(7), sway-ipc(7)). Null: nobody listens at `path`.
std::unique_ptr<FocusSource> focus_by_i3_ipc(const std::string& path);

/// KDE's compositor on Wayland, by a script that it is given. Null: it does not run in this
/// session.
std::unique_ptr<FocusSource> focus_in_kwin();

inline std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

}  // namespace tagwrench

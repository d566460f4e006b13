#include "host/motion/focus_watch.h"

#include <cstdlib>

namespace tagwrench {

FocusWatch::FocusWatch(std::unique_ptr<FocusSource> source) : source_(std::move(source)) {}
FocusWatch::FocusWatch(FocusWatch&&) noexcept = default;
FocusWatch& FocusWatch::operator=(FocusWatch&&) noexcept = default;
FocusWatch::~FocusWatch() = default;

std::optional<FocusWatch> FocusWatch::open() {
  // X11 last: sway and KWin start an X server too, which knows nothing of Wayland's windows.
  for (const char* name : {"SWAYSOCK", "I3SOCK"}) {
    const char* path = std::getenv(name);
    if (path == nullptr || path[0] == '\0') continue;
    if (auto source = focus_by_i3_ipc(path)) return FocusWatch(std::move(source));
  }
  if (auto source = focus_in_kwin()) return FocusWatch(std::move(source));
  if (auto source = focus_on_x11()) return FocusWatch(std::move(source));
  return {};
}

int FocusWatch::fd() const noexcept { return source_->fd(); }

std::optional<Focus> FocusWatch::changed() noexcept { return source_->changed(); }

}  // namespace tagwrench

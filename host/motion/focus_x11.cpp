// The focus as a window manager of X11 tells it.
#include <xcb/xcb.h>
#include <xcb/xcbext.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <string_view>

#include "host/motion/focus_watch.h"

namespace tagwrench {
namespace {

constexpr std::uint32_t kMaxClass = 256;  // bytes / 4 of a property

template <typename Reply>
struct Freed {
  void operator()(Reply* reply) const noexcept { std::free(reply); }
};
template <typename Reply>
using Owned = std::unique_ptr<Reply, Freed<Reply>>;

xcb_atom_t atom(xcb_connection_t* x, std::string_view name) {
  const auto asked = xcb_intern_atom(x, 0, static_cast<std::uint16_t>(name.size()), name.data());
  const Owned<xcb_intern_atom_reply_t> reply(xcb_intern_atom_reply(x, asked, nullptr));
  return reply ? reply->atom : xcb_atom_t{XCB_ATOM_NONE};
}

/// The second of the two strings of WM_CLASS.
std::string class_in(const xcb_get_property_reply_t& reply) {
  const std::string_view both(static_cast<const char*>(xcb_get_property_value(&reply)),
                              static_cast<std::size_t>(xcb_get_property_value_length(&reply)));
  const std::size_t instance_end = both.find('\0');
  if (instance_end == std::string_view::npos) return {};
  const std::string_view rest = both.substr(instance_end + 1);
  return lower_case(rest.substr(0, rest.find('\0')));
}

/// Nothing here waits for the X server: a question is asked, and its answer taken when it is there.
class X11Focus : public FocusSource {
 public:
  X11Focus() : x_(xcb_connect(nullptr, &screen_)) {}
  X11Focus(const X11Focus&) = delete;
  X11Focus& operator=(const X11Focus&) = delete;
  ~X11Focus() override { xcb_disconnect(x_); }

  bool start() {
    if (xcb_connection_has_error(x_) != 0) return false;
    xcb_screen_iterator_t screens = xcb_setup_roots_iterator(xcb_get_setup(x_));
    for (; screen_ > 0 && screens.rem > 0; --screen_) xcb_screen_next(&screens);
    if (screens.rem == 0) return false;
    root_ = screens.data->root;
    active_ = atom(x_, "_NET_ACTIVE_WINDOW");
    const std::uint32_t events = XCB_EVENT_MASK_PROPERTY_CHANGE;
    xcb_change_window_attributes(x_, root_, XCB_CW_EVENT_MASK, &events);
    ask_for_window();
    return true;
  }

  int fd() const noexcept override { return xcb_get_file_descriptor(x_); }
  std::optional<Focus> changed() noexcept override;

 private:
  void ask_for_window() {
    if (window_asked_) xcb_discard_reply(x_, window_asked_->sequence);
    window_asked_ = xcb_get_property(x_, 0, root_, active_, XCB_ATOM_WINDOW, 0, 1);
    xcb_flush(x_);
  }
  void ask_for_class(xcb_window_t window) {
    if (class_asked_) xcb_discard_reply(x_, class_asked_->sequence);
    class_asked_ =
        xcb_get_property(x_, 0, window, XCB_ATOM_WM_CLASS, XCB_ATOM_STRING, 0, kMaxClass);
    xcb_flush(x_);
  }
  bool moved() {
    bool any = false;
    while (const Owned<xcb_generic_event_t> event{xcb_poll_for_event(x_)}) {
      if ((event->response_type & 0x7f) != XCB_PROPERTY_NOTIFY) continue;
      any =
          any || reinterpret_cast<const xcb_property_notify_event_t*>(event.get())->atom == active_;
    }
    return any;
  }

  /// Whether the answer is there; it may be an error, then `reply` is empty.
  bool take(std::optional<xcb_get_property_cookie_t>& asked,
            Owned<xcb_get_property_reply_t>& reply) {
    if (!asked) return false;
    void* found = nullptr;
    xcb_generic_error_t* error = nullptr;
    if (xcb_poll_for_reply(x_, asked->sequence, &found, &error) == 0) return false;
    std::free(error);
    reply.reset(static_cast<xcb_get_property_reply_t*>(found));
    asked.reset();
    return true;
  }

  int screen_ = 0;
  xcb_connection_t* x_;
  xcb_window_t root_ = XCB_WINDOW_NONE;
  xcb_atom_t active_ = XCB_ATOM_NONE;
  xcb_window_t last_ = XCB_WINDOW_NONE;
  /// Then no window of X11 means one of Wayland, and not that nothing has the focus for a moment.
  bool beside_wayland_ = std::getenv("WAYLAND_DISPLAY") != nullptr;
  std::optional<xcb_get_property_cookie_t> window_asked_;
  std::optional<xcb_get_property_cookie_t> class_asked_;
};

std::optional<Focus> X11Focus::changed() noexcept {
  if (moved()) ask_for_window();
  Owned<xcb_get_property_reply_t> reply;
  if (take(window_asked_, reply) && reply && xcb_get_property_value_length(reply.get()) >= 4) {
    const auto now = *static_cast<const xcb_window_t*>(xcb_get_property_value(reply.get()));
    const bool counts = now != XCB_WINDOW_NONE || beside_wayland_;
    const bool new_window = counts && now != last_;
    if (counts) last_ = now;
    if (new_window && now == XCB_WINDOW_NONE) return Focus{};
    if (new_window) ask_for_class(now);
  }
  try {
    if (take(class_asked_, reply)) return Focus{true, reply ? class_in(*reply) : std::string()};
  } catch (const std::exception&) {
    return {};  // out of memory: the profile stays
  }
  if (xcb_connection_has_error(x_) != 0) return Focus{.ended = true};
  return {};
}

}  // namespace

std::unique_ptr<FocusSource> focus_on_x11() {
  const char* display = std::getenv("DISPLAY");
  if (display == nullptr || display[0] == '\0') return {};
  auto made = std::make_unique<X11Focus>();
  if (!made->start()) return {};
  return made;
}

}  // namespace tagwrench

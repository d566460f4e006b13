#include "host/desk/focus_watch.h"

#include <xcb/xcb.h>
#include <xcb/xcbext.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <exception>
#include <string_view>

namespace tagwrench {
namespace {

constexpr std::uint32_t kLongestClass = 256;  // bytes / 4 of a property

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
  std::string name(rest.substr(0, rest.find('\0')));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

}  // namespace

/// Nothing here waits for the X server: a question is asked, and its answer taken when it is there.
struct FocusWatch::Connection {
  xcb_connection_t* x = nullptr;
  xcb_window_t root = XCB_WINDOW_NONE;
  xcb_atom_t active = XCB_ATOM_NONE;
  xcb_window_t last = XCB_WINDOW_NONE;
  std::optional<xcb_get_property_cookie_t> window_asked;
  std::optional<xcb_get_property_cookie_t> class_asked;

  Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    if (x != nullptr) xcb_disconnect(x);
  }

  void ask_for_window() {
    if (window_asked) xcb_discard_reply(x, window_asked->sequence);
    window_asked = xcb_get_property(x, 0, root, active, XCB_ATOM_WINDOW, 0, 1);
    xcb_flush(x);
  }
  void ask_for_class(xcb_window_t window) {
    if (class_asked) xcb_discard_reply(x, class_asked->sequence);
    class_asked =
        xcb_get_property(x, 0, window, XCB_ATOM_WM_CLASS, XCB_ATOM_STRING, 0, kLongestClass);
    xcb_flush(x);
  }

  /// Whether the answer is there; it may be an error, then `reply` is empty.
  bool take(std::optional<xcb_get_property_cookie_t>& asked,
            Owned<xcb_get_property_reply_t>& reply) {
    if (!asked) return false;
    void* found = nullptr;
    xcb_generic_error_t* error = nullptr;
    if (xcb_poll_for_reply(x, asked->sequence, &found, &error) == 0) return false;
    std::free(error);
    reply.reset(static_cast<xcb_get_property_reply_t*>(found));
    asked.reset();
    return true;
  }
};

FocusWatch::FocusWatch(std::unique_ptr<Connection> connection)
    : connection_(std::move(connection)) {}
FocusWatch::FocusWatch(FocusWatch&&) noexcept = default;
FocusWatch::~FocusWatch() = default;

std::optional<FocusWatch> FocusWatch::open() {
  const char* display = std::getenv("DISPLAY");
  if (display == nullptr || display[0] == '\0') return {};
  auto made = std::make_unique<Connection>();
  int screen = 0;
  made->x = xcb_connect(nullptr, &screen);
  if (xcb_connection_has_error(made->x) != 0) return {};
  xcb_screen_iterator_t screens = xcb_setup_roots_iterator(xcb_get_setup(made->x));
  for (; screen > 0 && screens.rem > 0; --screen) xcb_screen_next(&screens);
  if (screens.rem == 0) return {};
  made->root = screens.data->root;
  made->active = atom(made->x, "_NET_ACTIVE_WINDOW");
  const std::uint32_t events = XCB_EVENT_MASK_PROPERTY_CHANGE;
  xcb_change_window_attributes(made->x, made->root, XCB_CW_EVENT_MASK, &events);
  made->ask_for_window();
  return FocusWatch(std::move(made));
}

int FocusWatch::fd() const noexcept { return xcb_get_file_descriptor(connection_->x); }

std::optional<std::string> FocusWatch::changed() noexcept {
  Connection& c = *connection_;
  bool moved = false;
  while (const Owned<xcb_generic_event_t> event{xcb_poll_for_event(c.x)}) {
    if ((event->response_type & 0x7f) != XCB_PROPERTY_NOTIFY) continue;
    moved = moved ||
            reinterpret_cast<const xcb_property_notify_event_t*>(event.get())->atom == c.active;
  }
  if (moved) c.ask_for_window();
  Owned<xcb_get_property_reply_t> reply;
  if (c.take(c.window_asked, reply) && reply && xcb_get_property_value_length(reply.get()) >= 4) {
    const auto now = *static_cast<const xcb_window_t*>(xcb_get_property_value(reply.get()));
    if (now != c.last && now != XCB_WINDOW_NONE) {
      c.last = now;
      c.ask_for_class(now);
    }
  }
  try {
    if (c.take(c.class_asked, reply)) return reply ? class_in(*reply) : std::string();
  } catch (const std::exception&) {
    return {};  // out of memory: the profile stays
  }
  return {};
}

}  // namespace tagwrench

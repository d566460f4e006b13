#include "host/motion/focus_watch.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-bus.h>
#include <xcb/xcb.h>
#include <xcb/xcbext.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/os/unique_fd.h"
#include "host/core/os/user_folders.h"

namespace tagwrench {

// ---- i3 and sway

namespace {

using Json = nlohmann::json;

constexpr std::string_view kMagic = "i3-ipc";
constexpr std::size_t kMaxName = 256;

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

/// The text of a key, empty if there is none.
std::string text_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string()) return {};
  return found->get_ref<const std::string&>().substr(0, kMaxName);
}

/// A window of Wayland has an application id, one of X11 a class.
std::string program_of(const Json& window) {
  std::string name = text_of(window, "app_id");
  const auto properties = window.find("window_properties");
  if (name.empty() && properties != window.end() && properties->is_object())
    name = text_of(*properties, "class");
  return lower_case(name);
}

bool is_true(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_boolean() && found->get<bool>();
}

/// Without recursion: whoever writes the tree says how deep it is.
std::optional<Focus> focused_in(const Json& tree) {
  std::vector<const Json*> left = {&tree};
  while (!left.empty()) {
    const Json& node = *left.back();
    left.pop_back();
    if (!node.is_object()) continue;
    // A workspace without windows can have the focus itself.
    if (is_true(node, "focused")) return Focus{.told = true, .program = program_of(node)};
    for (const char* key : {"nodes", "floating_nodes"}) {
      const auto children = node.find(key);
      if (children == node.end() || !children->is_array()) continue;
      for (const Json& child : *children) left.push_back(&child);
    }
  }
  return {};
}

class I3Focus : public FocusWatch {
 public:
  explicit I3Focus(UniqueFd socket) : socket_(std::move(socket)) {}

  int fd() const noexcept override { return socket_.get(); }
  /// Reads once only, and never waits: more is told by the descriptor, and frames wait.
  std::optional<Focus> changed() noexcept override {
    std::array<char, 16384> bytes;
    const ssize_t size = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return {};
    if (size <= 0 || !stream_.put({bytes.data(), static_cast<std::size_t>(size)}))
      return Focus{.ended = true};
    std::optional<Focus> last;
    while (const std::optional<I3Message> message = stream_.next())
      if (std::optional<Focus> focus = focus_in(*message)) last = std::move(focus);
    return last;
  }

 private:
  UniqueFd socket_;
  I3Stream stream_;
};

/// Whole, or not at all.
bool sends(const UniqueFd& socket, const std::string& bytes) {
  return ::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

/// i3's IPC, which sway has too. Null: nobody listens at `path`.
std::unique_ptr<FocusWatch> focus_by_i3_ipc(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.data(), path.size());
  UniqueFd socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const bool asked =
      socket &&
      ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      sends(socket, i3_message(I3Type::subscribe, R"(["window"])")) &&
      sends(socket, i3_message(I3Type::tree, ""));
  if (!asked) return {};
  return std::make_unique<I3Focus>(std::move(socket));
}

// ---- Window managers of X11: Extended Window Manager Hints 1.5, _NET_ACTIVE_WINDOW;
// ICCCM 4.1.2.5, WM_CLASS.

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
class X11Focus : public FocusWatch {
 public:
  X11Focus() : x_(xcb_connect(nullptr, &screen_)) {}
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
  std::optional<Focus> changed() noexcept override {
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
    if (take(class_asked_, reply)) return Focus{true, reply ? class_in(*reply) : std::string()};
    if (xcb_connection_has_error(x_) != 0) return Focus{.ended = true};
    return {};
  }

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
      any |= (event->response_type & 0x7f) == XCB_PROPERTY_NOTIFY &&
             reinterpret_cast<const xcb_property_notify_event_t*>(event.get())->atom == active_;
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

/// Null: no $DISPLAY, or nobody answers there.
std::unique_ptr<FocusWatch> focus_on_x11() {
  const char* display = std::getenv("DISPLAY");
  if (display == nullptr || display[0] == '\0') return {};
  auto made = std::make_unique<X11Focus>();
  if (!made->start()) return {};
  return made;
}

// ---- KWin, KDE's compositor: a script of ours runs in it, and calls us over the session's D-Bus.

constexpr const char* kKwin = "org.kde.KWin";
constexpr const char* kScripting = "/Scripting";
constexpr const char* kScriptingInterface = "org.kde.kwin.Scripting";
constexpr const char* kOurs = "/focus";
constexpr const char* kOurInterface = "org.tagwrench.Focus";
constexpr std::uint64_t kPatience_us = 2'000'000;

struct BusClosed {
  void operator()(sd_bus* bus) const noexcept { sd_bus_flush_close_unref(bus); }
};
using Bus = std::unique_ptr<sd_bus, BusClosed>;

/// Plasma 5 and 6 have other names for the same.
std::string script(std::string_view address) {
  return "function tell(window) {\n  callDBus(\"" + std::string(address) + "\", \"" + kOurs +
         "\", \"" + kOurInterface +
         "\", \"window\", window ? String(window.resourceClass) : \"\");\n}\n"
         "(workspace.windowActivated || workspace.clientActivated).connect(tell);\n"
         "tell(workspace.activeWindow || workspace.activeClient);\n";
}

class KwinFocus : public FocusWatch {
 public:
  explicit KwinFocus(Bus bus) : bus_(std::move(bus)) {}
  ~KwinFocus() override {
    if (script_.empty()) return;
    sd_bus_call_method_async(bus_.get(), nullptr, kKwin, kScripting, kScriptingInterface,
                             "unloadScript", nullptr, nullptr, "s", script_.c_str());
    std::error_code none;
    std::filesystem::remove(script_, none);
  }

  /// False: KWin is not there, or does not take scripts.
  bool start() {
    const char* address = nullptr;
    if (sd_bus_set_method_call_timeout(bus_.get(), kPatience_us) < 0 ||
        sd_bus_get_unique_name(bus_.get(), &address) < 0 ||
        sd_bus_add_object(bus_.get(), nullptr, kOurs, heard, this) < 0)
      return false;
    const std::string file = runtime_folder() + "/kwin" + (address + 1) + ".js";  // not the colon
    if (!(std::ofstream(file) << script(address))) return false;
    script_ = file;
    return calls("loadScript", "ss", file.c_str()) && calls("start", "", nullptr);
  }

  int fd() const noexcept override { return sd_bus_get_fd(bus_.get()); }
  std::optional<Focus> changed() noexcept override {
    int more = 0;
    while ((more = sd_bus_process(bus_.get(), nullptr)) > 0) {
    }
    if (more < 0) return Focus{.ended = true};
    return std::exchange(heard_, std::nullopt);
  }

 private:
  bool calls(const char* method, const char* types, const char* name) {
    return sd_bus_call_method(bus_.get(), kKwin, kScripting, kScriptingInterface, method, nullptr,
                              nullptr, types, name, name) >= 0;
  }
  /// A C library calls it.
  static int heard(sd_bus_message* message, void* self, sd_bus_error*) noexcept {
    const char* name = nullptr;
    if (sd_bus_message_is_method_call(message, kOurInterface, "window") == 0 ||
        sd_bus_message_read(message, "s", &name) < 0)
      return 0;
    const std::string program = lower_case(std::string_view(name).substr(0, kMaxName));
    static_cast<KwinFocus*>(self)->heard_ = Focus{!program.empty(), program};
    return sd_bus_reply_method_return(message, nullptr);
  }

  Bus bus_;
  std::string script_;  ///< its file, and its name in KWin
  std::optional<Focus> heard_;
};

/// Null: this desktop's windows are not KWin's.
std::unique_ptr<FocusWatch> focus_in_kwin() {
  sd_bus* opened = nullptr;
  if (std::getenv("WAYLAND_DISPLAY") == nullptr || sd_bus_open_user(&opened) < 0) return {};
  auto made = std::make_unique<KwinFocus>(Bus(opened));
  try {
    if (!made->start()) return {};
  } catch (const ConfigError&) {
    return {};  // no folder for the script
  }
  return made;
}

}  // namespace

std::string i3_message(I3Type type, std::string_view payload) {
  const auto size = static_cast<std::uint32_t>(payload.size());
  std::string bytes(kMagic);
  bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(&type), sizeof type);
  return bytes.append(payload);
}

bool I3Stream::put(std::string_view bytes) {
  const std::size_t over = std::min(passed_over_, bytes.size());
  passed_over_ -= over;
  bytes_.append(bytes.substr(over));
  const std::string_view begin = std::string_view(bytes_).substr(0, kMagic.size());
  return kMagic.starts_with(begin);
}

std::optional<I3Message> I3Stream::next() {
  if (bytes_.size() < kHead || !bytes_.starts_with(kMagic)) return {};
  const std::size_t size = word_at(bytes_, kMagic.size());
  I3Message message{word_at(bytes_, kMagic.size() + 4), {}};
  if (size > kMax) {
    const std::size_t here = std::min(size, bytes_.size() - kHead);
    passed_over_ = size - here;
    bytes_.erase(0, kHead + here);
    return message;
  }
  if (bytes_.size() < kHead + size) return {};
  message.payload = bytes_.substr(kHead, size);
  bytes_.erase(0, kHead + size);
  return message;
}

std::optional<Focus> focus_in(const I3Message& message) {
  const Json json = parse_json(message.payload);
  if (!json.is_object()) return {};
  if (message.type == static_cast<std::uint32_t>(I3Type::tree)) return focused_in(json);
  if (message.type != static_cast<std::uint32_t>(I3Type::window_event)) return {};
  const auto window = json.find("container");
  if (text_of(json, "change") != "focus" || window == json.end() || !window->is_object()) return {};
  return Focus{.told = true, .program = program_of(*window)};
}

std::unique_ptr<FocusWatch> FocusWatch::open() {
  // X11 last: sway and KWin start an X server too, which knows nothing of Wayland's windows.
  for (const char* name : {"SWAYSOCK", "I3SOCK"}) {
    const char* path = std::getenv(name);
    if (path == nullptr || path[0] == '\0') continue;
    if (auto watch = focus_by_i3_ipc(path)) return watch;
  }
  if (auto watch = focus_in_kwin()) return watch;
  return focus_on_x11();
}

}  // namespace tagwrench

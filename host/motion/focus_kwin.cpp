// The focus as KWin tells it, KDE's compositor: a script of ours runs in it, and calls us over the
// session's D-Bus.
#include <systemd/sd-bus.h>
#include <unistd.h>

#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/runtime_folder.h"
#include "host/motion/focus_watch.h"

namespace tagwrench {
namespace {

constexpr const char* kKwin = "org.kde.KWin";
constexpr const char* kScripting = "/Scripting";
constexpr const char* kScriptingInterface = "org.kde.kwin.Scripting";
constexpr const char* kOurs = "/focus";
constexpr const char* kOurInterface = "org.tagwrench.Focus";
constexpr std::size_t kMaxName = 256;
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

class KwinFocus : public FocusSource {
 public:
  explicit KwinFocus(Bus bus) : bus_(std::move(bus)) {}
  KwinFocus(const KwinFocus&) = delete;
  KwinFocus& operator=(const KwinFocus&) = delete;
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
    return std::exchange(status_line_, std::nullopt);
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
    try {
      const std::string program = lower_case(std::string_view(name).substr(0, kMaxName));
      static_cast<KwinFocus*>(self)->status_line_ = Focus{!program.empty(), program};
    } catch (const std::exception&) {
      return 0;  // out of memory: the profile stays
    }
    return sd_bus_reply_method_return(message, nullptr);
  }

  Bus bus_;
  std::string script_;  ///< its file, and its name in KWin
  std::optional<Focus> status_line_;
};

}  // namespace

std::unique_ptr<FocusSource> focus_in_kwin() {
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

}  // namespace tagwrench

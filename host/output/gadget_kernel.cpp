#include "host/output/gadget_kernel.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr const char* kLoad = "sudo modprobe libcomposite";
constexpr const char* kMount = "sudo mount -t configfs none /sys/kernel/config";

std::string names_of(const std::vector<Controller>& all) {
  std::string names;
  for (const Controller& one : all) names += (names.empty() ? "" : ", ") + one.name;
  return names;
}

}  // namespace

std::vector<Controller> controllers(const GadgetFiles& files, const KernelPlaces& places,
                                    const std::vector<GadgetFound>& gadgets) {
  std::vector<Controller> all;
  const std::string folder = places.sysfs + "/class/udc";
  for (const std::string& name : files.list(folder)) {
    const std::string at = folder + "/" + name;
    Controller one{name, files.line(at + "/state"), files.line(at + "/current_speed"),
                   files.line(at + "/function")};
    const auto bound = std::find_if(gadgets.begin(), gadgets.end(),
                                    [&](const GadgetFound& gadget) { return gadget.udc == name; });
    if (bound != gadgets.end()) one.owner = bound->folder;
    all.push_back(std::move(one));
  }
  return all;
}

Controller choose_controller(const std::vector<Controller>& all, const std::string& wanted,
                             const std::string& ours) {
  if (all.empty()) {
    throw ConfigError(
        "gadget: this computer has no USB device controller, so it cannot be plugged into another "
        "one as a device; boards that have one: Raspberry Pi Zero, Zero 2, 4, 5, Compute Module "
        "(add dtoverlay=dwc2,dr_mode=peripheral to /boot/firmware/config.txt and restart), "
        "BeagleBone, many with a USB-C port");
  }
  const Controller* busy = nullptr;
  for (const Controller& one : all) {
    if (!wanted.empty() && one.name != wanted) continue;
    if (one.owner.empty() || one.owner == ours) return one;
    busy = &one;
  }
  if (busy == nullptr) {
    throw ConfigError(
        fmt::format("--udc {}: no such USB device controller; there is {}", wanted, names_of(all)));
  }
  const bool is_ours = busy->owner.starts_with(kGadgetPrefix);
  throw ConfigError(
      fmt::format("gadget: USB device controller {} belongs to {}; {}", busy->name, busy->owner,
                  is_ours ? fmt::format("take that one down: sudo tagwrench gadget down --name {}",
                                        busy->owner.substr(kGadgetPrefix.size()))
                          : "end what made that, or choose another one with --udc"));
}

bool run_program(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  pid_t process = 0;
  if (::posix_spawnp(&process, pointers[0], nullptr, nullptr, pointers.data(), environ) != 0)
    return false;
  int status = 0;
  while (::waitpid(process, &status, 0) < 0) {
    if (errno != EINTR) return false;
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void prepare_kernel(const GadgetFiles& files, const KernelPlaces& places, const RunProgram& run) {
  if (files.exists(places.gadgets())) return;
  if (::geteuid() != 0) {
    throw ConfigError(
        fmt::format("gadget: {} is not there and only root can make it: sudo tagwrench gadget up",
                    places.gadgets()));
  }
  if (!run({"modprobe", "libcomposite"}) && !files.exists(places.configfs)) {
    throw ConfigError(
        fmt::format("gadget: this kernel has no USB gadget support (libcomposite): {}", kLoad));
  }
  if (files.exists(places.gadgets())) return;  // systemd mounts configfs when it comes
  const int mounted = ::mount("none", places.configfs.c_str(), "configfs", 0, nullptr);
  if (!files.exists(places.gadgets())) {
    throw ConfigError(fmt::format("gadget: {} is not there{}; try: {} && {}", places.gadgets(),
                                  mounted == 0 ? "" : fmt::format(" ({})", std::strerror(errno)),
                                  kLoad, kMount));
  }
}

UniqueFd lock_gadgets(const KernelPlaces& places) {
  UniqueFd folder(::open(places.gadgets().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  while (folder && ::flock(folder.get(), LOCK_EX) != 0) {
    if (errno != EINTR) folder.reset();
  }
  if (!folder) {
    throw ConfigError(fmt::format("gadget: {} cannot be locked: {}; check it with: ls -ld {}",
                                  places.gadgets(), std::strerror(errno), places.gadgets()));
  }
  return folder;
}

std::optional<dev_t> parse_device_number(std::string_view text) noexcept {
  constexpr unsigned kMajors = 1U << 12;
  constexpr unsigned kMinors = 1U << 20;
  const std::size_t colon = text.find(':');
  if (colon == text.npos) return {};
  const auto number = [](std::string_view digits, unsigned end, unsigned& out) {
    const auto [at, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out);
    return error == std::errc() && at == digits.data() + digits.size() && out < end;
  };
  unsigned major_number = 0, minor_number = 0;
  if (!number(text.substr(0, colon), kMajors, major_number) ||
      !number(text.substr(colon + 1), kMinors, minor_number))
    return {};
  return makedev(major_number, minor_number);
}

std::optional<std::string> gadget_node(const GadgetFiles& files, const KernelPlaces& places,
                                       const std::string& function) {
  const std::optional<dev_t> number = parse_device_number(files.line(function + "/dev"));
  if (!number) return {};
  std::error_code none;
  const std::string name =
      std::filesystem::read_symlink(
          fmt::format("{}/dev/char/{}:{}", places.sysfs, major(*number), minor(*number)), none)
          .filename()
          .string();
  constexpr std::string_view kNode = "hidg";
  const bool usable = !none && name.starts_with(kNode) && name.size() > kNode.size() &&
                      name.size() < 16 &&
                      std::all_of(name.begin() + kNode.size(), name.end(),
                                  [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!usable) return {};
  return name;
}

OpenedNode open_gadget_node(const GadgetFiles& files, const KernelPlaces& places,
                            const std::string& function) {
  OpenedNode node;
  const std::optional<std::string> name = gadget_node(files, places, function);
  if (!name) return node;
  node.path = places.devices + "/" + *name;
  UniqueFd fd(::open(node.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC | O_NOFOLLOW));
  struct stat file {};
  if (!fd || ::fstat(fd.get(), &file) != 0) {
    node.error = errno;
  } else if (!S_ISCHR(file.st_mode) ||
             file.st_rdev != parse_device_number(files.line(function + "/dev"))) {
    node.error = ENXIO;
  } else if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    node.error = errno;
  } else {
    node.fd = std::move(fd);
  }
  return node;
}

}  // namespace tagwrench

#include "host/output/gadget_tree.h"

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
#include <cstring>
#include <filesystem>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/parse.h"
#include "host/output/hid_outputs.h"
#include "host/output/hid_report.h"

namespace tagwrench {
namespace {

constexpr const char* kEnglish = "strings/0x409";
constexpr const char* kConfiguration = "configs/c.1";

// bmAttributes and bMaxPower (USB 2.0, table 9-10): what a port gives at most, or next to nothing.
constexpr int kBusPowered = 0x80;
constexpr int kSelfPowered = 0xc0;
constexpr int kMaxFromBus_mA = 500;
constexpr int kMinFromBus_mA = 2;

std::string hex(std::uint16_t number) { return fmt::format("0x{:04x}", number); }

std::optional<std::uint16_t> parse_hex(std::string_view text) noexcept {
  if (text.starts_with("0x")) text.remove_prefix(2);
  return parse_whole<std::uint16_t>(text, 16);
}

int errno_of(bool done) { return done ? 0 : errno; }

constexpr const char* kLoad = "sudo modprobe libcomposite";
constexpr const char* kMount = "sudo mount -t configfs none /sys/kernel/config";

std::string names_of(const std::vector<Controller>& all) {
  std::string names;
  for (const Controller& one : all) names += (names.empty() ? "" : ", ") + one.name;
  return names;
}

}  // namespace

std::string_view face_name(GadgetFace face) noexcept {
  return face == GadgetFace::spacemouse ? "spacemouse" : "wrench";
}

std::optional<GadgetFace> face_of(std::string_view name) noexcept {
  for (const GadgetFace face : {GadgetFace::spacemouse, GadgetFace::wrench})
    if (face_name(face) == name) return face;
  return {};
}

std::string_view face_product(GadgetFace face) noexcept {
  return face == GadgetFace::spacemouse ? "SpaceMouse" : "wrench sensor";
}

UsbId face_id(GadgetFace face) noexcept {
  constexpr UsbId kSpacemouse{0x256f, 0xc62e};
  constexpr UsbId kWrench{0x1209, 0x7a6e};
  return face == GadgetFace::spacemouse ? kSpacemouse : kWrench;
}

std::vector<std::uint8_t> face_descriptor(GadgetFace face) {
  if (face == GadgetFace::wrench) return wrench_descriptor();
  const auto bytes = spacemouse_descriptor();
  return {bytes.begin(), bytes.end()};
}

std::size_t face_report_length(GadgetFace face) noexcept {
  return face == GadgetFace::spacemouse ? SpacemouseReport().size() : kWrenchReportSize;
}

int GadgetFiles::make_folder(const std::string& path) {
  return errno_of(::mkdir(path.c_str(), 0755) == 0);
}

int GadgetFiles::remove_folder(const std::string& path) {
  return errno_of(::rmdir(path.c_str()) == 0);
}

int GadgetFiles::write(const std::string& path, std::string_view bytes) {
  const UniqueFd file(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!file) return errno;
  const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
  if (written < 0) return errno;
  return static_cast<std::size_t>(written) == bytes.size() ? 0 : EIO;
}

int GadgetFiles::link(const std::string& target, const std::string& path) {
  return errno_of(::symlink(target.c_str(), path.c_str()) == 0);
}

int GadgetFiles::unlink(const std::string& path) { return errno_of(::unlink(path.c_str()) == 0); }

std::vector<std::string> GadgetFiles::list(const std::string& path) const {
  std::vector<std::string> names;
  std::error_code none;
  std::filesystem::directory_iterator at(path, none);
  for (; !none && at != std::filesystem::directory_iterator(); at.increment(none))
    names.push_back(at->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

bool GadgetFiles::exists(const std::string& path) const {
  return ::access(path.c_str(), F_OK) == 0;
}

std::string GadgetFiles::line(const std::string& path) const {
  const UniqueFd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  std::array<char, 255> bytes;
  const ssize_t got = file ? ::read(file.get(), bytes.data(), bytes.size()) : -1;
  if (got <= 0) return {};
  const std::string_view text(bytes.data(), static_cast<std::size_t>(got));
  std::string line(text.substr(0, text.find('\n')));
  for (char& c : line)
    if (std::isprint(static_cast<unsigned char>(c)) == 0) c = '?';
  return line;
}

std::optional<std::string> GadgetFound::name() const {
  if (!folder.starts_with(kGadgetPrefix)) return {};
  return folder.substr(kGadgetPrefix.size());
}

GadgetTree::GadgetTree(GadgetFiles& files, std::string root)
    : files_(files), root_(std::move(root)) {}

std::string GadgetTree::path(std::string_view name) const {
  check_sensor_name(name);
  return fmt::format("{}/{}{}", root_, kGadgetPrefix, name);
}

std::string GadgetTree::function(std::string_view name, GadgetFace face) const {
  return fmt::format("{}/functions/hid.{}", path(name), face_name(face));
}

GadgetFound GadgetTree::look(const std::string& folder) const {
  const std::string gadget = root_ + "/" + folder;
  GadgetFound found;
  found.folder = folder;
  found.udc = files_.line(gadget + "/UDC");
  found.serial = files_.line(fmt::format("{}/{}/serialnumber", gadget, kEnglish));
  found.id.vendor = parse_hex(files_.line(gadget + "/idVendor")).value_or(0);
  found.id.product = parse_hex(files_.line(gadget + "/idProduct")).value_or(0);
  found.self_powered =
      parse_hex(files_.line(fmt::format("{}/{}/bmAttributes", gadget, kConfiguration))) ==
      kSelfPowered;
  for (const std::string& function : files_.list(gadget + "/functions")) {
    if (!function.starts_with("hid.")) continue;
    const std::optional<GadgetFace> face = face_of(std::string_view(function).substr(4));
    if (!face) continue;
    found.face = face;
    found.whole = !found.udc.empty() &&
                  files_.exists(fmt::format("{}/{}/{}", gadget, kConfiguration, function));
  }
  return found;
}

std::vector<GadgetFound> GadgetTree::all() const {
  std::vector<GadgetFound> gadgets;
  for (const std::string& folder : files_.list(root_)) gadgets.push_back(look(folder));
  return gadgets;
}

std::optional<GadgetFound> GadgetTree::find(std::string_view name) const {
  const std::string gadget = path(name);
  if (!files_.exists(gadget)) return {};
  return look(gadget.substr(root_.size() + 1));
}

void GadgetTree::need(int error, const std::string& what) const {
  if (error == 0) return;
  const char* remedy = "look for the cause with: sudo dmesg | tail";
  if (error == EACCES || error == EPERM) remedy = "run it as root: sudo tagwrench gadget up";
  if (error == ENOENT && what.find("/functions/") != std::string::npos)
    remedy = "this kernel has no HID function (CONFIG_USB_CONFIGFS_F_HID): sudo modprobe usb_f_hid";
  if (error == EBUSY && what.ends_with("/UDC"))
    remedy = "something else has taken the controller; see: tagwrench gadget status";
  throw ConfigError("gadget {}: {}; {}", what, std::strerror(error), remedy);
}

void GadgetTree::make(const GadgetSpec& spec) {
  const std::string gadget = path(spec.name);
  const std::string function = GadgetTree::function(spec.name, spec.face);
  const std::string texts = fmt::format("{}/{}", gadget, kEnglish);
  const std::string configuration = fmt::format("{}/{}", gadget, kConfiguration);
  const auto folder = [this](const std::string& at) { need(files_.make_folder(at), at); };
  const auto set = [this](const std::string& at, std::string_view value) {
    need(files_.write(at, value), at);
  };

  folder(gadget);
  set(gadget + "/idVendor", hex(spec.id.vendor));
  set(gadget + "/idProduct", hex(spec.id.product));
  set(gadget + "/bcdDevice", "0x0100");
  set(gadget + "/bcdUSB", "0x0200");
  folder(texts);
  set(texts + "/manufacturer", kGadgetManufacturer);
  set(texts + "/product", face_product(spec.face));
  set(texts + "/serialnumber", fmt::format("{}{}", kGadgetPrefix, spec.name));

  folder(function);
  set(function + "/protocol", "0");
  set(function + "/subclass", "0");
  // What the other computer sends then comes by its control pipe, which never makes it wait for a
  // bridge that is not there. Older kernels have the other way only.
  if (const std::string pipe = function + "/no_out_endpoint"; files_.exists(pipe)) set(pipe, "1");
  set(function + "/report_length", std::to_string(face_report_length(spec.face)));
  const std::vector<std::uint8_t> descriptor = face_descriptor(spec.face);
  set(function + "/report_desc",
      {reinterpret_cast<const char*>(descriptor.data()), descriptor.size()});

  folder(configuration);
  set(configuration + "/bmAttributes",
      std::to_string(spec.self_powered ? kSelfPowered : kBusPowered));
  set(configuration + "/MaxPower",
      std::to_string(spec.self_powered ? kMinFromBus_mA : kMaxFromBus_mA));
  folder(configuration + "/strings/0x409");
  set(configuration + "/strings/0x409/configuration", face_product(spec.face));
  const std::string member = fmt::format("{}/hid.{}", configuration, face_name(spec.face));
  need(files_.link(function, member), member);
  set(gadget + "/UDC", spec.udc);
}

void GadgetTree::up(const GadgetSpec& spec) {
  down(spec.name);
  try {
    make(spec);
  } catch (const ConfigError&) {
    remove(path(spec.name));
    throw;
  }
}

/// As configfs demands, from the leaves to the root. Goes on after a failure, returns the first.
int GadgetTree::remove(const std::string& gadget) {
  int failed = 0;
  const auto note = [&failed](int error) {
    if (failed == 0 && error != ENOENT) failed = error;
  };
  if (!files_.line(gadget + "/UDC").empty()) note(files_.write(gadget + "/UDC", "\n"));
  const std::string configurations = gadget + "/configs";
  for (const std::string& configuration : files_.list(configurations)) {
    const std::string folder = configurations + "/" + configuration;
    for (const std::string& member : files_.list(folder)) {
      const std::string link = folder + "/" + member;
      if (std::filesystem::is_symlink(link)) note(files_.unlink(link));
    }
    for (const std::string& language : files_.list(folder + "/strings"))
      note(files_.remove_folder(folder + "/strings/" + language));
    note(files_.remove_folder(folder));
  }
  for (const std::string& function : files_.list(gadget + "/functions"))
    note(files_.remove_folder(gadget + "/functions/" + function));
  for (const std::string& language : files_.list(gadget + "/strings"))
    note(files_.remove_folder(gadget + "/strings/" + language));
  note(files_.remove_folder(gadget));
  return failed;
}

void GadgetTree::down(std::string_view name) {
  const std::string gadget = path(name);
  if (!files_.exists(gadget)) return;
  if (const int error = remove(gadget); error != 0 && files_.exists(gadget)) {
    const bool denied = error == EACCES || error == EPERM;
    throw ConfigError(
        "gadget {}: cannot be taken away: {}; {}", gadget, std::strerror(error),
        denied ? "run it as root: sudo tagwrench gadget down" : "end what uses it and try again");
  }
}

std::optional<UsbId> parse_usb_id(std::string_view text) noexcept {
  if (text.size() != 9 || text[4] != ':' || text.find('x') != text.npos) return {};
  const auto vendor = parse_hex(text.substr(0, 4));
  const auto product = parse_hex(text.substr(5));
  if (!vendor || !product) return {};
  return UsbId{*vendor, *product};
}

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
    throw ConfigError("--udc {}: no such USB device controller; there is {}", wanted,
                      names_of(all));
  }
  const bool is_ours = busy->owner.starts_with(kGadgetPrefix);
  throw ConfigError("gadget: USB device controller {} belongs to {}; {}", busy->name, busy->owner,
                    is_ours
                        ? fmt::format("take that one down: sudo tagwrench gadget down --name {}",
                                      busy->owner.substr(kGadgetPrefix.size()))
                        : "end what made that, or choose another one with --udc");
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
  while (::waitpid(process, &status, 0) < 0)
    if (errno != EINTR) return false;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void prepare_kernel(const GadgetFiles& files, const KernelPlaces& places, const RunProgram& run) {
  if (files.exists(places.gadgets())) return;
  if (::geteuid() != 0) {
    throw ConfigError("gadget: {} is not there and only root can make it: sudo tagwrench gadget up",
                      places.gadgets());
  }
  if (!run({"modprobe", "libcomposite"}) && !files.exists(places.configfs))
    throw ConfigError("gadget: this kernel has no USB gadget support (libcomposite): {}", kLoad);
  if (files.exists(places.gadgets())) return;  // systemd mounts configfs when it comes
  const int mounted = ::mount("none", places.configfs.c_str(), "configfs", 0, nullptr);
  if (!files.exists(places.gadgets())) {
    throw ConfigError("gadget: {} is not there{}; try: {} && {}", places.gadgets(),
                      mounted == 0 ? "" : fmt::format(" ({})", std::strerror(errno)), kLoad,
                      kMount);
  }
}

UniqueFd lock_gadgets(const KernelPlaces& places) {
  UniqueFd folder(::open(places.gadgets().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  while (folder && ::flock(folder.get(), LOCK_EX) != 0)
    if (errno != EINTR) folder.reset();
  if (!folder) {
    throw ConfigError("gadget: {} cannot be locked: {}; check it with: ls -ld {}", places.gadgets(),
                      std::strerror(errno), places.gadgets());
  }
  return folder;
}

std::optional<dev_t> parse_device_number(std::string_view text) noexcept {
  constexpr unsigned kMajors = 1U << 12;
  constexpr unsigned kMinors = 1U << 20;
  const std::size_t colon = std::min(text.find(':'), text.size());
  const auto major_number = parse_whole<unsigned>(text.substr(0, colon));
  const auto minor_number = parse_whole<unsigned>(text.substr(std::min(colon + 1, text.size())));
  if (!major_number || !minor_number || *major_number >= kMajors || *minor_number >= kMinors)
    return {};
  return makedev(*major_number, *minor_number);
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
  if (!fd || ::fstat(fd.get(), &file) != 0)
    node.error = errno;
  else if (!S_ISCHR(file.st_mode) ||
           file.st_rdev != parse_device_number(files.line(function + "/dev")))
    node.error = ENXIO;
  else if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0)
    node.error = errno;
  else
    node.fd = std::move(fd);
  return node;
}

}  // namespace tagwrench

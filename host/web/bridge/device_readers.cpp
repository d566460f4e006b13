#include "host/web/bridge/device_readers.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOurName = "tagwrench";
constexpr const char* kWatchdog = "tw-watchdog";  // holds every device, and reads none

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

/// Entries of a folder; none where it cannot be read.
std::vector<fs::path> entries(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> found;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    found.push_back(it->path());
  return found;
}

/// Device node -> how it is read.
std::map<std::string, std::string> our_nodes(const std::string& serial,
                                             const KernelFolders& folders) {
  std::map<std::string, std::string> nodes;
  for (const fs::path& entry : entries(folders.hidraw)) {
    const std::string events = text_of(entry / "device/uevent") + "\n";
    if (events.find("HID_UNIQ=" + serial + "\n") != std::string::npos)
      nodes["/dev/" + entry.filename().string()] = "hidraw";
  }
  for (const fs::path& entry : entries(folders.input)) {
    const std::string name = entry.filename().string();
    const bool of_events = name.starts_with("event");
    if (!of_events && !name.starts_with("js")) continue;
    const bool ours = text_of(entry / "device/uniq") == serial ||
                      text_of(entry / "device/name").starts_with(kOurName);
    if (ours) nodes["/dev/input/" + name] = "evdev";
  }
  return nodes;
}

}  // namespace

std::vector<DeviceReader> device_readers(const std::string& serial, const KernelFolders& folders) {
  const std::map<std::string, std::string> nodes = our_nodes(serial, folders);
  std::vector<DeviceReader> readers;
  if (nodes.empty()) return readers;
  const std::string self = std::to_string(::getpid());
  for (const fs::path& process : entries(folders.processes)) {
    const std::string id = process.filename().string();
    struct stat owner {};
    if (id == self || id.find_first_not_of("0123456789") != std::string::npos) continue;
    if (::stat(process.c_str(), &owner) != 0 || owner.st_uid != ::getuid()) continue;
    for (const fs::path& file : entries(process / "fd")) {
      std::error_code gone;
      const auto node = nodes.find(fs::read_symlink(file, gone).string());
      if (gone || node == nodes.end()) continue;
      const std::string program = text_of(process / "comm");
      if (program != kWatchdog) readers.push_back({program, node->second});
    }
  }
  std::sort(readers.begin(), readers.end(), [](const DeviceReader& a, const DeviceReader& b) {
    return std::pair(a.program, a.by) < std::pair(b.program, b.by);
  });
  readers.erase(std::unique(readers.begin(), readers.end()), readers.end());
  return readers;
}

}  // namespace tagwrench

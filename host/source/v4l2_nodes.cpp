#include "host/source/v4l2_nodes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <optional>

#include "host/core/config_error.h"
#include "host/source/v4l2_device.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

std::optional<int> number_after(std::string_view text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return std::nullopt;
  text.remove_prefix(prefix.size());
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

template <typename Visit>
void for_each_entry(const fs::path& folder, Visit visit) {
  std::error_code error;
  fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) visit(it->path());
}

CameraNode inspect(const std::string& path) {
  CameraNode node;
  node.path = path;
  V4l2Capability capability;
  node.error = query_capability(path, capability);
  node.card = capability.card;
  node.driver = capability.driver;
  node.captures = capability.captures;
  return node;
}

std::vector<std::string> node_paths() {
  std::vector<int> numbers;
  for_each_entry("/dev", [&](const fs::path& path) {
    if (const auto number = number_after(path.filename().string(), "video")) {
      numbers.push_back(*number);
    }
  });
  std::sort(numbers.begin(), numbers.end());
  std::vector<std::string> paths;
  for (const int number : numbers) paths.push_back(fmt::format("/dev/video{}", number));
  return paths;
}

}  // namespace

std::vector<CameraNode> list_camera_nodes() {
  std::vector<CameraNode> nodes;
  for (const std::string& path : node_paths()) {
    CameraNode node = inspect(path);
    if (node.captures) {
      try {
        V4l2Device device(path);
        node.modes = device.modes(640, 480);
        node.controls = device.lockable_controls();
      } catch (const ConfigError&) {
        node.error = EBUSY;
      }
    }
    nodes.push_back(std::move(node));
  }
  return nodes;
}

std::string capture_nodes_text() {
  std::string text;
  for (const std::string& path : node_paths()) {
    const CameraNode node = inspect(path);
    if (!node.captures) continue;
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", path, node.card);
  }
  return text.empty() ? "no camera is connected" : "cameras here: " + text;
}

std::string stable_path(const std::string& path) {
  std::error_code error;
  const fs::path node = fs::canonical(path, error);
  if (error) return path;
  for (const char* folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"}) {
    if (path.starts_with(folder)) return path;
  }
  for (const char* folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"}) {
    std::string found;
    for_each_entry(folder, [&](const fs::path& link) {
      std::error_code broken;
      if (fs::canonical(link, broken) == node && !broken) found = link.string();
    });
    if (!found.empty()) return found;
  }
  return path;
}

std::string holders_text(const std::string& path) {
  std::error_code error;
  const fs::path node = fs::canonical(path, error);
  std::string text;
  for_each_entry("/proc", [&](const fs::path& process) {
    const auto pid = number_after(process.filename().string(), "");
    if (!pid || *pid == ::getpid()) return;
    bool holds = false;
    for_each_entry(process / "fd", [&](const fs::path& link) {
      std::error_code gone;
      holds = holds || (fs::read_symlink(link, gone) == node && !gone);
    });
    if (!holds) return;
    std::string name;
    std::getline(std::ifstream(process / "comm"), name);
    text += fmt::format("{}{} (pid {})", text.empty() ? "" : ", ", name, *pid);
  });
  return text;
}

}  // namespace tagwrench

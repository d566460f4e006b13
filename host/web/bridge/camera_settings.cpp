#include "host/web/bridge/camera_settings.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>

#include "host/calibration/light/control.h"
#include "host/core/os/uninterrupted.h"
#include "host/tracker/picture_quality.h"

// Not fuzzed: names out of /proc and /sys, for people, cut at a line's end.

namespace tagwrench {
namespace {

constexpr std::size_t kMaxSettings = 64;

bool ask_camera(int fd, unsigned long request, void* argument) {
  return uninterrupted([&] { return ::ioctl(fd, request, argument); }) == 0;
}

bool shown(const v4l2_queryctrl& control) {
  const bool number = control.type == V4L2_CTRL_TYPE_INTEGER ||
                      control.type == V4L2_CTRL_TYPE_BOOLEAN || control.type == V4L2_CTRL_TYPE_MENU;
  return number && (control.flags & V4L2_CTRL_FLAG_DISABLED) == 0;
}

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

constexpr Duration kMeasureEvery = std::chrono::milliseconds(450);
constexpr int kRestsPerLook = 7;  // on a busy machine, pages are answered meanwhile

Square square_of(const TagCorners& tag) {
  Square square;
  for (std::size_t i = 0; i < square.size(); ++i) square[i] = {tag.px[2 * i], tag.px[2 * i + 1]};
  return square;
}

}  // namespace

bool CameraSettings::reach() {
  if (!fd_) fd_.reset(::open(device_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  return static_cast<bool>(fd_);
}

std::vector<CameraSetting> CameraSettings::all() {
  std::vector<CameraSetting> settings;
  if (!reach()) return settings;
  v4l2_queryctrl control{};
  control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (settings.size() < kMaxSettings && ask_camera(fd_.get(), VIDIOC_QUERYCTRL, &control)) {
    v4l2_control now{};
    now.id = control.id;
    if (shown(control) && ask_camera(fd_.get(), VIDIOC_G_CTRL, &now)) {
      const auto* name = reinterpret_cast<const char*>(control.name);
      constexpr std::uint32_t kFixed =
          V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_INACTIVE | V4L2_CTRL_FLAG_GRABBED;
      settings.push_back({control.id, std::string(name, ::strnlen(name, sizeof control.name)),
                          now.value, control.minimum, control.maximum, std::max(1, control.step),
                          (control.flags & kFixed) == 0});
    }
    control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  if (settings.empty()) fd_.reset();  // it may be another device by now
  return settings;
}

bool CameraSettings::set(std::uint32_t id, std::int32_t value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  return reach() && ask_camera(fd_.get(), VIDIOC_S_CTRL, &control);
}

nlohmann::json settings_json(const std::vector<CameraSetting>& settings) {
  nlohmann::json all = nlohmann::json::array();
  for (const CameraSetting& s : settings) {
    all.push_back({{"id", s.id},
                   {"name", s.name},
                   {"value", s.value},
                   {"minimum", s.minimum},
                   {"maximum", s.maximum},
                   {"step", s.step},
                   {"writable", s.writable}});
  }
  return all;
}

std::int32_t nearest(const CameraSetting& setting, std::int64_t value) {
  const std::int64_t low = setting.minimum;
  const std::int64_t high = std::max<std::int64_t>(low, setting.maximum);
  const std::int64_t step = std::max(1, setting.step);
  const std::int64_t steps = (std::clamp(value, low, high) - low + step / 2) / step;
  return static_cast<std::int32_t>(std::min(low + steps * step, low + (high - low) / step * step));
}

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

PictureFigures::PictureFigures(const CameraModel& camera, const TargetDescription& target)
    : patterns_(camera, target), mirrored_(camera.mirrored) {
  for (const Tag& tag : target.tags) edges_.push_back({tag.id, 0});
}

void PictureFigures::look(const ImageView& picture, std::span<const TagCorners> corners) {
  const TimePoint now = std::chrono::steady_clock::now();
  if (now < next_look_) return;
  measure_edges(picture, corners);
  std::vector<FoundTag> tags;
  for (const TagCorners& tag : corners) {
    FoundTag& found = tags.emplace_back();
    found.corners_px = square_of(tag);
    if (!mirrored_) continue;
    for (Eigen::Vector2d& corner : found.corners_px) corner.x() = picture.width - 1 - corner.x();
  }
  const LightReading light = read_light(picture, mirrored_, tags);
  nlohmann::json widths = nlohmann::json::array();
  for (const Edges& edges : edges_)
    if (edges.px > 0) widths.push_back({{"id", edges.id}, {"px", edges.px}});
  figures_ = {{"white", light.white_counts},
              {"black", picture_quality(picture).dark_counts},
              {"clipped_part", light.clipped_fraction},
              {"edges_px", std::move(widths)}};
  const TimePoint end = std::chrono::steady_clock::now();
  next_look_ = std::max(now + kMeasureEvery, end + kRestsPerLook * (end - now));
}

/// One tag after the other: a fit takes as long as a frame.
void PictureFigures::measure_edges(const ImageView& picture, std::span<const TagCorners> corners) {
  if (edges_.empty()) return;
  const std::size_t index = next_++ % edges_.size();
  Edges& edges = edges_[index];
  edges.px = 0;
  for (const TagCorners& tag : corners) {
    if (tag.id != edges.id) continue;
    if (const auto width = edge_width(picture, patterns_.patterns()[index], square_of(tag)))
      edges.px = width->blur_px;
  }
}

}  // namespace tagwrench

#include "host/web/bridge/camera_settings.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace tagwrench {
namespace {

constexpr std::size_t kMaxSettings = 64;

bool ask_camera(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result == 0;
}

bool shown(const v4l2_queryctrl& control) {
  const bool number = control.type == V4L2_CTRL_TYPE_INTEGER ||
                      control.type == V4L2_CTRL_TYPE_BOOLEAN || control.type == V4L2_CTRL_TYPE_MENU;
  return number && (control.flags & V4L2_CTRL_FLAG_DISABLED) == 0;
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

}  // namespace tagwrench

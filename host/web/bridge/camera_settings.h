// The settings of the camera that runs, over a descriptor of its own: what there is, and what it
// stands at. What the run keeps fixed is changed by the run itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/tracker/acquire.h"
#include "host/tracker/target.h"

namespace tagwrench {

struct CameraSetting {
  std::uint32_t id = 0;  ///< a V4L2_CID_ number
  std::string name;
  std::int32_t value = 0;
  std::int32_t minimum = 0;
  std::int32_t maximum = 0;
  std::int32_t step = 1;
  bool writable = true;
};

class CameraSettings {
 public:
  /// `device`: its node; a camera that is away has no settings until it is back.
  explicit CameraSettings(std::string device) : device_(std::move(device)) {}

  /// Whole numbers, switches and choices.
  std::vector<CameraSetting> all();
  /// Of a setting that nobody keeps fixed. False: the camera refuses.
  bool set(std::uint32_t id, std::int32_t value);

 private:
  bool reach();

  std::string device_;
  UniqueFd fd_;
};

nlohmann::json settings_json(const std::vector<CameraSetting>& settings);

/// The nearest value that the setting can have.
std::int32_t nearest(const CameraSetting& setting, std::int64_t value);

// Which programs read our virtual devices: the kernel tells by their open files.

struct DeviceReader {
  std::string program;
  std::string by;  ///< "hidraw" or "evdev"
  bool operator==(const DeviceReader&) const = default;
};

/// Where the kernel tells it.
struct KernelFolders {
  std::filesystem::path processes = "/proc";
  std::filesystem::path hidraw = "/sys/class/hidraw";
  std::filesystem::path input = "/sys/class/input";
};

/// Of devices whose serial number is `serial`, or whose name begins with "tagwrench": programs of
/// the same user, but not this one, in the order of their names.
std::vector<DeviceReader> device_readers(const std::string& serial,
                                         const KernelFolders& folders = {});

// Light and sharpness of the pictures that a page shows. In the server's thread.

class PictureFigures {
 public:
  /// Throws ConfigError for a target that cannot be tracked.
  PictureFigures(const CameraModel& camera, const TargetDescription& target);

  /// Twice a second and an eighth of the time at most something is measured, and the width of one
  /// tag's edges each time.
  /// `corners`: where the tags were, about then.
  void look(const ImageView& picture, std::span<const TagCorners> corners);
  /// {"white","black","clipped_part","edges_px":[{"id","px"}]}; null before the first picture.
  const nlohmann::json& figures() const { return figures_; }

 private:
  struct Edges {
    int id = 0;
    double px = 0;  ///< 0: not known
  };
  void measure_edges(const ImageView& picture, std::span<const TagCorners> corners);

  Acquirer patterns_;
  bool mirrored_;
  std::vector<Edges> edges_;
  std::size_t next_ = 0;
  TimePoint next_look_{};
  nlohmann::json figures_ = nullptr;
};

}  // namespace tagwrench

// What the sensor looks like at rest, as a picture file: 16-bit grey PNG, 256 counts for each grey
// level, the size of the camera's frames, under any name. The number of frames that it averages is
// sensor.yaml's rest.frames.
#pragma once

#include <filesystem>
#include <string>

#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

inline constexpr float kReferenceCountsPerLevel = 256.0F;

/// Leaves `frames` at zero. Throws ConfigError, one line with path and remedy: no such file, no
/// PNG, damaged, not 16-bit grey, not of the camera's size.
ReferenceImage load_reference_image(const std::filesystem::path& path, const CameraModel& camera);

/// The bytes of the file. Throws std::invalid_argument for an image whose size and levels do not
/// agree.
std::string encode_reference_image(const ReferenceImage& image);

}  // namespace tagwrench

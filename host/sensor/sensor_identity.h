// Which sensor a calibration was made with: camera, target, and how the target looks at rest.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"

namespace tagwrench {

struct SensorIdentity {
  std::string family;
  std::vector<int> tag_ids;
  double tag_size_mm = 0;
  std::array<int, 2> image_px{};
  // Absent in calibrations of older versions:
  std::optional<std::array<double, 4>> lens_px;  ///< fx fy cx cy
  std::string target_sha256;  ///< of all that `tagwrench calibrate target` finds; empty: absent
};

/// target_sha256 is taken over a text of fixed form, one line each: family, tag size, ids and,
/// where they are known, places of the tags (um and urad) and rest pose; then the picture at rest,
/// 16 bits a pixel.
SensorIdentity identity_of(const CameraModel& camera, const TargetDescription& target,
                           const ReferenceOptions& rest);

/// What differs, for people: "its tag_ids is [5,3], sensor.yaml has [5,2]"; empty if nothing does.
/// What one of them does not know does not differ.
std::string difference(const SensorIdentity& its, const SensorIdentity& ours);

/// One name for all of it: equal for data of one sensor, camera and target unchanged.
std::string sha256_of(const SensorIdentity& identity);

/// Of what the camera shows: size, lens, mirroring; not of its timing.
std::string sha256_of(const CameraModel& camera);

/// Of stiffness and offset, to six digits.
std::string sha256_of(const WrenchModel& model);

}  // namespace tagwrench

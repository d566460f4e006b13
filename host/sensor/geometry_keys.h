// What sensor.yaml and the files of measured/ both say of poses, tags, lenses and dates, as YAML
// keys.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

Eigen::Vector3d vector3(const std::vector<double>& v);
/// The three numbers of one key, then those of the other, in the file's units. Both are read before
/// any is stored: Eigen's comma would assert where the second is refused.
Vector6 six(YamlReader& node, const char* first, const char* second);

/// Whether they are there. Throws ConfigError where one is without the other; `or_else` ends its
/// remedy.
bool both_or_neither(YamlReader& node, const char* a, const char* b, const char* or_else = "");

/// position_mm and rotation_rad, both or neither.
std::optional<Eigen::Isometry3d> optional_pose(YamlReader& node);

TagFamily read_family(YamlReader& node);

/// All of an entry: id, pose as optional_pose(), and only where there is one position_sigma_mm and
/// rotation_sigma_rad, both or neither.
Tag read_tag(YamlReader& entry, TagFamily family);

/// scale_sigma of a target, 0 where it is absent.
double optional_scale_sigma(YamlReader& node);

/// The text at `key`, empty or YYYY-MM-DD.
std::string optional_date(YamlReader& node, const char* key);

inline constexpr double kMaxFocal_px = 1e6;
inline constexpr double kFarthestCentre_px = 1e5;

/// Throws ConfigError where the distortion, at `key`, folds the image: looking outward, its pixels
/// begin to show again what they have shown nearer to the centre. `or_else` ends the remedy.
void check_no_fold(const YamlReader& node, const char* key, const CameraModel& camera,
                   const char* or_else);

}  // namespace tagwrench

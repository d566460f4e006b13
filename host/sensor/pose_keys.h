// Poses as YAML keys: position_mm and rotation_rad, with their standard deviations.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/core/yaml/yaml_reader.h"

namespace tagwrench {

Eigen::Vector3d vector3(const std::vector<double>& v);

/// Of a rotation vector.
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& r);

/// position_mm and rotation_rad, both or neither.
std::optional<Eigen::Isometry3d> optional_pose(YamlReader& node);

/// position_sigma_mm and rotation_sigma_rad, both or neither, and only where there is a pose; m,
/// rad.
Vector6 optional_pose_sigma(YamlReader& node, bool has_pose);

/// The text at `key`, empty or YYYY-MM-DD.
std::string optional_date(YamlReader& node, const std::string& key);

}  // namespace tagwrench

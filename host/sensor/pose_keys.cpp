#include "host/sensor/pose_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace tagwrench {
namespace {

constexpr double kMm = 1e-3;

bool is_date(const std::string& text) {
  constexpr std::string_view kForm = "0000-00-00";
  return text.size() == kForm.size() &&
         std::equal(text.begin(), text.end(), kForm.begin(), [](char c, char form) {
           return form == '0' ? c >= '0' && c <= '9' : c == form;
         });
}

}  // namespace

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
}

std::optional<Eigen::Isometry3d> optional_pose(YamlReader& node) {
  const bool position = node.has("position_mm");
  if (node.has("rotation_rad") != position) {
    node.fail(position ? "position_mm" : "rotation_rad",
              "position_mm and rotation_rad belong together; give both or neither");
  }
  if (!position) return std::nullopt;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = vector3(node.numbers("position_mm", 3)) * kMm;
  pose.linear() = rotation_of(vector3(node.numbers("rotation_rad", 3)));
  return pose;
}

Vector6 optional_pose_sigma(YamlReader& node, bool has_pose) {
  const bool position = node.has("position_sigma_mm");
  if (node.has("rotation_sigma_rad") != position) {
    node.fail(position ? "position_sigma_mm" : "rotation_sigma_rad",
              "position_sigma_mm and rotation_sigma_rad belong together; give both or neither");
  }
  Vector6 sigma = Vector6::Zero();
  if (!position) return sigma;
  if (!has_pose) {
    node.fail("position_sigma_mm",
              "there is no pose that it could belong to; give position_mm and rotation_rad too, or "
              "leave the sigmas out");
  }
  sigma << vector3(node.numbers("position_sigma_mm", 3)) * kMm,
      vector3(node.numbers("rotation_sigma_rad", 3));
  for (int i = 0; i < 6; ++i) {
    if (sigma[i] < 0)
      node.fail(i < 3 ? "position_sigma_mm" : "rotation_sigma_rad", "must not be negative");
  }
  return sigma;
}

std::string optional_date(YamlReader& node, const std::string& key) {
  std::string date = node.text_or(key, "");
  if (!date.empty() && !is_date(date)) node.fail(key, fmt::format("'{}' is not YYYY-MM-DD", date));
  return date;
}

}  // namespace tagwrench

#include "host/sensor/geometry_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "host/tracker/camera_model.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kMm = 1e-3;
constexpr double kMostScaleSigma = 0.5;

Vector6 optional_pose_sigma(YamlReader& node, bool has_pose) {
  Vector6 sigma = Vector6::Zero();
  if (!both_or_neither(node, "position_sigma_mm", "rotation_sigma_rad")) return sigma;
  if (!has_pose) {
    node.fail("position_sigma_mm",
              "there is no pose that it could belong to; give position_mm and rotation_rad too, or "
              "leave the sigmas out");
  }
  sigma = six(node, "position_sigma_mm", "rotation_sigma_rad");
  sigma.head<3>() *= kMm;
  for (int i = 0; i < 6; ++i)
    if (sigma[i] < 0)
      node.fail(i < 3 ? "position_sigma_mm" : "rotation_sigma_rad", "must not be negative");
  return sigma;
}

/// A pixel where the image begins to be folded, px. Empty where it never is.
std::optional<Eigen::Vector2d> fold(const CameraModel& camera) {
  constexpr int kSides = 16;  // places along each side of the image
  constexpr int kSteps = 32;  // from the centre to each
  constexpr int kWithin = 4;  // places in each step
  constexpr int kNewton = 10;
  constexpr double kClose_px = 1e-6;
  const Eigen::Vector2d centre(camera.cx_px, camera.cy_px);
  const auto folded = [&](const Eigen::Vector2d& ray) {
    return !(project(camera, ray.homogeneous()).jacobian.leftCols<2>().determinant() > 0);
  };
  const auto fold_toward = [&](const Eigen::Vector2d& border) -> std::optional<Eigen::Vector2d> {
    Eigen::Vector2d ray(0, 0);
    for (int step = 1; step <= kSteps; ++step) {
      const Eigen::Vector2d pixel = centre + (border - centre) * step / kSteps;
      const Eigen::Vector2d before = ray;
      double miss = 0;
      for (int i = 0; i < kNewton; ++i) {
        const ProjectedPoint at = project(camera, ray.homogeneous());
        miss = (pixel - at.pixel).norm();
        ray += at.jacobian.leftCols<2>().inverse() * (pixel - at.pixel);
      }
      if (!(miss < kClose_px)) return pixel;
      for (int i = 1; i <= kWithin; ++i) {
        if (folded(before + (ray - before) * i / kWithin)) return pixel;
      }
    }
    return std::nullopt;
  };
  const double right = camera.width_px - 1;
  const double bottom = camera.height_px - 1;
  for (int i = 0; i <= kSides; ++i) {
    const double part = static_cast<double>(i) / kSides;
    for (const Eigen::Vector2d& border :
         {Eigen::Vector2d(part * right, 0), Eigen::Vector2d(part * right, bottom),
          Eigen::Vector2d(0, part * bottom), Eigen::Vector2d(right, part * bottom)})
      if (const auto found = fold_toward(border)) return found;
  }
  return std::nullopt;
}

}  // namespace

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

Vector6 six(YamlReader& node, const char* first, const char* second) {
  const Eigen::Vector3d head = vector3(node.numbers(first, 3));
  const Eigen::Vector3d tail = vector3(node.numbers(second, 3));
  Vector6 both;
  both << head, tail;
  return both;
}

bool both_or_neither(YamlReader& node, const char* a, const char* b, const char* or_else) {
  const bool there = node.has(a);
  if (node.has(b) != there) {
    node.fail(there ? a : b,
              fmt::format("{} and {} belong together; give both or neither{}", a, b, or_else));
  }
  return there;
}

std::optional<Eigen::Isometry3d> optional_pose(YamlReader& node) {
  if (!both_or_neither(node, "position_mm", "rotation_rad")) return std::nullopt;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = vector3(node.numbers("position_mm", 3)) * kMm;
  pose.linear() = rotation_from_vector(vector3(node.numbers("rotation_rad", 3)));
  return pose;
}

TagFamily read_family(YamlReader& node) {
  std::vector<std::string_view> names;
  for (int i = 0; i < kTagFamilies; ++i) names.push_back(name(static_cast<TagFamily>(i)));
  return static_cast<TagFamily>(node.one_of("family", names));
}

Tag read_tag(YamlReader& entry, TagFamily family) {
  Tag tag;
  tag.id = entry.integer("id", 0, id_count(family) - 1);
  tag.platform_T_tag = optional_pose(entry);
  tag.sigma = optional_pose_sigma(entry, tag.platform_T_tag.has_value());
  entry.finish();
  return tag;
}

double optional_scale_sigma(YamlReader& node) {
  return node.has("scale_sigma") ? node.within("scale_sigma", 0, kMostScaleSigma) : 0;
}

std::string optional_date(YamlReader& node, const char* key) {
  std::string date = node.text_or(key, "");
  constexpr std::string_view kForm = "0000-00-00";
  const bool is_date =
      std::equal(date.begin(), date.end(), kForm.begin(), kForm.end(),
                 [](char c, char form) { return form == '0' ? c >= '0' && c <= '9' : c == form; });
  if (!date.empty() && !is_date) node.fail(key, fmt::format("'{}' is not YYYY-MM-DD", date));
  return date;
}

void check_no_fold(const YamlReader& node, const char* key, const CameraModel& camera,
                   const char* or_else) {
  const auto at = fold(camera);
  if (!at) return;
  node.fail(key, fmt::format("folds the image at pixel ({:.0f}, {:.0f}), which no lens does; run "
                             "`tagwrench calibrate camera`, or {}",
                             at->x(), at->y(), or_else));
}

}  // namespace tagwrench

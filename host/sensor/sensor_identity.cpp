#include "host/sensor/sensor_identity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "host/core/sha256.h"

namespace tagwrench {
namespace {

/// In um and urad: what sensor.yaml is read to does not depend on the last digit of a double.
std::string pose_text(const std::optional<Eigen::Isometry3d>& pose) {
  if (!pose) return "not known";
  const Eigen::AngleAxisd turn(pose->linear());
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  const auto rounded = [](double value) { return std::llround(value * 1e6); };
  const Eigen::Vector3d& p = pose->translation();
  return fmt::format("{} {} {} {} {} {}", rounded(p.x()), rounded(p.y()), rounded(p.z()),
                     rounded(rotation.x()), rounded(rotation.y()), rounded(rotation.z()));
}

std::string target_hash(const TargetDescription& target, const ReferenceOptions& rest) {
  std::string text = fmt::format("family {}\ntag_size {}\n", name(target.family),
                                 std::llround(target.tag_size * 1e9));
  for (const Tag& tag : target.tags)
    text += fmt::format("tag {} {}\n", tag.id, pose_text(tag.platform_T_tag));
  text += fmt::format("rest {}\n", pose_text(rest.camera_T_platform));
  if (rest.appearance) {
    text += fmt::format("picture {} {}\n", rest.appearance->width, rest.appearance->height);
    text.reserve(text.size() + 2 * rest.appearance->level.size());
    for (const float level : rest.appearance->level) {
      const auto counts = static_cast<std::uint16_t>(std::lround(level * 256.0F));
      text += static_cast<char>(counts & 255);
      text += static_cast<char>(counts >> 8);
    }
  }
  return sha256_hex(text);
}

bool same(double a, double b) { return std::abs(a - b) <= 1e-6 * std::max(1.0, std::abs(a)); }

}  // namespace

SensorIdentity identity_of(const CameraModel& camera, const TargetDescription& target,
                           const ReferenceOptions& rest) {
  SensorIdentity out;
  out.family = std::string(name(target.family));
  for (const Tag& tag : target.tags) out.tag_ids.push_back(tag.id);
  out.tag_size_mm = target.tag_size * 1e3;
  out.image_px = {camera.width_px, camera.height_px};
  out.lens_px = {camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px};
  out.target_sha256 = target_hash(target, rest);
  return out;
}

std::string difference(const SensorIdentity& its, const SensorIdentity& ours) {
  const auto say = [](const char* key, const auto& theirs, const auto& here) {
    return fmt::format("its {} is {}, sensor.yaml has {}", key, theirs, here);
  };
  const auto list = [](const auto& values) { return fmt::format("[{}]", fmt::join(values, ",")); };
  if (its.family != ours.family) return say("family", its.family, ours.family);
  if (its.tag_ids != ours.tag_ids) return say("tag_ids", list(its.tag_ids), list(ours.tag_ids));
  if (!same(its.tag_size_mm, ours.tag_size_mm))
    return say("tag_size_mm", its.tag_size_mm, ours.tag_size_mm);
  if (its.image_px != ours.image_px)
    return say("image_px", list(its.image_px), list(ours.image_px));
  if (its.lens_px && ours.lens_px) {
    for (std::size_t i = 0; i < 4; ++i) {
      if (!same((*its.lens_px)[i], (*ours.lens_px)[i]))
        return say("lens (fx,fy,cx,cy)", list(*its.lens_px), list(*ours.lens_px));
    }
  }
  if (!its.target_sha256.empty() && !ours.target_sha256.empty() &&
      its.target_sha256 != ours.target_sha256) {
    return "the places of its tags, its rest pose or its picture at rest are others than those in "
           "force, where the target was calibrated anew since";
  }
  return "";
}

std::string sha256_of(const SensorIdentity& identity) {
  std::string text =
      fmt::format("{} {}x{}", identity.target_sha256, identity.image_px[0], identity.image_px[1]);
  for (const double number : identity.lens_px.value_or(std::array<double, 4>{}))
    text += fmt::format(" {:.6f}", number);
  return sha256_hex(text);
}

std::string sha256_of(const CameraModel& camera) {
  std::string text = fmt::format("{}x{} {:.6f} {:.6f} {:.6f} {:.6f} {}", camera.width_px,
                                 camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px,
                                 camera.cy_px, camera.mirrored ? "mirrored" : "as it is");
  for (const double number : camera.distortion) text += fmt::format(" {:.8f}", number);
  return sha256_hex(text);
}

std::string sha256_of(const WrenchModel& model) {
  std::string text;
  for (const double number : model.K.reshaped()) text += fmt::format("{:.6g} ", number);
  for (const double number : model.B) text += fmt::format("{:.6g} ", number);
  return sha256_hex(text);
}

}  // namespace tagwrench

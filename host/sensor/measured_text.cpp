// The texts of the files of measured/, as they are written.
#include <fmt/format.h>

#include "host/sensor/measured_files.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kMilli = 1e-3;

/// In double quotes: names may hold anything but control characters.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    const auto byte = static_cast<unsigned char>(c);
    out += byte < 0x20 || byte == 0x7f ? '?' : c;
  }
  return out + "\"";
}

std::string list(const Eigen::Vector3d& v, int digits) {
  return fmt::format("[{:.{}f}, {:.{}f}, {:.{}f}]", v.x(), digits, v.y(), digits, v.z(), digits);
}

std::string pose_text(const Eigen::Isometry3d& pose) {
  return fmt::format("position_mm: {}, rotation_rad: {}", list(pose.translation() / kMilli, 6),
                     list(rotation_to_vector(pose.linear()), 7));
}

std::string stamp_text(const MeasuredStamp& stamp, const char* indent) {
  std::string text;
  for (const auto& [key, value] :
       {std::pair{"date", &stamp.date}, std::pair{"software", &stamp.software},
        std::pair{"sensor", &stamp.sensor}}) {
    if (!value->empty()) text += fmt::format("{}{}: {}\n", indent, key, quoted(*value));
  }
  return text;
}

std::string matrix(const char* name, int rows, const std::vector<double>& numbers) {
  std::string data;
  for (const double number : numbers)
    data += fmt::format("{}{:.10g}", data.empty() ? "" : ", ", number);
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", name, rows,
                     numbers.size() / static_cast<std::size_t>(rows), data);
}

}  // namespace

std::string camera_yaml(const CameraFile& file, const std::string& name) {
  const CameraModel& c = file.camera;
  std::string text = fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", c.width_px,
                                 c.height_px, quoted(name));
  text += matrix("camera_matrix", 3, {c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1});
  text += "distortion_model: plumb_bob\n";
  text += matrix("distortion_coefficients", 1, {c.distortion.begin(), c.distortion.end()});
  text += matrix("rectification_matrix", 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  text +=
      matrix("projection_matrix", 3, {c.fx_px, 0, c.cx_px, 0, 0, c.fy_px, c.cy_px, 0, 0, 0, 1, 0});
  text += "tagwrench:\n" + stamp_text(file.stamp, "  ");
  if (file.mirrored) text += fmt::format("  mirrored: {}\n", *file.mirrored);
  return text + fmt::format("  views: {}\n  rms_px: {:.4f}\n", file.views, file.rms_px);
}

std::string target_yaml(const TargetFile& file) {
  std::string text = "format: tagwrench-target-1\n" + stamp_text(file.stamp, "");
  text += fmt::format("family: {}\ntag_size_mm: {:.10g}\ncamera_sha256: {}\n",
                      name(file.target.family), file.target.tag_size / kMilli, file.camera_sha256);
  text += fmt::format("rest: {{{}}}\ntags:\n", pose_text(file.rest));
  for (const Tag& tag : file.target.tags) {
    text += fmt::format("  - {{id: {}, {}", tag.id, pose_text(tag.platform_T_tag.value()));
    if (!tag.sigma.isZero()) {
      text += fmt::format(",\n     position_sigma_mm: {}, rotation_sigma_rad: {}",
                          list(tag.sigma.head<3>() / kMilli, 6), list(tag.sigma.tail<3>(), 7));
    }
    text += "}\n";
  }
  if (file.picture) {
    text += fmt::format("picture: {{file: {}, frames: {}, sha256: {}}}\n",
                        quoted(file.picture->file), file.picture->frames, file.picture->sha256);
  }
  if (file.readout) text += fmt::format("readout_ms: {:.1f}\n", *file.readout / kMilli);
  return text;
}

std::string zero_yaml(const ZeroFile& file) {
  return "format: tagwrench-zero-1\n" + stamp_text(file.stamp, "") +
         fmt::format("zero_n: {}\nzero_nm: {}\nsensor_sha256: {}\nwrench_sha256: {}\n",
                     list(file.zero.head<3>(), 7), list(file.zero.tail<3>(), 7), file.sensor_sha256,
                     file.wrench_sha256);
}

}  // namespace tagwrench

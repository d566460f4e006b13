#include "host/sensor/measured_files.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "host/core/config_error.h"
#include "host/core/sha256.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/appearance_file.h"
#include "host/sensor/lens_check.h"
#include "host/sensor/pose_keys.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr double kMm = 1e-3;
constexpr const char* kTargetFormat = "tagwrench-target-1";
constexpr const char* kZeroFormat = "tagwrench-zero-1";

void check_format(YamlReader& root, const char* wanted) {
  const std::string format = root.text("format");
  if (format == wanted) return;
  root.fail("format",
            fmt::format("'{}' is not {}; update tagwrench, or measure anew", format, wanted));
}

MeasuredStamp read_stamp(YamlReader& node) {
  MeasuredStamp stamp;
  stamp.date = optional_date(node, "date");
  stamp.software = node.text_or("software", "");
  stamp.sensor = node.text_or("sensor", "");
  return stamp;
}

/// The numbers of {rows: r, cols: c, data: [...]}, row by row.
std::vector<double> read_matrix(YamlReader& root, const char* key, int rows, int columns) {
  YamlReader node = root.child(key);
  for (const auto& [name, wanted] : {std::pair{"rows", rows}, std::pair{"cols", columns}}) {
    const int given = node.integer(name, 0, 1000);
    if (given != wanted) {
      node.fail(name, fmt::format("must be {} of {}, is {}; run `tagwrench calibrate camera`, or "
                                  "calibrate with the model plumb_bob",
                                  wanted, key, given));
    }
  }
  return node.numbers("data", static_cast<std::size_t>(rows * columns));
}

void read_lens(YamlReader& root, CameraModel& camera) {
  const std::vector<double> k = read_matrix(root, "camera_matrix", 3, 3);
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    root.fail("camera_matrix",
              "must be [fx, 0, cx, 0, fy, cy, 0, 0, 1], as pixels without skew have it");
  }
  for (const double focal : {k[0], k[4]}) {
    if (!(focal >= 1 && focal <= kMaxFocal_px)) {
      root.fail("camera_matrix", fmt::format("a focal length of {} px is none; the camera was not "
                                             "calibrated: run `tagwrench calibrate camera`",
                                             focal));
    }
  }
  for (const double centre : {k[2], k[5]}) {
    if (std::abs(centre) > kFarthestCentre_px)
      root.fail("camera_matrix", fmt::format("a centre at {} px is none of this image", centre));
  }
  camera.fx_px = k[0];
  camera.cx_px = k[2];
  camera.fy_px = k[4];
  camera.cy_px = k[5];
  const std::string model = root.text("distortion_model");
  if (model != "plumb_bob") {
    root.fail("distortion_model",
              fmt::format("'{}' is not known, only plumb_bob with its 5 coefficients is; run "
                          "`tagwrench calibrate camera`, or calibrate with that model",
                          model));
  }
  const std::vector<double> d = read_matrix(root, "distortion_coefficients", 1, 5);
  std::copy(d.begin(), d.end(), camera.distortion.begin());
  if (const auto at = fold(camera)) {
    root.fail("distortion_coefficients",
              fmt::format("folds the image at pixel ({:.0f}, {:.0f}), which no lens does; run "
                          "`tagwrench calibrate camera`, or remove the file",
                          at->x(), at->y()));
  }
}

std::vector<std::string_view> families() {
  std::vector<std::string_view> names;
  for (int i = 0; i < kTagFamilies; ++i) names.push_back(name(static_cast<TagFamily>(i)));
  return names;
}

Eigen::Isometry3d pose_of(YamlReader& node) {
  const std::optional<Eigen::Isometry3d> pose = optional_pose(node);
  if (!pose) node.fail("position_mm", "is missing; run `tagwrench calibrate target`");
  return *pose;
}

std::string bytes_of(const fs::path& path) {
  std::error_code error;  // a pipe or a device may never end
  std::ifstream in;
  if (fs::is_regular_file(path, error)) in.open(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

fs::path measured_folder(const fs::path& sensor) {
  std::error_code error;
  const fs::path real = fs::is_symlink(sensor, error) ? fs::weakly_canonical(sensor) : sensor;
  return real.parent_path() / kMeasuredFolder;
}

bool is_measured(const fs::path& folder, const char* file) {
  std::error_code error;
  return !folder.empty() && fs::exists(folder / file, error);
}

CameraFile read_camera_file(const fs::path& file) {
  YamlReader root = YamlReader::from_file(file.string());
  CameraFile out;
  out.camera.width_px = root.integer("image_width", 16, 16384);
  out.camera.height_px = root.integer("image_height", 16, 16384);
  read_lens(root, out.camera);
  if (!root.has("tagwrench")) return out;
  YamlReader ours = root.child("tagwrench");
  out.stamp = read_stamp(ours);
  if (ours.has("mirrored")) out.mirrored = ours.boolean("mirrored");
  out.views = ours.integer_or("views", 0, 100'000, 0);
  out.rms_px = ours.non_negative_or("rms_px", 0);
  return out;
}

TargetFile read_target_file(const fs::path& file) {
  YamlReader root = YamlReader::from_file(file.string());
  check_format(root, kTargetFormat);
  TargetFile out;
  out.stamp = read_stamp(root);
  out.target.family = static_cast<TagFamily>(root.one_of("family", families()));
  out.target.tag_size = root.positive("tag_size_mm") * kMm;
  out.camera_sha256 = root.text("camera_sha256");
  out.target.tags.clear();
  for (YamlReader& entry : root.children("tags")) {
    Tag tag;
    tag.id = entry.integer("id", 0, id_count(out.target.family) - 1);
    tag.platform_T_tag = pose_of(entry);
    tag.sigma = optional_pose_sigma(entry, true);
    entry.finish();
    out.target.tags.push_back(tag);
  }
  YamlReader rest = root.child("rest");
  out.rest = pose_of(rest);
  rest.finish();
  if (root.has("picture")) {
    YamlReader node = root.child("picture");
    out.picture = {node.text("file"), node.text("sha256"), node.integer("frames", 1, 1000)};
    if (fs::path(out.picture->file).filename() != out.picture->file)
      node.fail("file", "must be the name of a file of this folder");
    node.finish();
  }
  if (root.has("readout_ms")) out.readout = root.within("readout_ms", 0, 200) * 1e-3;
  root.finish();
  return out;
}

ZeroFile read_zero_file(const fs::path& file) {
  YamlReader root = YamlReader::from_file(file.string());
  check_format(root, kZeroFormat);
  ZeroFile out;
  out.stamp = read_stamp(root);
  out.zero << vector3(root.numbers("zero_n", 3)), vector3(root.numbers("zero_nm", 3));
  out.sensor_sha256 = root.text("sensor_sha256");
  out.wrench_sha256 = root.text("wrench_sha256");
  root.finish();
  return out;
}

ReferenceImage read_measured_picture(const fs::path& folder, const PictureName& name,
                                     const CameraModel& camera) {
  for (const char* which : {"", kBefore}) {
    const fs::path file = folder / (name.file + which);
    if (sha256_hex(bytes_of(file)) != name.sha256) continue;
    ReferenceImage picture = load_reference_image(file, camera);
    picture.frames = name.frames;
    return picture;
  }
  std::error_code error;
  throw ConfigError(fmt::format(
      "{}: {}; run `tagwrench calibrate target`, or remove {}", (folder / name.file).string(),
      fs::exists(folder / name.file, error)
          ? "is not the picture that target.yaml was found with (SHA-256 differs)"
          : "is missing, and target.yaml needs it",
      (folder / kMeasuredTarget).string()));
}

void check_owner(const fs::path& file, const MeasuredStamp& stamp, const fs::path& sensor) {
  std::error_code error;
  const fs::path real = fs::is_symlink(sensor, error) ? fs::weakly_canonical(sensor) : sensor;
  if (stamp.sensor.empty() || stamp.sensor == real.filename()) return;
  if (fs::path(stamp.sensor).filename() != stamp.sensor) return;
  if (!fs::exists(real.parent_path() / stamp.sensor, error)) return;  // it was renamed
  throw ConfigError(fmt::format(
      "{}: was measured for {}, which is in this folder too; give each sensor a folder of its own, "
      "with its {}/",
      file.string(), stamp.sensor, kMeasuredFolder));
}

}  // namespace tagwrench

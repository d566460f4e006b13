#include "host/sensor/measured_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/core/png/png.h"
#include "host/core/sha256.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/geometry_keys.h"
#include "host/tracker/rotation.h"

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
  return {.date = optional_date(node, "date"),
          .software = node.text_or("software", ""),
          .sensor = node.text_or("sensor", "")};
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
  for (const double centre : {k[2], k[5]})
    if (std::abs(centre) > kFarthestCentre_px)
      root.fail("camera_matrix", fmt::format("a centre at {} px is none of this image", centre));
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
  check_no_fold(root, "distortion_coefficients", camera, "remove the file");
}

fs::path linked_to(const fs::path& sensor) {
  std::error_code error;
  if (!fs::is_symlink(sensor, error)) return sensor;
  const fs::path real = fs::weakly_canonical(sensor, error);
  return error ? sensor : real;  // a link to itself, say: whoever reads it says so
}

[[noreturn]] void no_pose(const YamlReader& node) {
  node.fail("position_mm", "is missing; run `tagwrench calibrate target`");
}

std::string list(const Eigen::Vector3d& v, int digits) {
  return fmt::format("[{:.{}f}, {:.{}f}, {:.{}f}]", v.x(), digits, v.y(), digits, v.z(), digits);
}

std::string pose_text(const Eigen::Isometry3d& pose) {
  return fmt::format("position_mm: {}, rotation_rad: {}", list(pose.translation() / kMm, 6),
                     list(rotation_to_vector(pose.linear()), 7));
}

std::string stamp_text(const MeasuredStamp& stamp, const char* indent) {
  std::string text;
  for (const auto& [key, value] :
       {std::pair{"date", &stamp.date}, std::pair{"software", &stamp.software},
        std::pair{"sensor", &stamp.sensor}})
    if (!value->empty()) text += fmt::format("{}{}: {}\n", indent, key, yaml_quoted(*value));
  return text;
}

std::string matrix(const char* name, int rows, const std::vector<double>& numbers) {
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{:.10g}]\n", name, rows,
                     numbers.size() / static_cast<std::size_t>(rows), fmt::join(numbers, ", "));
}

constexpr const char* kRemedy =
    "remove rest.appearance, and run `tagwrench calibrate target` for a new one";

[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw ConfigError("{}: {}; {}", path.string(), what, kRemedy);
}

/// The header is checked before anything is decoded: a small file may claim gigapixels.
void check_header(const fs::path& path, const std::vector<std::uint8_t>& bytes,
                  const CameraModel& camera) {
  const auto header = png_header(bytes);
  if (!header) refuse(path, "is not a PNG file");
  if (header->width != static_cast<std::uint32_t>(camera.width_px) ||
      header->height != static_cast<std::uint32_t>(camera.height_px)) {
    refuse(path, fmt::format("is {}x{}, but sensor.yaml's camera is {}x{}", header->width,
                             header->height, camera.width_px, camera.height_px));
  }
  if (header->bit_depth != 16 || !header->grey) {
    refuse(path, fmt::format("is a {}-bit {} picture, but the rest image is 16-bit grey",
                             header->bit_depth, header->grey ? "grey" : "colour"));
  }
}

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

fs::path measured_folder(const fs::path& sensor) {
  return linked_to(sensor).parent_path() / kMeasuredFolder;
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
  out.target.family = read_family(root);
  out.target.tag_size = root.positive("tag_size_mm") * kMm;
  out.camera_sha256 = root.text("camera_sha256");
  out.target.scale_sigma = optional_scale_sigma(root);
  out.target.tags.clear();
  for (YamlReader& entry : root.children("tags")) {
    out.target.tags.push_back(read_tag(entry, out.target.family));
    if (!out.target.tags.back().platform_T_tag) no_pose(entry);
  }
  YamlReader rest = root.child("rest");
  const std::optional<Eigen::Isometry3d> pose = optional_pose(rest);
  if (!pose) no_pose(rest);
  out.rest = *pose;
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
  out.zero = six(root, "zero_n", "zero_nm");
  out.sensor_sha256 = root.text("sensor_sha256");
  out.wrench_sha256 = root.text("wrench_sha256");
  root.finish();
  return out;
}

MeasuredPicture read_measured_picture(const fs::path& folder, const PictureName& name,
                                      const CameraModel& camera) {
  for (const char* which : {"", kBefore}) {
    const fs::path file = folder / (name.file + which);
    if (sha256_hex(text_of_file(file).value_or("")) != name.sha256) continue;
    MeasuredPicture picture{load_reference_image(file, camera), *which != '\0'};
    picture.image.frames = name.frames;
    return picture;
  }
  std::error_code error;
  throw ConfigError("{}: {}; run `tagwrench calibrate target`, or remove {}",
                    (folder / name.file).string(),
                    fs::exists(folder / name.file, error)
                        ? "is not the picture that target.yaml was found with (SHA-256 differs)"
                        : "is missing, and target.yaml needs it",
                    (folder / kMeasuredTarget).string());
}

void check_owner(const fs::path& file, const MeasuredStamp& stamp, const fs::path& sensor) {
  std::error_code error;
  const fs::path real = linked_to(sensor);
  if (stamp.sensor.empty() || stamp.sensor == real.filename()) return;
  if (fs::path(stamp.sensor).filename() != stamp.sensor) return;
  if (!fs::exists(real.parent_path() / stamp.sensor, error)) return;  // it was renamed
  throw ConfigError(
      "{}: was measured for {}, which is in this folder too; give each sensor a folder of its own, "
      "with its {}/",
      file.string(), stamp.sensor, kMeasuredFolder);
}

std::string camera_yaml(const CameraFile& file, const std::string& name) {
  const CameraModel& c = file.camera;
  std::string text = fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", c.width_px,
                                 c.height_px, yaml_quoted(name));
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
                      name(file.target.family), file.target.tag_size / kMm, file.camera_sha256);
  if (file.target.scale_sigma > 0)
    text += fmt::format("scale_sigma: {:.4g}\n", file.target.scale_sigma);
  text += fmt::format("rest: {{{}}}\ntags:\n", pose_text(file.rest));
  for (const Tag& tag : file.target.tags) {
    text += fmt::format("  - {{id: {}, {}", tag.id, pose_text(tag.platform_T_tag.value()));
    if (!tag.sigma.isZero()) {
      text += fmt::format(",\n     position_sigma_mm: {}, rotation_sigma_rad: {}",
                          list(tag.sigma.head<3>() / kMm, 6), list(tag.sigma.tail<3>(), 7));
    }
    text += "}\n";
  }
  if (file.picture) {
    text +=
        fmt::format("picture: {{file: {}, frames: {}, sha256: {}}}\n",
                    yaml_quoted(file.picture->file), file.picture->frames, file.picture->sha256);
  }
  if (file.readout) text += fmt::format("readout_ms: {:.1f}\n", *file.readout / kMm);
  return text;
}

std::string zero_yaml(const ZeroFile& file) {
  return "format: tagwrench-zero-1\n" + stamp_text(file.stamp, "") +
         fmt::format("zero_n: {}\nzero_nm: {}\nsensor_sha256: {}\nwrench_sha256: {}\n",
                     list(file.zero.head<3>(), 7), list(file.zero.tail<3>(), 7), file.sensor_sha256,
                     file.wrench_sha256);
}

void check_measurable(const fs::path& folder, const std::vector<const char*>& files) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) {
    check_replaceable(folder);  // a new name in a folder that can be written
    return;
  }
  if (!fs::is_directory(folder, error)) {
    throw ConfigError("{}: is no folder, and what is measured goes there; move it elsewhere",
                      folder.string());
  }
  for (const char* file : files) {
    check_replaceable(folder / file);
    check_replaceable(folder / (std::string(file) + kBefore));
  }
}

void write_measured(const fs::path& file, std::string_view text) {
  std::error_code error;
  fs::create_directory(file.parent_path(), error);  // whoever writes below says what is wrong
  if (fs::exists(file, error)) write_atomically(fs::path(file) += kBefore, read_text(file));
  write_atomically(file, text);
}

void write_measured_target(const fs::path& folder, TargetFile target,
                           const ReferenceImage& picture) {
  const std::string bytes = encode_reference_image(picture);
  target.picture = {kMeasuredPicture, sha256_hex(bytes), picture.frames};
  std::error_code error;
  fs::create_directory(folder, error);
  // The picture before may be the one in force, where an earlier measurement ended in between.
  const fs::path file = folder / kMeasuredPicture;
  std::string in_force;
  try {
    if (const auto named = read_target_file(folder / kMeasuredTarget).picture)
      in_force = named->sha256;
  } catch (const ConfigError&) {  // nothing is in force that could get lost
  }
  const std::string old = fs::exists(file, error) ? read_text(file) : std::string();
  if (!old.empty() && sha256_hex(old) == in_force) write_atomically(fs::path(file) += kBefore, old);
  write_atomically(file, bytes);
  write_measured(folder / kMeasuredTarget, target_yaml(target));
}

void set_aside(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return;
  fs::rename(file, fs::path(file) += kBefore, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: cannot be renamed ({}); remove it yourself",
                                         file.string(), error.message()));
  }
}

ReferenceImage load_reference_image(const fs::path& path, const CameraModel& camera) {
  const std::optional<std::string> text = text_of_file(path);
  if (!text) refuse(path, "cannot be read as a file");
  const std::vector<std::uint8_t> bytes(text->begin(), text->end());
  check_header(path, bytes, camera);
  std::vector<std::uint16_t> counts;
  if (!decode_png(bytes, camera.width_px, camera.height_px, counts)) refuse(path, "is damaged");
  ReferenceImage image{
      .width = camera.width_px, .height = camera.height_px, .frames = 0, .level = {}};
  image.level.reserve(counts.size());
  for (const std::uint16_t count : counts)
    image.level.push_back(static_cast<float>(count) / kReferenceCountsPerLevel);
  return image;
}

std::string encode_reference_image(const ReferenceImage& image) {
  if (image.width <= 0 || image.height <= 0 ||
      image.level.size() !=
          static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    throw std::invalid_argument("rest image: size and levels do not agree");
  std::vector<std::uint16_t> counts(image.level.size());
  std::transform(image.level.begin(), image.level.end(), counts.begin(), [](float level) {
    return static_cast<std::uint16_t>(
        std::clamp(std::round(level * kReferenceCountsPerLevel), 0.0F, 65535.0F));
  });
  const std::vector<std::uint8_t> bytes = encode_png(counts.data(), image.width, image.height);
  return {bytes.begin(), bytes.end()};
}

SensorIdentity identity_of(const CameraModel& camera, const TargetDescription& target,
                           const ReferenceOptions& rest) {
  std::vector<int> ids;
  for (const Tag& tag : target.tags) ids.push_back(tag.id);
  return {.family = std::string(name(target.family)),
          .tag_ids = std::move(ids),
          .tag_size_mm = target.tag_size * 1e3,
          .image_px = {camera.width_px, camera.height_px},
          .lens_px = std::array{camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px},
          .target_sha256 = target_hash(target, rest)};
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
    for (std::size_t i = 0; i < 4; ++i)
      if (!same((*its.lens_px)[i], (*ours.lens_px)[i]))
        return say("lens (fx,fy,cx,cy)", list(*its.lens_px), list(*ours.lens_px));
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
  return sha256_hex(
      fmt::format("{:.6g} {:.6g} ", fmt::join(model.K.reshaped(), " "), fmt::join(model.B, " ")));
}

}  // namespace tagwrench

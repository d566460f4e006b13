#include "host/sensor/sensor_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/parse.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/geometry_keys.h"
#include "host/sensor/measured_files.h"
#include "host/tracker/rotation.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr double kMm = 1e-3;
constexpr double kMinTag_mm = 0.01;
constexpr double kMaxTag_mm = 10'000;

namespace fs = std::filesystem;

std::string shown(const char* file) { return fmt::format("{}/{}", kMeasuredFolder, file); }

[[noreturn]] void refuse(const fs::path& file, const std::string& why, const char* remedy) {
  throw ConfigError("{}: {}; {}, or remove the file", file.string(), why, remedy);
}

/// camera_info speaks of the image as the camera delivers it, we of what it is turned back to.
CameraModel turned_back(CameraModel camera) {
  camera.cx_px = camera.width_px - 1 - camera.cx_px;
  camera.distortion[3] = -camera.distortion[3];
  return camera;
}

std::string described(const TargetDescription& target) {
  std::vector<int> ids;
  for (const Tag& tag : target.tags) ids.push_back(tag.id);
  std::sort(ids.begin(), ids.end());
  return fmt::format("tags {} of {}, {:.6g} mm", fmt::join(ids, ","), name(target.family),
                     target.tag_size * 1e3);
}

/// What of measured/ is put over what sensor.yaml says, and whether it may be. All throw
/// ConfigError that names the file, what does not fit and the remedy.
struct Measured {
  fs::path sensor;  ///< path of sensor.yaml, or what stands for it
  fs::path folder;  ///< empty: nothing was measured
  WrenchCalibration use = WrenchCalibration::use;

  bool has_target() const {
    return use < WrenchCalibration::without_target && is_measured(folder, kMeasuredTarget);
  }

  bool has_wrench() const {
    return use < WrenchCalibration::without_target && is_measured(folder, kMeasuredWrench);
  }

  // In this order: each is held against those before it.

  void take_camera(SensorConfig& to) const {
    if (use >= WrenchCalibration::without_camera || !is_measured(folder, kMeasuredCamera)) return;
    const fs::path path = folder / kMeasuredCamera;
    const CameraFile file = read_camera_file(path);
    check_owner(path, file.stamp, sensor);
    CameraModel camera = file.camera;
    if (camera.width_px != to.camera.width_px || camera.height_px != to.camera.height_px) {
      refuse(path,
             fmt::format("is of {}x{} pixels, but sensor.yaml's camera is {}x{}", camera.width_px,
                         camera.height_px, to.camera.width_px, to.camera.height_px),
             "run `tagwrench calibrate camera` at that size");
    }
    camera.mirrored = file.mirrored.value_or(to.camera.mirrored);
    if (camera.mirrored) camera = turned_back(camera);
    camera.readout = to.camera.readout;
    to.camera = camera;
    to.camera_calibrated.reset();
    if (file.views > 0)
      to.camera_calibrated = CameraRecord{file.stamp.date, file.views, file.rms_px};
    to.camera_from = {shown(kMeasuredCamera), file.stamp.date};
  }

  void take_target(SensorConfig& to) const {
    if (!has_target()) return;
    constexpr const char* kRemedy = "run `tagwrench calibrate target`";
    const fs::path path = folder / kMeasuredTarget;
    const TargetFile file = read_target_file(path);
    check_owner(path, file.stamp, sensor);
    if (described(file.target) != described(to.target)) {
      refuse(path,
             fmt::format("is of {}, but sensor.yaml has {}", described(file.target),
                         described(to.target)),
             kRemedy);
    }
    if (file.camera_sha256 != sha256_of(to.camera)) {
      refuse(path,
             fmt::format("was found with another camera than the one of {}", to.camera_from.file),
             kRemedy);
    }
    for (Tag& tag : to.target.tags) {
      const auto its = std::find_if(file.target.tags.begin(), file.target.tags.end(),
                                    [&](const Tag& other) { return other.id == tag.id; });
      if (its != file.target.tags.end()) tag = *its;
    }
    to.target.scale_sigma = file.target.scale_sigma;
    to.rest.camera_T_platform = file.rest;
    std::string unfinished;
    to.rest.appearance.reset();
    if (file.picture) {
      MeasuredPicture picture = read_measured_picture(folder, *file.picture, to.camera);
      to.rest.appearance = std::move(picture.image);
      to.rest.frames = file.picture->frames;
      if (picture.before)
        unfinished = fmt::format(
            "a later measurement ended half-way, and {} is its picture; run "
            "`tagwrench calibrate target` again",
            shown(file.picture->file.c_str()));
    }
    if (file.readout) to.camera.readout = *file.readout;
    to.target_from = {shown(kMeasuredTarget), file.stamp.date, unfinished};
  }

  /// Its path alone.
  void name_wrench(SensorConfig& to) const {
    if (!has_wrench()) return;
    to.calibration = (folder / kMeasuredWrench).string();
    to.wrench_from.file = shown(kMeasuredWrench);
  }

  void take_zero(SensorConfig& to) const {
    if (use >= WrenchCalibration::ignore || !is_measured(folder, kMeasuredZero)) return;
    const fs::path path = folder / kMeasuredZero;
    const ZeroFile file = read_zero_file(path);
    check_owner(path, file.stamp, sensor);
    const bool same_sensor =
        file.sensor_sha256 == sha256_of(identity_of(to.camera, to.target, to.rest));
    if (!same_sensor || file.wrench_sha256 != sha256_of(to.wrench)) {
      if (use == WrenchCalibration::zero_that_fits) return;
      refuse(path,
             same_sensor ? "was found with another calibration in newtons"
                         : "was found with another camera or target",
             "run `tagwrench zero`");
    }
    to.zero.set = file.zero;
    to.zero.date = file.stamp.date;
    to.zero_from = {shown(kMeasuredZero), file.stamp.date};
  }
};

/// {date: YYYY-MM-DD, views: N, rms_px: x}
CameraRecord read_camera_record(YamlReader node) {
  CameraRecord record;
  record.date = optional_date(node, "date");
  if (record.date.empty()) node.fail("date", "is missing; give YYYY-MM-DD");
  record.views = node.integer("views", 1, 100'000);
  record.rms_px = node.non_negative("rms_px");
  node.finish();
  return record;
}

/// From 0, which `zero` explains, up to `longest`; 0 if it is left out.
double read_ms(YamlReader& node, const char* key, double longest, const char* zero) {
  const double ms = node.number_or(key, 0.0);
  if (ms < 0 || ms > longest)
    node.fail(key, fmt::format("must be from 0 ({}) to {}, is {}", zero, longest, ms));
  return ms;
}

CameraModel read_camera(YamlReader node, std::optional<CameraRecord>& record, double& latency) {
  CameraModel camera;
  camera.width_px = node.integer("width", 16, 16384);
  camera.height_px = node.integer("height", 16, 16384);
  camera.fx_px = node.within("fx", 1, kMaxFocal_px);
  camera.fy_px = node.within("fy", 1, kMaxFocal_px);
  camera.cx_px = node.within("cx", -kFarthestCentre_px, kFarthestCentre_px);
  camera.cy_px = node.within("cy", -kFarthestCentre_px, kFarthestCentre_px);
  const std::vector<double> distortion = node.numbers_or("distortion", std::vector<double>(5, 0.0));
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  check_no_fold(node, "distortion", camera, "leave it out");
  camera.mirrored = node.boolean_or("mirrored", false);
  camera.readout = read_ms(node, "readout_ms", 200, "all rows at once") * 1e-3;
  latency = read_ms(node, "latency_ms", 500, "not known") * 1e-3;
  if (node.has("calibrated")) record = read_camera_record(node.child("calibrated"));
  node.finish();
  return camera;
}

TargetDescription read_target(YamlReader node) {
  TargetDescription target;
  target.family = read_family(node);
  target.tag_size = node.within("tag_size_mm", kMinTag_mm, kMaxTag_mm) * kMm;
  if (node.has("border_mm")) target.border = node.within("border_mm", 0, kMaxTag_mm) * kMm;
  target.scale_sigma = optional_scale_sigma(node);
  target.tags.clear();
  for (YamlReader& entry : node.children("tags")) {
    const Tag tag = read_tag(entry, target.family);
    for (const Tag& other : target.tags)
      if (other.id == tag.id)
        entry.fail("id", fmt::format("tag {} is listed twice; every tag needs its own id", tag.id));
    target.tags.push_back(tag);
  }
  if (target.tags.size() > static_cast<std::size_t>(kMaxTags))
    node.fail("tags", fmt::format("at most {} tags are tracked", kMaxTags));
  node.finish();
  return target;
}

/// `written` relative to the folder of sensor.yaml.
std::filesystem::path beside(const YamlReader& node, const std::filesystem::path& written) {
  return std::filesystem::path(node.file()).parent_path() / written;
}

/// Without `picture` the one that it names is not looked at.
ReferenceOptions read_rest(YamlReader node, const CameraModel& camera, bool picture) {
  ReferenceOptions rest;
  rest.frames = node.integer_or("frames", 1, 1000, rest.frames);
  rest.camera_T_platform = optional_pose(node);
  if (node.has("appearance")) {
    if (!rest.camera_T_platform) {
      node.fail("appearance",
                "needs position_mm and rotation_rad, the pose that it shows; run `tagwrench "
                "calibrate target`, or leave it out");
    }
    const std::string file = node.text("appearance");
    if (file.empty()) node.fail("appearance", "names no file; name one, or leave the key out");
    if (picture) {
      rest.appearance = load_reference_image(beside(node, file), camera);
      rest.appearance->frames = rest.frames;
    }
  }
  node.finish();
  return rest;
}

Springs read_springs(YamlReader node) {
  Springs springs;
  const std::vector<std::vector<double>> centres = node.points("centres_mm", 3);
  for (const std::vector<double>& p : centres) springs.centres.push_back(vector3(p) * kMm);
  springs.axial = node.positive("axial_n_per_mm") / kMm;
  springs.lateral = node.positive("lateral_n_per_mm") / kMm;
  springs.bending = node.non_negative_or("bending_nm_per_rad", 0);
  springs.torsion = node.non_negative_or("torsion_nm_per_rad", 0);
  node.finish();
  return springs;
}

Vector6 force_and_torque(YamlReader& node, const std::string& force_key,
                         const std::string& torque_key, Vector6 value) {
  const auto read = [&](const std::string& key, int first) {
    if (!node.has(key)) return;
    const std::vector<double> v = node.numbers(key, 3);
    for (int i = 0; i < 3; ++i) {
      if (v[i] <= 0)
        node.fail(key, fmt::format("must be greater than 0 on every axis, is {} on axis {}", v[i],
                                   i + 1));
      value[first + i] = v[i];
    }
  };
  read(force_key, 0);
  read(torque_key, 3);
  return value;
}

ZeroConfig read_zero(YamlReader& node) {
  constexpr double kPercent = 0.01;
  ZeroConfig zero;
  if (both_or_neither(node, "zero_n", "zero_nm", ", or run `tagwrench zero`"))
    zero.set = six(node, "zero_n", "zero_nm");
  zero.date = optional_date(node, "zero_date");
  zero.follow = node.boolean_or("zero_tracking", zero.follow);
  if (node.has("zero_band_percent")) zero.band = node.within("zero_band_percent", 0, 10) * kPercent;
  if (node.has("zero_rate_percent_per_s"))
    zero.rate = node.within("zero_rate_percent_per_s", 0, 1) * kPercent;
  return zero;
}

ReferenceLine read_reference(YamlReader node) {
  ReferenceLine line;
  line.channel = node.integer("channel", 0, 3);
  line.point = vector3(node.numbers("point_mm", 3)) * kMm;
  line.direction = vector3(node.numbers("direction", 3));
  const double length = line.direction.norm();
  if (!(length > 1e-6))
    node.fail("direction", "has no length; give the direction of the force on the platform");
  line.direction /= length;
  node.finish();
  return line;
}

/// Fills the wrench's part of `sensor`. A calibration wins over springs, which then complete the
/// next one, and a measured one over one that sensor.yaml names.
WrenchModel read_wrench(YamlReader node, SensorConfig& sensor, const Measured& measured) {
  WrenchModel model;
  const bool named = node.has("calibration");
  if (!named && !node.has("springs") && !measured.has_wrench()) {
    node.fail(
        "calibration",
        "give either calibration: FILE or springs: {...}, so that displacement becomes newtons");
  }
  if (node.has("springs")) {
    sensor.spring_stiffness = stiffness(read_springs(node.child("springs")));
    model.K = *sensor.spring_stiffness;
  }
  if (named) {
    const std::string file = node.text("calibration");
    sensor.calibration = beside(node, file).string();
    sensor.wrench_from.file = file;
  }
  measured.name_wrench(sensor);
  if (!sensor.calibration.empty() && measured.use < WrenchCalibration::ignore) {
    const CalibrationFacts facts =
        load_calibration(sensor.calibration, sensor.camera, sensor.target, sensor.rest, model);
    sensor.completed_axes = facts.completed_axes;
    sensor.wrench_from.date = facts.date.substr(0, 10);
  }
  model.range = force_and_torque(node, "range_n", "range_nm", model.range);
  model.wrench_origin = vector3(node.numbers_or("origin_mm", {0, 0, 0})) * kMm;
  model.camera_R_wrench_frame =
      rotation_from_vector(vector3(node.numbers_or("frame_rotation_rad", {0, 0, 0})));
  sensor.zero = read_zero(node);
  sensor.zero_from.date = sensor.zero.date;
  if (node.has("reference")) sensor.reference = read_reference(node.child("reference"));
  node.finish();
  return model;
}

/// "-y" -> the row (0 -1 0).
Eigen::RowVector3d signed_axis(YamlReader& node, const std::string& key) {
  const std::vector<std::string_view> names = {"+x", "+y", "+z", "-x", "-y", "-z"};
  const std::size_t i = node.one_of(key, names);
  Eigen::RowVector3d row = Eigen::RowVector3d::Zero();
  row[static_cast<int>(i % 3)] = i < 3 ? 1 : -1;
  return row;
}

Eigen::Matrix3d read_mounting(YamlReader node) {
  Eigen::Matrix3d hid_R_camera;
  hid_R_camera.row(0) = signed_axis(node, "right");
  hid_R_camera.row(1) = signed_axis(node, "toward_user");
  hid_R_camera.row(2) = signed_axis(node, "down");
  if (std::abs(hid_R_camera.determinant() - 1) > 1e-9) {
    node.fail("right",
              "right, toward_user and down must be three different camera axes that form a "
              "right-handed frame");
  }
  node.finish();
  return hid_R_camera;
}

ShapingOptions read_shaping(YamlReader node, ShapingOptions shaping) {
  const Vector6 share = shaping.dead_zone.cwiseQuotient(shaping.full_scale);
  shaping.full_scale = force_and_torque(node, "full_scale_n", "full_scale_nm", shaping.full_scale);
  shaping.dead_zone = share.cwiseProduct(shaping.full_scale);
  for (const auto& [key, first] : {std::pair{"dead_zone_n", 0}, std::pair{"dead_zone_nm", 3}}) {
    const std::vector<double> read = node.numbers_or(
        key,
        {shaping.dead_zone[first], shaping.dead_zone[first + 1], shaping.dead_zone[first + 2]});
    for (int i = 0; i < 3; ++i) {
      const double dead_zone = read[static_cast<std::size_t>(i)];
      if (dead_zone < 0) node.fail(key, "must not be negative");
      if (dead_zone >= shaping.full_scale[first + i])
        node.fail(key, "must be smaller than the full scale of its axis");
      shaping.dead_zone[first + i] = dead_zone;
    }
  }
  node.finish();
  return shaping;
}

/// "256f:c62e"
HidIdentity read_identity(YamlReader node) {
  const std::string text = node.text("id");
  const bool formed = text.size() == 9 && text[4] == ':';
  const auto hex = [&](std::size_t at) {
    return formed ? parse_whole<std::uint16_t>(std::string_view(text).substr(at, 4), 16)
                  : std::nullopt;
  };
  const auto vendor = hex(0), product = hex(5);
  if (!vendor || !product) {
    node.fail("id", fmt::format("'{}' is not vendor:product in hexadecimal, such as \"256f:c62e\"",
                                text));
  }
  const HidIdentity identity{*vendor, *product};
  if (identity.vendor == 0x046d && (identity.product == 0xc626 || identity.product == 0xc623)) {
    node.fail("id",
              "the kernel's hid-logitech driver takes this id and refuses virtual devices; use "
              "256f:c62e");
  }
  node.finish();
  return identity;
}

SensorConfig read_sensor(YamlReader root, const Measured& measured) {
  SensorConfig sensor;
  sensor.camera =
      read_camera(root.child("camera"), sensor.camera_calibrated, sensor.camera_latency);
  if (sensor.camera_calibrated) sensor.camera_from.date = sensor.camera_calibrated->date;
  measured.take_camera(sensor);
  sensor.target = read_target(root.child("target"));
  const bool its_picture =
      measured.use < WrenchCalibration::without_target && !measured.has_target();
  if (root.has("rest")) sensor.rest = read_rest(root.child("rest"), sensor.camera, its_picture);
  measured.take_target(sensor);
  sensor.wrench = read_wrench(root.child("wrench"), sensor, measured);
  measured.take_zero(sensor);
  Eigen::Matrix3d hid_R_camera = sensor.shaping.hid_R_camera;
  if (root.has("mounting")) hid_R_camera = read_mounting(root.child("mounting"));
  const Vector6 range = range_through(WrenchEstimator(sensor.wrench).tool(), sensor.wrench.range);
  sensor.shaping = shaping_for(range, hid_R_camera);
  if (root.has("shaping")) sensor.shaping = read_shaping(root.child("shaping"), sensor.shaping);
  if (root.has("spacemouse")) sensor.spacemouse = read_identity(root.child("spacemouse"));
  root.finish();
  return sensor;
}

std::string line(const char* what, const std::string& file, const std::string& date) {
  return fmt::format("{}: {}{}", what, file, date.empty() ? "" : ", of " + date);
}

}  // namespace

SensorConfig load_sensor(const std::string& path, WrenchCalibration use) {
  return read_sensor(YamlReader::from_file(path), {path, measured_folder(path), use});
}

SensorConfig parse_sensor(const std::string& text, const std::string& name, WrenchCalibration use,
                          const std::filesystem::path& measured) {
  return read_sensor(YamlReader::from_text(text, name), {name, measured, use});
}

std::vector<std::string> in_force(const SensorConfig& sensor) {
  std::vector<std::string> lines = {
      line("camera", sensor.camera_from.file, sensor.camera_from.date)};
  const bool placed = sensor.rest.camera_T_platform.has_value();
  lines.push_back(placed ? line("target", sensor.target_from.file, sensor.target_from.date)
                         : "target: sensor.yaml; its rest is learned at every start");
  if (!sensor.target_from.unfinished.empty())
    lines.push_back("target: " + sensor.target_from.unfinished);
  lines.push_back(sensor.calibration.empty()
                      ? "wrench: sensor.yaml's springs"
                      : line("wrench", sensor.wrench_from.file, sensor.wrench_from.date));
  const bool zero = !sensor.zero.date.empty() || !sensor.zero.set.isZero();
  lines.push_back(zero ? line("zero", sensor.zero_from.file, sensor.zero_from.date)
                       : "zero: none is set");
  return lines;
}

Profile default_profile(const SensorConfig& sensor) {
  const Vector6 range = range_through(WrenchEstimator(sensor.wrench).tool(), sensor.wrench.range);
  Profile profile;
  profile.name = "default";
  profile.shaping = sensor.shaping;
  profile.gestures = gestures_for(range, sensor.shaping.hid_R_camera);
  return profile;
}

}  // namespace tagwrench

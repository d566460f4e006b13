#include "host/sensor/sensor_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <utility>

#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/appearance_file.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/lens_check.h"
#include "host/sensor/measured.h"
#include "host/sensor/measured_files.h"
#include "host/sensor/pose_keys.h"
#include "host/wrench/estimate.h"
#include "host/wrench/spring_model.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr double kMm = 1e-3;
constexpr double kMinTag_mm = 0.01;
constexpr double kMaxTag_mm = 10'000;

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
  if (const auto at = fold(camera)) {
    node.fail("distortion",
              fmt::format("folds the image at pixel ({:.0f}, {:.0f}), which no lens does; run "
                          "`tagwrench calibrate camera`, or leave it out",
                          at->x(), at->y()));
  }
  camera.mirrored = node.boolean_or("mirrored", false);
  camera.readout = read_ms(node, "readout_ms", 200, "all rows at once") * 1e-3;
  latency = read_ms(node, "latency_ms", 500, "not known") * 1e-3;
  if (node.has("calibrated")) record = read_camera_record(node.child("calibrated"));
  node.finish();
  return camera;
}

TargetDescription read_target(YamlReader node) {
  TargetDescription target;
  std::vector<std::string_view> families;
  for (int i = 0; i < kTagFamilies; ++i) families.push_back(name(static_cast<TagFamily>(i)));
  target.family = static_cast<TagFamily>(node.one_of("family", families));
  target.tag_size = node.within("tag_size_mm", kMinTag_mm, kMaxTag_mm) * kMm;
  if (node.has("border_mm")) target.border = node.within("border_mm", 0, kMaxTag_mm) * kMm;
  target.tags.clear();
  for (YamlReader& entry : node.children("tags")) {
    Tag tag;
    tag.id = entry.integer("id", 0, id_count(target.family) - 1);
    for (const Tag& other : target.tags) {
      if (other.id == tag.id)
        entry.fail("id", fmt::format("tag {} is listed twice; every tag needs its own id", tag.id));
    }
    tag.platform_T_tag = optional_pose(entry);
    tag.sigma = optional_pose_sigma(entry, tag.platform_T_tag.has_value());
    entry.finish();
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
  if (node.has("zero_n") != node.has("zero_nm")) {
    node.fail(node.has("zero_n") ? "zero_n" : "zero_nm",
              "zero_n and zero_nm belong together; give both or neither, or run `tagwrench zero`");
  }
  zero.set << vector3(node.numbers_or("zero_n", {0, 0, 0})),
      vector3(node.numbers_or("zero_nm", {0, 0, 0}));
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
    node.fail("calibration",
              "give either calibration: FILE or springs: {...}, so that displacement becomes "
              "newtons");
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
    load_calibration(sensor.calibration, sensor.camera, sensor.target, sensor.rest, model);
    sensor.completed_axes = completed_axes(sensor.calibration);
    sensor.wrench_from.date = calibration_date(sensor.calibration).substr(0, 10);
  }
  model.range = force_and_torque(node, "range_n", "range_nm", model.range);
  model.wrench_origin = vector3(node.numbers_or("origin_mm", {0, 0, 0})) * kMm;
  model.camera_R_wrench_frame =
      rotation_of(vector3(node.numbers_or("frame_rotation_rad", {0, 0, 0})));
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
  HidIdentity identity;
  const std::string text = node.text("id");
  const auto hex = [](std::string_view s, std::uint16_t& out) {
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), out, 16);
    return s.size() == 4 && error == std::errc() && end == s.data() + s.size();
  };
  if (text.size() != 9 || text[4] != ':' ||
      !hex(std::string_view(text).substr(0, 4), identity.vendor) ||
      !hex(std::string_view(text).substr(5), identity.product)) {
    node.fail("id", fmt::format("'{}' is not vendor:product in hexadecimal, such as \"256f:c62e\"",
                                text));
  }
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

}  // namespace

SensorConfig load_sensor(const std::string& path, WrenchCalibration use) {
  return read_sensor(YamlReader::from_file(path), {path, measured_folder(path), use});
}

SensorConfig parse_sensor(const std::string& text, const std::string& name, WrenchCalibration use,
                          const std::filesystem::path& measured) {
  return read_sensor(YamlReader::from_text(text, name), {name, measured, use});
}

}  // namespace tagwrench

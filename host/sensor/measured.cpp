#include "host/sensor/measured.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/core/config_error.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/measured_files.h"
#include "host/sensor/sensor_identity.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

std::string shown(const char* file) { return fmt::format("{}/{}", kMeasuredFolder, file); }

[[noreturn]] void refuse(const fs::path& file, const std::string& why, const char* remedy) {
  throw ConfigError(fmt::format("{}: {}; {}, or remove the file", file.string(), why, remedy));
}

/// camera_info speaks of the image as the camera delivers it, we of what it is turned back to.
CameraModel turned_back(CameraModel camera) {
  camera.cx_px = camera.width_px - 1 - camera.cx_px;
  camera.distortion[3] = -camera.distortion[3];
  return camera;
}

std::string ids_of(const TargetDescription& target) {
  std::vector<int> ids;
  for (const Tag& tag : target.tags) ids.push_back(tag.id);
  std::sort(ids.begin(), ids.end());
  std::string out;
  for (const int id : ids) out += fmt::format("{}{}", out.empty() ? "" : ",", id);
  return out;
}

std::string described(const TargetDescription& target) {
  return fmt::format("tags {} of {}, {:.6g} mm", ids_of(target), name(target.family),
                     target.tag_size * 1e3);
}

std::string line(const char* what, const std::string& file, const std::string& date) {
  return fmt::format("{}: {}{}", what, file, date.empty() ? "" : ", of " + date);
}

}  // namespace

bool Measured::has_target() const {
  return use < WrenchCalibration::without_target && is_measured(folder, kMeasuredTarget);
}

bool Measured::has_wrench() const {
  return use < WrenchCalibration::without_target && is_measured(folder, kMeasuredWrench);
}

void Measured::take_camera(SensorConfig& to) const {
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
  if (file.views > 0) to.camera_calibrated = CameraRecord{file.stamp.date, file.views, file.rms_px};
  to.camera_from = {shown(kMeasuredCamera), file.stamp.date};
}

void Measured::take_target(SensorConfig& to) const {
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
  to.rest.camera_T_platform = file.rest;
  to.rest.appearance.reset();
  if (file.picture) {
    to.rest.appearance = read_measured_picture(folder, *file.picture, to.camera);
    to.rest.frames = file.picture->frames;
  }
  if (file.readout) to.camera.readout = *file.readout;
  to.target_from = {shown(kMeasuredTarget), file.stamp.date};
}

void Measured::name_wrench(SensorConfig& to) const {
  if (!has_wrench()) return;
  to.calibration = (folder / kMeasuredWrench).string();
  to.wrench_from.file = shown(kMeasuredWrench);
}

void Measured::take_zero(SensorConfig& to) const {
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

std::vector<std::string> in_force(const SensorConfig& sensor) {
  std::vector<std::string> lines = {
      line("camera", sensor.camera_from.file, sensor.camera_from.date)};
  const bool placed = sensor.rest.camera_T_platform.has_value();
  lines.push_back(placed ? line("target", sensor.target_from.file, sensor.target_from.date)
                         : "target: sensor.yaml; its rest is learned at every start");
  lines.push_back(sensor.calibration.empty()
                      ? "wrench: sensor.yaml's springs"
                      : line("wrench", sensor.wrench_from.file, sensor.wrench_from.date));
  const bool zero = !sensor.zero.date.empty() || !sensor.zero.set.isZero();
  lines.push_back(zero ? line("zero", sensor.zero_from.file, sensor.zero_from.date)
                       : "zero: none is set");
  return lines;
}

}  // namespace tagwrench

// A recording as the program of Ouyang and Howe (ICRA 2020) would have written it, so that whoever
// has scripts for its files can use them.
//
// Fields are separated by "; ", the first is text. Tags: time (s), position of tag 1 and tag 2 (m),
// Euler angles of tag 1 and tag 2 (deg, about x, y, z), mean position, mean angles, weight.
// Positions and angles count from the first row; then 0.05 m is taken off the positions, and the
// angles are smoothed exponentially with that weight. Reference: time (s), Fx Fy Fz Mx My Mz in raw
// counts.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "host/app/recording_sensor.h"
#include "host/commands/export_command.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/log.h"

namespace tagwrench {
namespace {

constexpr double kWeight = 0.2;
constexpr double kOffset = 0.05;  // m
/// Of the paper's OptoForce: counts per N and per N m.
constexpr std::array<double, 6> kCountsPerUnit = {96.11, 95.64, 20.92, 5425.36, 5524.60, 8103.25};
constexpr double kDegree = 180 / std::numbers::pi;

using Vector3 = std::array<double, 3>;

struct TagPose {
  Vector3 position{};  ///< in the camera's frame, m
  Vector3 angles{};    ///< R = Rz Ry Rx, deg
};

struct Lens {
  cv::Mat matrix;
  cv::Mat distortion;
};

Lens lens_of(const CameraModel& camera) {
  Lens lens;
  lens.matrix = (cv::Mat_<double>(3, 3) << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px,
                 camera.cy_px, 0, 0, 1);
  lens.distortion = cv::Mat(1, 5, CV_64F);
  for (int i = 0; i < 5; ++i)
    lens.distortion.at<double>(i) = camera.distortion[static_cast<std::size_t>(i)];
  return lens;
}

Vector3 euler_deg(const cv::Mat& rotation) {
  const auto r = [&rotation](int row, int column) { return rotation.at<double>(row, column); };
  return {std::atan2(r(2, 1), r(2, 2)) * kDegree,
          std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0))) * kDegree,
          std::atan2(r(1, 0), r(0, 0)) * kDegree};
}

/// Each tag by itself, as that program had it.
std::optional<TagPose> pose_of(const TagCorners& corners, const SensorConfig& sensor,
                               const Lens& lens) {
  const double h = 0.5 * sensor.target.tag_size;
  const std::vector<cv::Point3d> square = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  std::vector<cv::Point2d> pixels;
  for (std::size_t c = 0; c < 4; ++c) {
    const double x = corners.px[2 * c];
    pixels.emplace_back(sensor.camera.mirrored ? sensor.camera.width_px - 1 - x : x,
                        corners.px[2 * c + 1]);
    if (!std::isfinite(x) || !std::isfinite(corners.px[2 * c + 1])) return std::nullopt;
  }
  cv::Mat turn;
  cv::Mat position;
  if (!cv::solvePnP(square, pixels, lens.matrix, lens.distortion, turn, position, false,
                    cv::SOLVEPNP_IPPE_SQUARE)) {
    return std::nullopt;
  }
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  return TagPose{{position.at<double>(0), position.at<double>(1), position.at<double>(2)},
                 euler_deg(rotation)};
}

double seconds(TimePoint time, TimePoint start) {
  return std::chrono::duration<double>(time - start).count();
}

/// Angles that jump from 180 to -180 have not.
double angle_between(double from, double to) { return std::remainder(to - from, 360.0); }

std::size_t export_tags(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording);
  const SensorConfig sensor = recorded_sensor(reader.head(), recording, WrenchCalibration::ignore);
  if (sensor.target.tags.size() != 2) {
    throw ConfigError(fmt::format(
        "{}: the paper's columns are those of two tags, and this sensor has {}; use --csv",
        recording, sensor.target.tags.size()));
  }
  const Lens lens = lens_of(sensor.camera);
  ExportFile file(path, force);
  std::size_t rows = 0;
  std::array<TagPose, 2> first;
  std::array<Vector3, 2> smooth{};
  const auto& times = reader.frame_times();
  for (record::TrackRecord record; reader.next(record);) {
    if (record.track.status != Status::ok || record.track.corner_count != 2) continue;
    std::array<Vector3, 2> position{};
    std::array<TagPose, 2> pose;
    bool both = true;
    for (std::size_t tag = 0; tag < 2 && both; ++tag) {
      const auto found = pose_of(record.track.corners[tag], sensor, lens);
      both = found.has_value();
      if (both) pose[tag] = *found;
    }
    if (!both) continue;
    if (rows++ == 0) first = pose;
    std::string line = fmt::format(
        "Arucotag time, tag1 xyz, tag2 xyz, tag1 rollpitchyaw (xyz), tag2 -- xyz zerod averaged -- "
        "expo weight; {}",
        seconds(record.time, times.front()));
    for (std::size_t tag = 0; tag < 2; ++tag) {
      for (std::size_t i = 0; i < 3; ++i) {
        position[tag][i] = pose[tag].position[i] - first[tag].position[i] - kOffset;
        const double angle = angle_between(first[tag].angles[i], pose[tag].angles[i]);
        smooth[tag][i] = (1 - kWeight) * smooth[tag][i] + kWeight * angle;
      }
    }
    const auto append = [&line](double value) { line += fmt::format("; {}", value); };
    for (const auto* both_tags : {&position, &smooth}) {
      for (const Vector3& of_tag : *both_tags) {
        for (const double value : of_tag) append(value);
      }
    }
    for (const auto* both_tags : {&position, &smooth}) {
      for (std::size_t i = 0; i < 3; ++i) append(0.5 * ((*both_tags)[0][i] + (*both_tags)[1][i]));
    }
    file.out() << line << ";" << kWeight << " \n";
  }
  if (rows == 0) {
    throw ConfigError(
        fmt::format("{}: the tags were never held in it; there is nothing to export", recording));
  }
  file.finish();
  return rows;
}

std::size_t export_reference(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording);
  if (reader.frame_times().empty()) return 0;
  const TimePoint start = reader.frame_times().front();
  std::optional<ExportFile> file;
  std::size_t rows = 0;
  for (record::ReferenceRecord reading; reader.next(reading);) {
    if (reading.axes != 6) continue;
    if (!file) file.emplace(path, force);
    ++rows;
    std::string line =
        fmt::format("Optoforce time, xyz, yawpitchroll; {}", seconds(reading.time, start));
    for (std::size_t i = 0; i < 6; ++i) {
      const double counts = std::isnan(reading.counts[i])
                                ? std::round(reading.value[i] * kCountsPerUnit[i])
                                : reading.counts[i];
      line += fmt::format("; {:.1f}", counts);
    }
    file->out() << line << "\n";
  }
  if (file) file->finish();
  return rows;
}

}  // namespace

void export_paper(const std::string& recording, const std::string& prefix, bool force) {
  const std::size_t tags = export_tags(recording, prefix + "_arucotagData.csv", force);
  const std::size_t readings = export_reference(recording, prefix + "_optoforceData.csv", force);
  log_info(fmt::format("{} of tags, {}", count_text(tags, "row"),
                       readings > 0 ? fmt::format("{} of the reference", readings)
                                    : "none of a reference: no six-axis sensor was recorded"));
}

}  // namespace tagwrench

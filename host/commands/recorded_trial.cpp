#include "host/commands/recorded_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>

#include "host/app/recording.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/recording/reader.h"
#include "host/sensor/measured_files.h"

// Not fuzzed: the first 16 bytes alone; fuzz.recordings has the rest.

namespace tagwrench {
namespace {

double seconds_since(TimePoint from, TimePoint to) {
  return std::chrono::duration<double>(to - from).count();
}

constexpr double kMax = 1e12;  // that an instrument may read; squares of it are finite

bool believable(const Vector6& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMax; }

/// Rows of numbers that grow in time.
struct Table {
  std::vector<double> time;
  std::vector<Vector6> value;
  std::vector<Vector6> sigma;

  /// False, and not added, unless it is later than the row before.
  bool add(double at, const Vector6& row, const Vector6& row_sigma) {
    if (!time.empty() && at <= time.back()) return false;
    time.push_back(at);
    value.push_back(row);
    sigma.push_back(row_sigma);
    return true;
  }
};

Eigen::VectorXd column(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Eigen::MatrixXd rows(const std::vector<Vector6>& values) {
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(values.size()), 6);
  for (std::size_t i = 0; i < values.size(); ++i)
    matrix.row(static_cast<Eigen::Index>(i)) = values[i].transpose();
  return matrix;
}

Vector6 vector(const std::array<double, 6>& numbers) {
  return Eigen::Map<const Vector6>(numbers.data());
}

Table read_tracks(record::RecordingReader& recording, TimePoint origin, const std::string& name,
                  std::vector<std::string>& notes) {
  Table table;
  std::size_t without = 0;
  for (record::TrackRecord record; recording.next(record);) {
    const Track& track = record.track;
    const bool usable = carries_numbers(track.status) && believable(track.displacement) &&
                        believable(track.covariance.diagonal()) &&
                        track.covariance.diagonal().minCoeff() >= 0;
    if (!usable || !table.add(seconds_since(origin, record.time), track.displacement,
                              track.covariance.diagonal().cwiseSqrt()))
      ++without;
  }
  if (table.time.size() < 2)
    throw ConfigError("{}: the target was never held in it; see `tagwrench doctor`", name);
  if (without > 0)
    notes.push_back(
        fmt::format("{}: {} without the target left out", name, count_text(without, "frame")));
  return table;
}

Table read_references(record::RecordingReader& recording, TimePoint origin, const std::string& name,
                      std::vector<std::string>& notes) {
  Table table;
  std::size_t saturated = 0;
  std::size_t useless = 0;
  std::size_t single = 0;
  for (record::ReferenceRecord record; recording.next(record);) {
    if (record.axes != 6) {
      ++single;
      continue;
    }
    const Vector6 value = vector(record.value);
    if (record.saturated)
      ++saturated;
    else if (!believable(value) ||
             !table.add(seconds_since(origin, record.time), value, vector(record.sigma)))
      ++useless;
  }
  if (table.time.size() < 2) {
    throw ConfigError("{}: no six-axis reference in newtons in it{}", name,
                      single > 0 ? "; a load cell's line of action is not recorded: use `tagwrench "
                                   "calibrate wrench` with a plan of load_cell"
                                 : "; record with one, or analyze a calibration's data file");
  }
  if (saturated > 0)
    notes.push_back(fmt::format("{}: {} of the reference left out", name,
                                count_text(saturated, "saturated row")));
  if (useless > 0) {
    notes.push_back(fmt::format(
        "{}: {} of the reference without newtons, or not later than the one before, left out", name,
        count_text(useless, "row")));
  }
  return table;
}

Eigen::VectorXi steps_of(const std::vector<record::Mark>& marks, TimePoint origin,
                         const Eigen::VectorXd& time) {
  if (marks.empty()) return {};
  Eigen::VectorXi step = Eigen::VectorXi::Constant(time.size(), -1);
  for (const record::Mark& mark : marks) {
    const double at = seconds_since(origin, mark.time);
    const auto first = std::lower_bound(time.begin(), time.end(), at) - time.begin();
    step.tail(time.size() - first).setConstant(mark.begin ? mark.step : -1);
  }
  return step;
}

/// Empty where the recording's sensor cannot be read: its readings are still readings.
std::string sensor_of(const record::Head& head, const std::string& name) {
  try {
    const SensorConfig sensor = recorded_sensor(head, name);
    return sha256_of(identity_of(sensor.camera, sensor.target, sensor.rest));
  } catch (const ConfigError&) {
    return {};
  }
}

}  // namespace

bool is_recording(const std::filesystem::path& file) {
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  std::array<char, 16> start{};
  std::error_code error;  // a pipe would be waited for
  std::ifstream in;
  if (std::filesystem::is_regular_file(file, error)) in.open(file, std::ios::binary);
  return in.read(start.data(), start.size()) && std::string_view(start.data(), 16) == kMagic;
}

study::Trial recorded_trial(const std::filesystem::path& file, std::vector<std::string>& notes) {
  record::RecordingReader recording(file);
  const std::string name = file.string();
  if (recording.frame_times().empty()) throw ConfigError("{}: no frames in it; record anew", name);
  if (!recording.unclosed().empty())
    notes.push_back(fmt::format("{} {}", name, recording.unclosed()));
  const TimePoint origin = recording.frame_times().front();
  const Table tracks = read_tracks(recording, origin, name, notes);
  const Table references = read_references(recording, origin, name, notes);

  study::Trial trial;
  trial.name = file.stem().string();
  trial.file = name;
  trial.sensor = sensor_of(recording.head(), name);
  trial.feature_names = study::displacement_names();
  trial.time = column(tracks.time);
  trial.features = rows(tracks.value);
  trial.feature_sigma = rows(tracks.sigma);
  trial.reference_time = column(references.time);
  trial.reference = rows(references.value);
  trial.reference_sigma = rows(references.sigma);
  const auto sigmas = trial.reference_sigma.array();
  if (!(sigmas >= 0 && sigmas <= kMax).all()) trial.reference_sigma.resize(0, 0);
  trial.step = steps_of(recording.marks(), origin, trial.time);
  return trial;
}

}  // namespace tagwrench

#include "tests/bench/wrench_readings.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "host/calibration/analysis/trial_csv.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "tests/bench/tracker_run.h"

namespace tagwrench::bench {
namespace {

double seconds(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

Readings readings_of(const std::string& name, const std::vector<Record>& records) {
  Readings result;
  result.name = name;
  std::vector<double> times_us;
  for (const Record& r : records) {
    if (r.phase == Phase::rest) continue;
    ++result.frames;
    if (!r.reading.ok) continue;
    result.time.push_back(seconds(r.time));
    result.displacement.push_back(r.reading.displacement);
    times_us.push_back(r.us);
    if (r.reading.covariance.diagonal().minCoeff() > 0)
      result.covariance.push_back(r.reading.covariance);
  }
  if (result.covariance.size() != result.time.size()) result.covariance.clear();
  if (!times_us.empty()) {
    const auto middle = times_us.begin() + static_cast<std::ptrdiff_t>(times_us.size() / 2);
    std::nth_element(times_us.begin(), middle, times_us.end());
    result.median_us = *middle;
  }
  return result;
}

Readings truth_of(const std::vector<Record>& records) {
  Readings result;
  result.name = "(t) a tracker without error";
  for (const Record& r : records) {
    if (r.phase == Phase::rest) continue;
    ++result.frames;
    result.time.push_back(seconds(r.time));
    result.displacement.push_back(r.truth);
  }
  return result;
}

}  // namespace

std::vector<Readings> read_experiment(const sim::Scenario& scenario, int moving_frames) {
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the benchmark's sensor");
  Methods methods;
  methods.push_back(
      opencv_mean_of_tags("(a) paper's poses, no filter", sensor, Corners::unrefined));
  methods.push_back(opencv_all_tags("(b) OpenCV subpixel, both tags", sensor, Corners::subpixel));
  methods.push_back(tagwrench_tracker("(c) tagwrench", sensor));
  const Records records = run(*moving_shots(scenario, moving_frames), methods);
  std::vector<Readings> result = {truth_of(records.front())};
  for (std::size_t m = 0; m < methods.size(); ++m)
    result.push_back(readings_of(methods[m]->name(), records[m]));
  return result;
}

Readings rotations_smoothed(Readings readings, double weight, std::string name) {
  readings.name = std::move(name);
  for (std::size_t i = 1; i < readings.displacement.size(); ++i) {
    const Eigen::Vector3d before = readings.displacement[i - 1].tail<3>();
    readings.displacement[i].tail<3>() =
        before + weight * (readings.displacement[i].tail<3>() - before);
  }
  return readings;
}

study::Trial trial_of(const Readings& readings, const ReferenceRecord& reference) {
  const auto count = static_cast<Eigen::Index>(readings.time.size());
  study::Trial trial;
  trial.name = readings.name;
  trial.time = Eigen::VectorXd::Map(readings.time.data(), count);
  trial.features.resize(count, 6);
  if (!readings.covariance.empty()) trial.feature_sigma.resize(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    trial.features.row(i) = readings.displacement[at].transpose();
    if (!readings.covariance.empty())
      trial.feature_sigma.row(i) = readings.covariance[at].diagonal().cwiseSqrt().transpose();
  }
  trial.feature_names = study::displacement_names();
  trial.reference_time = reference.time;
  trial.reference = reference.wrench;
  return trial;
}

}  // namespace tagwrench::bench

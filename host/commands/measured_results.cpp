#include "host/commands/measured_results.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/sensor/measured_files.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

SensorConfig as_it_is(const fs::path& sensor) {
  try {
    return load_sensor(sensor, WrenchCalibration::zero_that_fits);
  } catch (const ConfigError&) {  // its calibration in newtons is of before: the springs count
    return load_sensor(sensor, WrenchCalibration::ignore);
  }
}

}  // namespace

int stopped_unwritten() {
  log_info("stopped; nothing was written");
  return kExitStopped;
}

std::string today() { return fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))); }

MeasuredStamp stamp_for(const fs::path& sensor) {
  std::error_code error;
  const fs::path real = fs::is_symlink(sensor, error) ? fs::weakly_canonical(sensor) : sensor;
  return {today(), "tagwrench " TAGWRENCH_VERSION, real.filename().string()};
}

MeasuredSensor::MeasuredSensor(const std::string& sensor, const std::string& out,
                               const std::vector<const char*>& files)
    : from_(sensor), to_(out.empty() ? sensor : out) {
  const std::string text = read_text(from_);
  std::error_code error;
  if (to_ != from_ && !fs::equivalent(to_, from_, error)) {
    check_replaceable(to_);
    if (fs::exists(to_, error) && read_text(to_) != text) {
      throw ConfigError(
          "{}: is there already and says something else than {}; no sensor.yaml is written over: "
          "measure it with --sensor {}, or name a new file with --out",
          to_.string(), sensor, to_.string());
    }
    if (fs::weakly_canonical(folder(), error) ==
        fs::weakly_canonical(measured_folder(from_), error)) {
      throw ConfigError(
          "--out {}: the folder {}/ beside it is that of {}; name a file in another folder", out,
          kMeasuredFolder, sensor);
    }
  }
  check_measurable(folder(), files);
}

void MeasuredSensor::make(const std::vector<const char*>& keeps) const {
  std::error_code error;
  if (to_ == from_ || fs::equivalent(to_, from_, error)) return;
  if (!fs::exists(to_, error)) write_atomically(to_, read_text(from_));
  for (const char* file : keeps) {
    const fs::path old = measured_folder(from_) / file;
    if (fs::exists(old, error)) write_measured(folder() / file, read_text(old));
  }
}

void void_zero(const fs::path& sensor) {
  const fs::path file = measured_folder(sensor) / kMeasuredZero;
  set_aside(file);
  const SensorConfig now = as_it_is(sensor);
  if (now.zero.set.isZero()) return;
  write_measured(file, zero_yaml({stamp_for(sensor), Vector6::Zero(),
                                  sha256_of(identity_of(now.camera, now.target, now.rest)),
                                  sha256_of(now.wrench)}));
}

}  // namespace tagwrench

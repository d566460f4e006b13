// What calibrations and `zero` share: the folder measured/, dates, and an end before the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/sensor/measured_files.h"

namespace tagwrench {

/// Exit status of a calibration that its user has stopped.
inline constexpr int kExitStopped = 1;
/// Says so, where nothing was written, and returns it.
int stopped_unwritten();

/// YYYY-MM-DD, here.
std::string today();

/// Today, by this program, for this sensor.yaml.
MeasuredStamp stamp_for(const std::filesystem::path& sensor);

/// A sensor.yaml and, where --out asks for it, the new one that results are measured for: the same
/// text in a folder of its own.
class MeasuredSensor {
 public:
  /// Throws ConfigError unless `files` of its measured/ can be written, or if --out names a
  /// sensor.yaml that is there already and says something else.
  MeasuredSensor(const std::string& sensor, const std::string& out,
                 const std::vector<const char*>& files);

  const std::filesystem::path& sensor() const { return to_; }
  std::filesystem::path folder() const { return measured_folder(to_); }
  /// Makes the new one, with those files of the old one's measured/ that `keeps` names. Before any
  /// result is written. Throws std::runtime_error.
  void make(const std::vector<const char*>& keeps) const;

 private:
  std::filesystem::path from_;
  std::filesystem::path to_;
};

/// A zero says nothing about another rest or another calibration: the one measured is set aside,
/// and one in sensor.yaml is overruled. Throws ConfigError or std::runtime_error.
void void_zero(const std::filesystem::path& sensor);

}  // namespace tagwrench

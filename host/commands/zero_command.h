// `tagwrench zero`: what the sensor reads with hands off becomes its zero, in sensor.yaml.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"
#include "host/sensor/sensor_config.h"
#include "host/sensor/sensor_edit.h"

namespace tagwrench {

struct ZeroCommandOptions {
  std::string sensor;  ///< path
  std::string source;  ///< SRC
  int events = -1;     ///< descriptor, see Events
};

/// Entries of `wrench:` that void a zero, for those who measure rest or wrench anew; empty where
/// none was set.
std::vector<YamlEntry> without_zero(const SensorConfig& sensor);

/// Declares itself on the command line; must outlive the parsing.
class ZeroCommand {
 public:
  explicit ZeroCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// 0: written; 1: refused, nothing was written. Throws ConfigError if it cannot start.
  int run() const;

 private:
  command_line::Command verb_;
  ZeroCommandOptions options_;
};

}  // namespace tagwrench

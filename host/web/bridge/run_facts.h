// What the bridge's pages are told of a run, before its first frame.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/recording/records.h"
#include "host/sensor/sensor_config.h"
#include "host/source/frame_source.h"
#include "host/web/bridge/job_command.h"

namespace tagwrench {

struct RunFacts {
  std::string name;  ///< of the sensor
  SourceFormat format;
  SensorConfig sensor;
  JobPlace place;
  std::string camera_device;  ///< node; empty: no camera
  bool board = false;
  bool profiles = false;             ///< its socket listens
  std::optional<record::Head> head;  ///< of a recording; none: something else records already
};

/// The message, with the folder of recordings. Throws ConfigError if the calibration cannot be
/// read.
nlohmann::json hello_of(const RunFacts& facts, const std::string& recordings);

}  // namespace tagwrench

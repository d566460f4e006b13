// A profile as a page has changed it, written where it came from: comments and all else in that
// file stay.
#pragma once

#include <filesystem>
#include <string>

#include "host/sensor/sensor_config.h"

namespace tagwrench {

struct SavedProfile {
  std::filesystem::path file;
  bool is_new = false;  ///< the sensor does not read it by itself
};

/// `file` is where the desk has the profile from, empty if it is a ready-made one or the sensor's
/// own: then `name` says what becomes of it, NAME.yaml in the folder `own`, which must not be there
/// yet. Throws RequestRefused: a fault in the text, or a name that cannot be; ConfigError and
/// std::runtime_error: it cannot be written.
SavedProfile save_profile(const std::string& of, const std::string& name, const std::string& text,
                          const std::string& file, const std::filesystem::path& own,
                          const SensorConfig& sensor);

}  // namespace tagwrench

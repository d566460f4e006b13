// `tagwrench calibrate target`: the platform at rest, then moved about, in; where the tags sit and
// what they look like, in the folder measured/ beside sensor.yaml, out.
#pragma once

#include <optional>
#include <string>

namespace tagwrench {

struct CalibrateTargetOptions {
  std::string sensor;             ///< path
  std::string source;             ///< SRC
  std::string out;                ///< path of a new sensor.yaml to measure for; empty: `sensor`
  std::optional<long> frames;     ///< use no more than this, the rest included
  std::optional<double> seconds;  ///< alike, by the frames' own time
  int events = -1;                ///< descriptor, see Events
};

/// Returns the exit status. Throws ConfigError if it cannot start, or if the recording cannot show
/// where the tags sit; then nothing has been written.
int calibrate_target(const CalibrateTargetOptions& options);

}  // namespace tagwrench

// `tagwrench run` and `tagwrench record`: where its frames come from; and one run, or with pages
// one after the other as jobs want the camera and give it back.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/app/recording.h"
#include "host/output/watchdog.h"

namespace tagwrench {

/// Of the output `web`.
struct WebRunOptions {
  std::string token_file;  ///< made where it is not there; empty: no token
  std::string recordings;  ///< folder; empty: the usual one
  std::string pages;       ///< folder with the built pages; empty: those of this program
  bool open = false;       ///< as `web` among the outputs would, beside the usual ones, and in the
                           ///< browser at once
};

struct RunOptions {
  std::string sensor;  ///< path; empty: for cameras sensor.yaml of the configuration folder, if it
                       ///< is there, else what the source suggests
  std::string source;  ///< SRC; empty: a camera that sees the tags, else the simulated sensor
  std::vector<std::string>
      outputs;  ///< OUT; empty: terminal and every device that can be made here
  std::vector<std::string> profiles;    ///< ready-made ones, files, folders; none: the sensor's own
  std::string name = kUsualSensorName;  ///< tells two sensors on one computer apart
  std::optional<long> frames;
  std::optional<double> seconds;
  bool fast = false;
  bool despite_damage = false;          ///< of a recording: what can be read of it is taken
  bool wait = false;                    ///< for a camera, instead of showing the simulated sensor
  std::string board;                    ///< its port; empty: there is none
  bool no_zero_tracking = false;        ///< the zero stays what sensor.yaml says
  std::optional<RecordOptions> record;  ///< what is to be kept of the run
  WebRunOptions web;
  std::string cells;  ///< calibration file of its load cells; empty: by the board's id
};

/// Returns the exit status. Throws ConfigError if the run cannot start.
int run(const RunOptions& options);

/// The sensor of this profiles, where none is named: the configuration folder's, if it is there.
RunOptions with_own_sensor(RunOptions options);

/// The source that was asked for; without a request a camera that sees the tags, else the simulated
/// sensor, or with RunOptions::wait the first such camera to come. Nothing: a signal came while it
/// waited. `watch` may be null. Throws ConfigError.
std::optional<Input> open_run_input(const RunOptions& options, ServiceWatch* watch);

// For a service: the camera may come later than the program.

/// Calls `look` at once and whenever a camera node comes or changes its permissions, until it
/// returns an input; cameras that are there are not opened in between, so their lights stay off.
/// Nothing: a signal came first. `watch` may be null. Throws ConfigError if /dev cannot be watched.
std::optional<Input> wait_for_camera(const std::function<std::optional<Input>()>& look,
                                     ServiceWatch* watch);

}  // namespace tagwrench

// `tagwrench run` and `tagwrench record`: one run, or with pages one after the other as jobs want
// the camera and give it back.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/app/outputs.h"
#include "host/app/recording.h"

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
  bool wait = false;                    ///< for a camera, instead of showing the simulated sensor
  std::string board;                    ///< its port; empty: there is none
  bool no_zero_tracking = false;        ///< the zero stays what sensor.yaml says
  std::optional<RecordOptions> record;  ///< what is to be kept of the run
  WebRunOptions web;
  std::string cells;  ///< calibration file of its load cells; empty: by the board's id
};

/// Returns the exit status. Throws ConfigError if the run cannot start.
int run(const RunOptions& options);

}  // namespace tagwrench

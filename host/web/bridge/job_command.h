// From a page's request for a calibration to the command line of our own program. Nothing of a page
// gets there that was not looked at: names from fixed lists, numbers in their range, never a path.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "host/source/frame_source.h"

namespace tagwrench {

/// One line for the page that wished: what cannot be, and what to do.
class RequestRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Both throw RequestRefused, naming the key.
std::string checked_line(const char* key, std::string text);
double checked_number(const char* key, const nlohmann::json& value, double least, double most);

/// What the bridge works with, which a job gets too.
struct JobPlace {
  std::string sensor;  ///< path of sensor.yaml; empty: the sensor has none
  std::string source;  ///< SRC
  SourceKind source_kind = SourceKind::simulator;
  std::string board;        ///< port; empty: there is none
  std::string cells;        ///< calibration of its load cells; may be empty
  bool calibrated = false;  ///< there is a calibration in newtons
  bool kept = false;        ///< what the run writes to could not go on after a job
};

struct JobCommand {
  std::string verb;  ///< as the page named it
  std::vector<std::string> arguments;
  bool needs_camera = false;
  bool takes_keys = false;
  bool tells_events = false;
};

/// Throws RequestRefused.
JobCommand job_command(std::string_view verb, const nlohmann::json& options, const JobPlace& place);

/// Those that job_command() would not refuse whatever the options.
std::vector<std::string> possible_jobs(const JobPlace& place);

/// Folder of the certificate of this sensor.
std::string certificate_folder(const JobPlace& place);

}  // namespace tagwrench

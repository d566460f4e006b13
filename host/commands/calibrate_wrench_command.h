// `tagwrench calibrate wrench`: known loads, one after the other, in; measured/wrench.json, its
// data and the key that names it in sensor.yaml, out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/app/recording.h"

namespace tagwrench {

struct CalibrateWrenchOptions {
  std::string sensor;  ///< path
  std::string source;  ///< SRC
  std::string plan;    ///< of a ready-made plan, or path; of a recording empty: its own
  std::string out;     ///< path; empty: measured/wrench.json beside `sensor`
  std::string notes;   ///< environment, for the record
  std::optional<RecordOptions> record;
  bool resume = false;
  bool force = false;
  bool require_all = false;
  bool list_plans = false;
  std::string show_plan;          ///< name; printed to standard output
  std::optional<double> seconds;  ///< of the frames' own time, then stop as if interrupted
  int events = -1;                ///< descriptor, see Events; keys come from standard input then

  std::string board;      ///< port, `auto` for the only one; empty: none
  std::string cells;      ///< calibration file of its load cells; empty: by the board's id
  std::string optoforce;  ///< port; empty: none
  std::vector<double> counts_per_unit;  ///< of that
  std::string emulated_cell;            ///< pipe to the emulated board, for its cell; empty: none
};

/// Returns the exit status: 0 written; 1 stopped or failed on the way, what was measured is kept
/// for --resume; or written, but a recording that was asked for is not whole. Throws ConfigError if
/// it cannot start, or if what was measured makes no calibration. A calibration that was in force
/// stays so until the new one is complete.
int calibrate_wrench(const CalibrateWrenchOptions& options);

}  // namespace tagwrench

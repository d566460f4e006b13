// What `tagwrench board` is told on its command line, and what it does; all return the exit status.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/app/board/board_loop.h"
#include "host/board/cell_calibration.h"

namespace tagwrench {

struct BoardOptions : BoardSetup {
  bool json = false;
  std::optional<double> seconds;  ///< then end
  double line_period = 0.25;      ///< s between the lines that `watch` prints for people

  std::vector<double> counts_per_unit;  ///< of an OptoForce sensor: per N, then per N m
  int force_rate = 100;                 ///< of that sensor, Hz
  double force_filter = 15;             ///< Hz
  bool force_zero = false;              ///< what it shows now is zero

  std::vector<std::string> light;  ///< words of `led`
  int channel = 0;
  std::vector<double> masses_kg;
  double gravity = link::kStandardGravity;
  int conversions = 160;  ///< averaged per mass, and for a tare
  std::string out;        ///< file of `log`

  std::string model;  ///< board to flash
  std::string image;  ///< empty: the one that was built or installed
  bool dry_run = false;
};

int board_watch(const BoardOptions& options);
int board_log(const BoardOptions& options);
int board_optoforce(const BoardOptions& options);
int board_tare(const BoardOptions& options);
int board_calibrate_cell(const BoardOptions& options);

}  // namespace tagwrench

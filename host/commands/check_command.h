// `tagwrench check`: whether a calibrated sensor still measures what it did, found out where it
// stands.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/app/bench_input.h"
#include "host/app/board/run_board.h"
#include "host/commands/static_measurement.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

struct CheckOptions {
  std::string sensor;            ///< path
  std::string source;            ///< SRC
  int events = -1;               ///< descriptor, see Events
  std::optional<double> mass_g;  ///< to be hung
  double mass_sigma_percent = 0.5;
  std::vector<double> at_mm;  ///< where a load takes hold, platform frame
  double at_sigma_mm = 0.3;
  std::vector<double> gravity{0, 0, -1};  ///< along which masses pull, camera axes
  double direction_sigma_deg = 1;         ///< of gravity
  std::string board;                      ///< port of the board whose load cell tells the force
  std::string cells;                      ///< calibration of its load cells
  int channel = 0;
  std::vector<double> direction;  ///< of the force on the platform, camera axes
  std::string emulated_cell;      ///< pipe to the emulated board, for its cell; empty: none
};

/// Declares itself on the command line; must outlive the parsing.
class CheckCommand {
 public:
  explicit CheckCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// 0: all is fine; 1: something is not, or could not be told. Throws ConfigError if it cannot
  /// start.
  int run() const;

 private:
  void add_load_options();
  bool by_mass(BenchInput& at, const UniqueFd& stop, StaticMeasurement& static_measurement,
               Events& events) const;
  bool by_cell(BenchInput& at, const UniqueFd& stop, const RunBoard& board, Output& cell) const;

  command_line::Command verb_;
  CheckOptions options_;
};

}  // namespace tagwrench

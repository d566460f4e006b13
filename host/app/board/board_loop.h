// A command's loop around a board: signals, news to standard error, patience.
#pragma once

#include <array>
#include <string>

#include "host/board/board_link.h"
#include "host/board/cell_calibration.h"
#include "host/core/types.h"

namespace tagwrench {

inline TimePoint clock_now() { return std::chrono::steady_clock::now(); }

inline Duration in_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

/// Which board, and what it shall do.
struct BoardSetup {
  std::string port;        ///< path, usb:VID:PID[:SERIAL], or empty: the only one
  std::string cells_file;  ///< empty: by the board's id
  std::string cell_input = "a128";
  int cell_rate = 80;  ///< conversions/s
  int adc_rate = 0;    ///< samples/s of each channel; 0: off
};

/// Of the setup: a session's random numbers and the board's configuration.
link::BoardSessionOptions session_options(const BoardSetup& options);

class BoardLoop {
 public:
  /// Throws ConfigError, naming the `option` that chooses the port, if it cannot be opened.
  BoardLoop(const std::string& port, const link::BoardSessionOptions& options,
            const std::string& option = link::kPortOption);

  /// Until the board is ready (true) or a signal came (false). Throws ConfigError if no board of
  /// ours answers, or one of another version.
  bool connect();

  /// The same, and until the clock is known well and a status has come, or that has taken too long.
  bool settle();

  /// Waits for the link, another descriptor or `until`, and serves the link; false: a signal came.
  bool turn(TimePoint until, int other_fd = -1);

  link::BoardLink& link() { return link_; }
  link::BoardSession& session() { return link_.session(); }
  /// Of a load cell: its last fault, none since it spoke.
  link::FaultCode cell_fault(std::size_t channel) const { return cell_faults_[channel]; }
  void cell_spoke(std::size_t channel) { cell_faults_[channel] = link::FaultCode::none; }
  /// Faults of load cells are kept, not said: the caller has a word of his own for them.
  void keep_cell_faults_quiet() { cell_faults_quiet_ = true; }
  bool led_refused() const { return led_refused_; }

 private:
  link::BoardLink link_;
  UniqueFd stop_;
  std::array<link::FaultCode, link::kMaxChannels> cell_faults_{};
  bool cell_faults_quiet_ = false;
  bool led_refused_ = false;
  std::string refusal_;  ///< why a board of another version cannot be spoken to
};

/// Calibration file of the setup, or the one kept for this board; empty if it has no id.
std::string cells_path(const BoardSetup& options, const link::BoardSession& session);

/// Throws ConfigError if a calibration file was named and there is none.
void check_cells_file(const BoardSetup& options);

/// What cells_path() holds; without it none is calibrated. Throws ConfigError: it cannot be used.
link::CellCalibrations load_cells(const BoardSetup& options, const link::BoardSession& session);

}  // namespace tagwrench

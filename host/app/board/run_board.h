// The board of a run: found, its light settled, its load cells' calibration known.
#pragma once

#include <memory>
#include <string>

#include "host/app/board/board_loop.h"
#include "host/app/board/board_output.h"
#include "host/app/input.h"
#include "host/output/output.h"
#include "host/web/bridge/board_control.h"

namespace tagwrench {

class RunBoard final : public BoardControl {
 public:
  /// Waits for the board, some seconds at most. Throws ConfigError if there is no board of ours, or
  /// its load cells' file cannot be used.
  explicit RunBoard(const BoardSetup& setup);
  RunBoard(const RunBoard&) = delete;
  RunBoard& operator=(const RunBoard&) = delete;
  /// Turns the light off.
  ~RunBoard() override;

  /// False if a signal ended the waiting.
  bool connected() const { return connected_; }

  /// Lights the tags and sets exposure and gain, and says how. False if a signal came, or the
  /// source ended.
  bool settle_light(Input& input, const UniqueFd& stop);

  /// Serves the link from the run's loop; see BoardOutput. Must not outlive this.
  std::unique_ptr<Output> output(const SensorConfig& sensor, const std::string& path);

  /// What that output has found of the load cell in wrench.reference, as long as it is there.
  const ReferenceMonitor& monitor() const { return output_->monitor(); }

  /// What the board says goes there too, as long as that output is there. Borrowed.
  void record_to(record::RecordingWriter& writer);

 private:
  // BoardControl, of that output.
  BoardReading reading() const noexcept override;
  void set_led(double level) noexcept override;
  void set_led_as_settled() noexcept override;
  bool tare(std::size_t channel) noexcept override;

  void compare(BoardOutput& output, const SensorConfig& sensor) const;

  double rate_;  ///< conversions/s
  BoardLoop loop_;
  link::CellCalibrations cells_{};
  bool connected_ = false;
  double settled_permille_ = 0;
  double led_permille_ = 0;
  double exposure_us_ = 0;  ///< 0: not known
  BoardOutput* output_ = nullptr;
};

/// `port`: as BoardSetup has it, `auto` for the only one; null if it is empty.
std::unique_ptr<RunBoard> open_board(const std::string& port, const std::string& cells_file);

}  // namespace tagwrench

// The board of a run: found, its light settled, its load cells' calibration known; served, recorded
// and compared with beside the run.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "host/app/board/board_loop.h"
#include "host/app/input.h"
#include "host/board/board_link.h"
#include "host/board/board_session.h"
#include "host/board/cell_calibration.h"
#include "host/board/ring.h"
#include "host/calibration/check/in_situ.h"
#include "host/output/line_outputs.h"
#include "host/output/output.h"
#include "host/recording/writer.h"
#include "host/sensor/sensor_config.h"
#include "host/web/bridge/web_output.h"

namespace tagwrench {

// What a board says, as rows of a recording.

class BoardRecord {
 public:
  /// Borrows the writer.
  BoardRecord(record::RecordingWriter& writer, const link::CellCalibrations& cells)
      : writer_(writer), cells_(cells) {}

  void cell(const link::CellReading& reading) noexcept;
  void button(const link::ButtonReading& reading) noexcept {
    writer_.event(record::EventKind::button, reading.time.time, {}, reading.pressed ? 1 : 0,
                  reading.button);
  }
  void news(const link::BoardEvent& news) {
    writer_.event(record::EventKind::board, std::chrono::steady_clock::now(), link::text(news));
  }
  /// LED when it changes, clock once a second.
  void state(const link::BoardSession& session) noexcept;

 private:
  record::RecordingWriter& writer_;
  link::CellCalibrations cells_;
  int level_permille_ = -1;
  TimePoint next_clock_{};
};

// The board beside a run: its link is served from the run's loop, its LED stays lit, and, if asked
// for, every sample is written beside what the load cells felt at the very time of the frame.

/// A load cell that is there for good, and what the samples' frame makes of its line.
struct ReferenceComparison {
  ReferenceLine line;
  Matrix6 tool = Matrix6::Identity();  ///< wrench at the platform -> as samples have it
  Vector6 range = Vector6::Zero();     ///< as samples have it, N and N m; 0: not known
};

class BoardOutput final : public Output {
 public:
  /// Borrows the link. `path`: CSV file, `-` is standard output, empty for none: the columns of
  /// `csv`, then counts, newtons and their standard deviation of each load cell; a field is empty
  /// where samples are missing or the cell is not calibrated. The cells' time is the frame's less
  /// `camera_latency` (s), which the LED measures on the board's own clock: where that clock is off
  /// from the host's, both are alike. Throws ConfigError if the file cannot be written.
  BoardOutput(link::BoardLink& link, const link::CellCalibrations& cells, double cell_rate,
              double camera_latency, const std::string& path);
  ~BoardOutput() override { write_ripe(/*all=*/true); }

  /// Compares every sample with this cell from now on, and says once what is wrong of each kind.
  void compare(const ReferenceComparison& comparison) { comparison_ = comparison; }
  const ReferenceMonitor& monitor() const { return monitor_; }

  /// A row waits until the cells have spoken about its time, half a second at most.
  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return sink_ ? sink_->failure() : std::string(); }
  int poll_fd() const noexcept override { return link_.poll_fd(); }
  std::string_view service() noexcept override;
  std::uint32_t pressed() const noexcept override { return buttons_down_; }

  /// What a load cell feels now; nothing where it is not calibrated, or has not spoken yet.
  std::optional<link::Newtons> felt(std::size_t channel) const noexcept;
  /// From the next second's mean on it feels nothing. False: as above.
  bool tare(std::size_t channel) noexcept;

  /// From now on all that the board says is recorded as well. Borrowed.
  void record_to(record::RecordingWriter& writer) { record_.emplace(writer, cells_); }

 private:
  struct Row {
    Sample sample;
    TimePoint sent{};
  };
  using Line = std::array<char, 2048>;
  static constexpr std::size_t kMaxRows = 64;

  void take_readings() noexcept;
  void take_tares() noexcept;
  bool ripe(const Row& row, TimePoint now) const noexcept;
  void write_ripe(bool all) noexcept;
  std::string_view text(const Row& row) noexcept;
  void compare(const Row& row) noexcept;

  link::BoardLink& link_;
  link::CellCalibrations cells_;
  Duration latency_;
  std::array<link::SampleHistory, link::kMaxChannels> counts_;
  std::array<std::optional<std::int32_t>, link::kMaxChannels> last_counts_;
  std::uint32_t buttons_down_ = 0;  ///< bit 0 is the board's button 0
  std::optional<ReferenceComparison> comparison_;
  ReferenceMonitor monitor_;
  std::string found_;  ///< by it, and not said yet
  std::optional<TextSink> sink_;
  link::Ring<Row, kMaxRows> rows_;
  LineBuffer sample_line_{};
  Line line_{};
  bool header_written_ = false;
  std::optional<BoardRecord> record_;
  SendStatus status_ = SendStatus::ok;
  std::string said_;
};

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

  /// Lights the tags, sets exposure and gain, says how. False: a signal, or the end of the source.
  bool settle_light(Input& input, const UniqueFd& stop);

  /// Serves the link from the run's loop; see BoardOutput. Must not outlive this.
  std::unique_ptr<Output> output(const SensorConfig& sensor, const std::string& path);

  /// What that output has found of the load cell in wrench.reference, as long as it is there.
  const ReferenceMonitor& monitor() const { return output_->monitor(); }

  /// What the board says goes there too, as long as that output is there. Borrowed.
  void record_to(record::RecordingWriter& writer) {
    if (output_ != nullptr) output_->record_to(writer);
  }

 private:
  // BoardControl, of that output.
  BoardReading reading() const noexcept override;
  void set_led(double level) noexcept override;
  void set_led_as_settled() noexcept override { set_led(settled_permille_ / 1000); }
  bool tare(std::size_t channel) noexcept override {
    return output_ != nullptr && output_->tare(channel);
  }

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

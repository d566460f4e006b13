// The board beside a run: its link is served from the run's loop, its LED stays lit, and, if asked
// for, every sample is written beside what the load cells felt at the very time of the frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "host/app/board/board_record.h"
#include "host/board/board_link.h"
#include "host/board/cell_calibration.h"
#include "host/board/ring.h"
#include "host/board/sample_history.h"
#include "host/calibration/check/reference_monitor.h"
#include "host/output/output.h"
#include "host/output/sample_text.h"
#include "host/output/text_sink.h"
#include "host/sensor/reference_line.h"

namespace tagwrench {

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
  ~BoardOutput() override;

  /// Compares every sample with this cell from now on, and says once what is wrong of each kind.
  void compare(const ReferenceComparison& comparison) { comparison_ = comparison; }
  const ReferenceMonitor& monitor() const { return monitor_; }

  /// A row waits until the cells have spoken about its time, half a second at most.
  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override;
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
  ReferenceMonitor monitor_{{}};
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

}  // namespace tagwrench

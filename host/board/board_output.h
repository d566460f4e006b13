// The board beside a run: its link is served from the run's loop, its LED stays lit, and, if asked
// for, every sample is written beside what the load cells felt at the very time of the frame.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "host/link/board_link.h"
#include "host/link/cell_calibration.h"
#include "host/link/ring.h"
#include "host/link/sample_history.h"
#include "host/output/output.h"
#include "host/output/sample_text.h"
#include "host/output/text_sink.h"

namespace tagwrench {

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

  /// A row waits until the cells have spoken about its time, half a second at most.
  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override;
  int poll_fd() const noexcept override { return link_.poll_fd(); }
  std::string_view service() noexcept override;

 private:
  struct Row {
    Sample sample;
    std::int64_t latency_us = 0;
    TimePoint sent{};
  };
  using Line = std::array<char, 2048>;
  static constexpr std::size_t kMostRows = 64;

  void take_readings() noexcept;
  bool ripe(const Row& row, TimePoint now) const noexcept;
  void write_ripe(bool all) noexcept;
  std::string_view text(const Row& row) noexcept;

  link::BoardLink& link_;
  link::CellCalibrations cells_;
  Duration latency_;
  std::array<link::SampleHistory, link::kMostChannels> counts_;
  std::optional<TextSink> sink_;
  link::Ring<Row, kMostRows> rows_;
  LineBuffer sample_line_{};
  Line line_{};
  bool header_written_ = false;
  SendStatus status_ = SendStatus::ok;
  std::string said_;
};

}  // namespace tagwrench

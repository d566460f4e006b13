// What a board says, as rows of a recording.
#pragma once

#include "host/board/board_session.h"
#include "host/board/cell_calibration.h"
#include "host/recording/writer.h"

namespace tagwrench {

class BoardRecord {
 public:
  /// Borrows the writer.
  BoardRecord(record::RecordingWriter& writer, const link::CellCalibrations& cells)
      : writer_(writer), cells_(cells) {}

  void cell(const link::CellReading& reading) noexcept;
  void button(const link::ButtonReading& reading) noexcept;
  void news(const link::BoardEvent& news);
  /// LED when it changes, clock once a second.
  void state(const link::BoardSession& session) noexcept;

 private:
  record::RecordingWriter& writer_;
  link::CellCalibrations cells_;
  int level_permille_ = -1;
  TimePoint next_clock_{};
};

}  // namespace tagwrench

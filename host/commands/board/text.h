// Samples of a board as lines: CSV and JSON for programs, a line of all cells for people.
#pragma once

#include <array>
#include <string>

#include "host/app/board/board_loop.h"
#include "host/board/cell_calibration.h"

namespace tagwrench {

constexpr const char* kBoardCsvHeader =
    "kind,channel,t_ns,t_sigma_ns,counts,value,sigma,sequence,lost_before\n";

/// `calibration` says newtons, or nothing (then value and sigma are empty, null in JSON).
std::string csv_line(const link::CellReading& reading, const link::CellCalibration& calibration);
std::string csv_line(const link::AdcReading& reading);
std::string csv_line(const link::ButtonReading& reading);
std::string csv_line(const link::FaultReading& reading);
std::string json_line(const link::CellReading& reading, const link::CellCalibration& calibration);
std::string json_line(const link::AdcReading& reading);
std::string json_line(const link::ButtonReading& reading);
std::string json_line(const link::FaultReading& reading);

/// What people see: the latest of everything.
class BoardView {
 public:
  void take(const link::CellReading& reading);
  void take(const link::AdcReading& reading);
  void take(const link::ButtonReading& reading);

  /// One line; cells that have said nothing since `stale` are said to be so.
  std::string line(const link::CellCalibrations& calibrations, const BoardLoop& loop,
                   TimePoint stale) const;

 private:
  struct Cell {
    bool seen = false;
    link::CellReading reading;
    std::uint64_t lost = 0;
  };
  std::array<Cell, link::kMaxChannels> cells_;
  std::array<int, 8> adc_{-1, -1, -1, -1, -1, -1, -1, -1};
  std::array<bool, 8> button_seen_{};
  std::array<bool, 8> pressed_{};
  link::HostTime latest_;
};

}  // namespace tagwrench

// What is wired to a load-cell channel, as it is typed: `--cell N=WHAT`.
#pragma once

#include <optional>
#include <string>

namespace tagwrench {
namespace board {

enum class CellModel {
  constant,  ///< a force of `force_n`
  sine,      ///< a force that goes up and down
  none,      ///< nothing: its data line stays high
  stuck,     ///< its data line stays low
};

struct Cell {
  CellModel model = CellModel::constant;
  double force_n = 0;  ///< of a sine its amplitude
  double hz = 0;
};

struct CellOption {
  unsigned channel;
  Cell cell;
};

constexpr const char* kCellForms =
    "N=FORCE_N, N=sine[:AMPLITUDE_N:HZ], N=none or N=stuck, with N from 0 to 3";

/// `N=sine`: 2 N, slow, and on each channel at another frequency.
inline Cell slow_sine(unsigned channel) { return {CellModel::sine, 2, 0.1 * (1 + channel)}; }

/// Nothing if `text` has none of these forms.
std::optional<CellOption> parse_cell(const std::string& text);

}  // namespace board
}  // namespace tagwrench

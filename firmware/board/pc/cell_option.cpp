#include "firmware/board/pc/cell_option.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

namespace tagwrench {
namespace board {
namespace {

/// These take from the front of `text` what is there.
bool take(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

bool take_one_of(std::string_view& text, std::string_view characters) {
  if (text.empty() || characters.find(text[0]) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

std::size_t take_digits(std::string_view& text) {
  const std::size_t count = std::min(text.find_first_not_of("0123456789"), text.size());
  text.remove_prefix(count);
  return count;
}

/// Decimal: strtod() alone would take "inf", "0x1" and a number behind spaces, too.
std::optional<double> take_number(std::string_view& text) {
  std::string_view rest = text;
  take_one_of(rest, "+-");
  const std::size_t whole = take_digits(rest);
  const std::size_t behind_point = take(rest, ".") ? take_digits(rest) : 0;
  if (whole + behind_point == 0) return std::nullopt;
  std::string_view exponent = rest;
  if (take_one_of(exponent, "eE")) {
    take_one_of(exponent, "+-");
    if (take_digits(exponent) > 0) rest = exponent;
  }
  const std::string number(text.substr(0, text.size() - rest.size()));
  text = rest;
  return std::strtod(number.c_str(), nullptr);
}

std::optional<Cell> take_cell(std::string_view& text, unsigned channel) {
  if (take(text, "none")) return Cell{CellModel::none};
  if (take(text, "stuck")) return Cell{CellModel::stuck};
  if (!take(text, "sine")) {
    const std::optional<double> force_n = take_number(text);
    return force_n ? std::optional(Cell{CellModel::constant, *force_n, 0}) : std::nullopt;
  }
  if (!take(text, ":")) return slow_sine(channel);
  const std::optional<double> amplitude_n = take_number(text);
  if (!amplitude_n || !take(text, ":")) return std::nullopt;
  const std::optional<double> hz = take_number(text);
  return hz ? std::optional(Cell{CellModel::sine, *amplitude_n, *hz}) : std::nullopt;
}

}  // namespace

std::optional<CellOption> parse_cell(const std::string& text) {
  std::string_view rest = text;
  if (!take_one_of(rest, "0123") || !take(rest, "=")) return std::nullopt;
  const auto channel = static_cast<unsigned>(text[0] - '0');
  const std::optional<Cell> cell = take_cell(rest, channel);
  if (!cell || !rest.empty()) return std::nullopt;
  if (!std::isfinite(cell->force_n) || !std::isfinite(cell->hz)) return std::nullopt;
  return CellOption{channel, *cell};
}

}  // namespace board
}  // namespace tagwrench

#include "firmware/board/pc/cell_option.h"

#include <cmath>
#include <cstdlib>
#include <regex>

namespace tagwrench {
namespace board {

std::optional<CellOption> parse_cell(const std::string& text) {
  static const std::string number = R"(([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?))";
  static const std::regex form("([0-3])=(?:(none)|(stuck)|(sine)(?::" + number + ":" + number +
                               ")?|" + number + ")");
  std::smatch part;
  if (!std::regex_match(text, part, form)) return std::nullopt;
  const auto value = [&part](std::size_t i) { return std::strtod(part[i].str().c_str(), nullptr); };
  CellOption option{static_cast<unsigned>(part[1].str()[0] - '0'), {}};
  if (part[2].matched) {
    option.cell.model = CellModel::none;
  } else if (part[3].matched) {
    option.cell.model = CellModel::stuck;
  } else if (part[4].matched) {
    option.cell =
        part[5].matched ? Cell{CellModel::sine, value(5), value(6)} : slow_sine(option.channel);
  } else {
    option.cell = {CellModel::constant, value(7), 0};
  }
  if (!std::isfinite(option.cell.force_n) || !std::isfinite(option.cell.hz)) return std::nullopt;
  return option;
}

}  // namespace board
}  // namespace tagwrench

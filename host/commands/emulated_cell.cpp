#include "host/commands/emulated_cell.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr double kPointEvery = 0.004;  // s; a hand trembles at 12 Hz
constexpr double kMaxCatchUp = 1.0;    // s of the past that are told once

}  // namespace

EmulatedCell::EmulatedCell(const std::string& orders, int channel, const sim::Bench& bench,
                           TimePoint simulation_start)
    : orders_(::open(orders.c_str(), O_WRONLY | O_APPEND | O_NONBLOCK | O_CLOEXEC)),
      channel_(channel),
      bench_(bench),
      start_(simulation_start),
      told_to_(bench.newest()) {
  if (orders_) return;
  throw ConfigError(fmt::format(
      "--emulated-cell {}: {}; give the pipe (mkfifo) that the emulated board has as its standard "
      "input",
      orders, errno == ENXIO ? "nobody reads it" : std::strerror(errno)));
}

void EmulatedCell::follow() noexcept {
  // An order that is given later changes nothing before the reaction time is over.
  const double decided = bench_.newest() + bench_.settings().times.reaction;
  told_to_ = std::max(told_to_, decided - kMaxCatchUp);
  while (told_to_ + kPointEvery < decided) {
    told_to_ += kPointEvery;
    const auto at = start_.time_since_epoch() + Duration(std::llround(1e9 * told_to_));
    std::array<char, 80> line;
    const auto end = fmt::format_to_n(line.data(), line.size(), "cell {} at {} {:.6f}\n", channel_,
                                      at.count(), bench_.cell_force(told_to_));
    if (::write(orders_.get(), line.data(), std::min(end.size, line.size())) < 0) return;
  }
}

}  // namespace tagwrench

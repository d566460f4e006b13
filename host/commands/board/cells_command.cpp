// `tagwrench board tare` and `tagwrench board calibrate-cell`.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "host/app/board/board_loop.h"
#include "host/board/cell_calibration.h"
#include "host/commands/board/board.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/output/line_outputs.h"

namespace tagwrench {
namespace {

constexpr Duration kFirstConversion = std::chrono::milliseconds(1500);
/// Of a resting cell's noise, from end to end of a thousand conversions; the faster rate is noisier
/// than the one that the noise may be of.
constexpr double kMaxSpread = 15;
constexpr double kMinNoise_counts = 0.5;

/// Mean and scatter of a cell's next conversions.
struct Mean {
  int count = 0;
  double mean = 0;
  double squares = 0;  ///< about the mean (Welford)
  bool saturated = false;

  void add(double x) {
    ++count;
    const double before = x - mean;
    mean += before / count;
    squares += before * (x - mean);
  }
  double deviation() const { return count > 1 ? std::sqrt(squares / (count - 1)) : 0; }
};

Duration patience_for(int conversions, int rate) {
  return std::chrono::milliseconds(1500 * conversions / rate + 3000);
}

[[noreturn]] void no_conversions(const BoardLoop& loop, int channel) {
  const bool stuck =
      loop.cell_fault(static_cast<std::size_t>(channel)) == link::FaultCode::cell_stuck;
  throw ConfigError(link::text({link::BoardEvent::Kind::fault,
                                static_cast<std::uint32_t>(stuck ? link::FaultCode::cell_stuck
                                                                 : link::FaultCode::cell_silent),
                                static_cast<std::uint32_t>(channel)}));
}

void drop_samples(link::BoardSession& session) {
  for (link::CellReading old; session.next(old);) {
  }
}

/// Until all cells of the mask have converted; false: a signal. Throws ConfigError for a mute one.
bool wait_for_cells(BoardLoop& loop, unsigned mask) {
  const TimePoint end = clock_now() + kFirstConversion;
  for (;;) {
    for (link::CellReading r; loop.session().next(r);) {
      mask &= ~(1u << r.channel);
      loop.cell_spoke(r.channel);
    }
    if (mask == 0) return true;
    const bool late = clock_now() >= end;
    for (int i = 0; i < static_cast<int>(link::kMaxChannels); ++i) {
      const bool faulty = loop.cell_fault(static_cast<std::size_t>(i)) != link::FaultCode::none;
      if ((mask >> i & 1) != 0 && (late || faulty)) no_conversions(loop, i);
    }
    if (!loop.turn(end)) return false;
  }
}

/// Nothing if a signal came.
std::optional<Mean> measure(BoardLoop& loop, const BoardOptions& options) {
  Mean out;
  drop_samples(loop.session());
  const TimePoint end = clock_now() + patience_for(options.conversions, options.cell_rate);
  while (out.count < options.conversions) {
    if (!loop.turn(end)) return {};
    for (link::CellReading r; loop.session().next(r);) {
      if (r.channel != options.channel || out.count == options.conversions) continue;
      out.add(r.counts);
      out.saturated |= r.saturated;
    }
    if (clock_now() >= end) no_conversions(loop, options.channel);
  }
  return out;
}

/// One result for each cell of the mask; nothing if a signal came.
std::optional<std::vector<link::TareResult>> tare(BoardLoop& loop, const BoardOptions& options,
                                                  std::uint8_t mask) {
  loop.session().tare(mask, static_cast<std::uint16_t>(options.conversions));
  loop.link().send();
  std::vector<link::TareResult> out;
  const TimePoint end = clock_now() + patience_for(options.conversions, options.cell_rate);
  while (mask != 0) {
    if (clock_now() >= end) no_conversions(loop, std::countr_zero(mask));
    if (!loop.turn(end)) return {};
    for (link::TareResult result{}; loop.session().next(result);) {
      if (result.channel >= link::kMaxChannels || (mask >> result.channel & 1) == 0) continue;
      mask &= static_cast<std::uint8_t>(~(1u << result.channel));
      out.push_back(result);
    }
  }
  return out;
}

enum class Key { pressed, stopped, ended };

/// A line (or the end of a line) on standard input, while the board is kept company.
Key wait_for_key(BoardLoop& loop) {
  for (;;) {
    if (!loop.turn(clock_now() + std::chrono::hours(1), STDIN_FILENO)) return Key::stopped;
    drop_samples(loop.session());
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, 0) <= 0) continue;
    char key = 0;
    const ssize_t count = ::read(STDIN_FILENO, &key, 1);
    if (count <= 0) return Key::ended;
    if (key == '\n') return Key::pressed;
  }
}

void check_masses(const BoardOptions& options) {
  const auto [least, most] =
      std::minmax_element(options.masses_kg.begin(), options.masses_kg.end());
  if (*most - *least < 1e-6)
    throw ConfigError("--mass: all masses are the same: give at least two different ones");
}

std::string file_to_write(const BoardOptions& options, const link::BoardSession& session) {
  const std::string path = cells_path(options, session);
  if (path.empty())
    throw ConfigError("board: it has no id to keep a calibration by; give --cells FILE");
  return path;
}

int stopped_unchanged() {
  log_info("stopped; nothing was changed");
  return 0;
}

}  // namespace

int board_calibrate_cell(const BoardOptions& options) {
  check_masses(options);
  BoardLoop loop(options.port, session_options(options));
  loop.keep_cell_faults_quiet();
  if (!loop.settle() || !wait_for_cells(loop, 1u << options.channel)) return 0;
  const std::string path = file_to_write(options, loop.session());
  const std::string id = link::id_text(loop.session().hello().unique_id);
  link::CellCalibrations cells = load_cells(options, loop.session());

  std::vector<link::CellPoint> points;
  double variance = 0;
  for (const double mass : options.masses_kg) {
    log_info(mass == 0
                 ? fmt::format("take everything off load cell {}, let it come to rest, press Enter",
                               options.channel)
                 : fmt::format("put {:g} kg on load cell {}, let it come to rest, press Enter",
                               mass, options.channel));
    const Key key = wait_for_key(loop);
    if (key == Key::stopped) return stopped_unchanged();
    if (key == Key::ended)
      throw ConfigError(
          "calibrate-cell: standard input ended before {:g} kg; one line per mass is needed", mass);
    const auto mean = measure(loop, options);
    if (!mean) return stopped_unchanged();
    if (mean->saturated) {
      throw ConfigError(
          "calibrate-cell: load cell {} is at the end of its amplifier's range under {:g} kg; take "
          "a smaller mass, a smaller gain (--input a64), or check its wires",
          options.channel, mass);
    }
    log_info("{:g} kg: {:.1f} counts, each +- {:.1f}", mass, mean->mean, mean->deviation());
    points.push_back({mass, mean->mean, mean->deviation() / std::sqrt(mean->count)});
    variance += mean->deviation() * mean->deviation();
  }

  link::CellCalibration& cell = cells[static_cast<std::size_t>(options.channel)];
  cell = link::fit_cell(points, options.gravity);
  cell.noise_counts = std::sqrt(variance / static_cast<double>(points.size()));
  link::save_cells(path, id, cells);
  print_data(fmt::format(
      "cell {}: {:.6g} N per count +- {:.2g} %, zero at {:.1f} counts, noise {:.2g} N{}\nkept in "
      "{}\n",
      options.channel, cell.newtons_per_count,
      100 * std::abs(cell.newtons_per_count_sigma / cell.newtons_per_count), cell.zero_counts,
      std::abs(cell.noise_counts * cell.newtons_per_count),
      points.size() > 2 ? fmt::format(", {:.2g} N off the line", cell.residual_n) : "", path));
  return 0;
}

int board_tare(const BoardOptions& options) {
  check_cells_file(options);
  BoardLoop loop(options.port, session_options(options));
  loop.keep_cell_faults_quiet();
  if (!loop.settle()) return 0;
  const std::string path = file_to_write(options, loop.session());
  link::CellCalibrations cells = load_cells(options, loop.session());
  std::uint8_t mask = 0;
  std::string left_out;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (cells[i].calibrated)
      mask |= static_cast<std::uint8_t>(1u << i);
    else if (i < loop.session().capabilities().cells)
      left_out += fmt::format("{}{}", left_out.empty() ? "" : ", ", i);
  if (mask == 0) {
    throw ConfigError(
        "board tare: no load cell of this board is calibrated; run `tagwrench board "
        "calibrate-cell`");
  }
  if (!wait_for_cells(loop, mask)) return 0;
  const auto tared = tare(loop, options, mask);
  if (!tared) return stopped_unchanged();
  std::string report;
  for (const link::TareResult& result : *tared) {
    link::CellCalibration& cell = cells[result.channel];
    const double scale = std::abs(cell.newtons_per_count);
    if (result.spread_counts > kMaxSpread * std::max(cell.noise_counts, kMinNoise_counts)) {
      log_info(
          "load cell {} moved while it was tared ({:.2g} N from end to end); let it rest, then try "
          "again",
          result.channel, result.spread_counts * scale);
      return 1;
    }
    report += fmt::format("cell {}: zero moved by {:+.4f} N\n", result.channel,
                          (result.mean_counts - cell.zero_counts) * cell.newtons_per_count);
    cell.zero_counts = result.mean_counts;
    cell.zero_sigma_counts =
        std::hypot(cell.noise_counts / std::sqrt(std::max<double>(result.conversions, 1)), 0.3);
    cell.zero_scale_covariance_n = 0;  // measured apart from the scale
  }
  link::save_cells(path, link::id_text(loop.session().hello().unique_id), cells);
  if (!left_out.empty()) log_info("left out, not calibrated: load cell {}", left_out);
  print_data(fmt::format("{}kept in {}\n", report, path));
  return 0;
}

}  // namespace tagwrench

#include "host/commands/calibrate_wrench/references.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>

#include "host/app/board/board_loop.h"
#include "host/board/optoforce.h"
#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr double kPointEvery = 0.004;  // s; a hand trembles at 12 Hz
constexpr double kMaxCatchUp = 1.0;    // s of the past that are told once

constexpr double kStepSigma = 0.289;  // of one count: its uniform distribution, 1 / sqrt(12)

/// A load cell on the board; of an emulated one perhaps in the simulated hand.
class BoardCell final : public Reference {
 public:
  BoardCell(const ReferenceInstrumentOptions& options, int channel,
            const sim::Bench* bench = nullptr, TimePoint start = {})
      : options_{.port = options.board == "auto" ? "" : options.board, .cells_file = options.cells},
        loop_(options_.port, session_options(options_), "--board"),
        channel_(static_cast<std::size_t>(channel)) {
    check_cells_file(options_);
    if (!loop_.settle())
      throw ConfigError("stopped while waiting for the board; start again when it is plugged");
    cell_ = load_cells(options_, loop_.session())[channel_];
    if (!cell_.calibrated) {
      throw ConfigError(
          "{}: cell {} is not calibrated; run `tagwrench board calibrate-cell --channel {}`",
          loop_.link().port(), channel, channel);
    }
    if (bench != nullptr) hand_.emplace(options.emulated_cell, channel, *bench, start);
  }

  int poll_fd() const noexcept override {
    return const_cast<BoardLoop&>(loop_).link().poll_fd();  // NOLINT: it has no const access
  }
  void service() noexcept override {
    if (hand_) hand_->follow();
    loop_.turn(std::chrono::steady_clock::now());
  }
  bool next(ReferenceReading& reading) noexcept override {
    for (link::CellReading cell; loop_.session().next(cell);) {
      if (cell.channel != channel_) continue;
      reading = {};
      reading.axes = 1;
      reading.time = cell.time.time;
      reading.time_sigma = cell.time.sigma;
      reading.value[0] = cell_.newtons(cell.counts).value;
      reading.sigma[0] =
          std::hypot(cell_.noise_counts, kStepSigma) * std::abs(cell_.newtons_per_count);
      reading.saturated = cell.saturated;
      return true;
    }
    return false;
  }
  double gain_sigma() const noexcept override {
    return std::abs(cell_.newtons_per_count_sigma / cell_.newtons_per_count);
  }
  std::string description() const override {
    return fmt::format("load cell {} of the board{}", channel_,
                       hand_ ? ", emulated, in the simulated hand" : "");
  }
  std::string trouble() override { return {}; }  // the loop says its own

 private:
  BoardSetup options_;
  BoardLoop loop_;
  std::size_t channel_;
  link::CellCalibration cell_;
  std::optional<EmulatedCell> hand_;
};

class Optoforce final : public Reference {
 public:
  explicit Optoforce(const ReferenceInstrumentOptions& options)
      : port_(options.optoforce),
        counts_per_unit_(options.counts_per_unit),
        sensor_({.port = options.optoforce, .counts_per_unit = options.counts_per_unit}) {}

  int poll_fd() const noexcept override { return sensor_.poll_fd(); }
  void service() noexcept override { sensor_.service(); }
  bool next(ReferenceReading& reading) noexcept override {
    link::OptoforceReading said;
    if (!sensor_.next(said)) return false;
    reading = {};
    reading.axes = said.axes;
    reading.time = said.time.time;
    reading.time_sigma = said.time.sigma;
    reading.saturated = said.status != 0;
    for (std::size_t i = 0; i < 6; ++i) {
      reading.value[i] = said.values[i];
      reading.sigma[i] = std::hypot(1.0, kStepSigma) / counts_per_unit_[i];
    }
    return true;
  }
  std::string description() const override { return fmt::format("OptoForce sensor on {}", port_); }
  std::string trouble() override {
    if (sensor_.plugged() == plugged_) return {};
    plugged_ = sensor_.plugged();
    return port_ + (plugged_ ? ": the port is back" : ": the port is gone; plug it in again");
  }

 private:
  std::string port_;
  std::vector<double> counts_per_unit_;
  link::OptoforceSensor sensor_;
  bool plugged_ = true;
};

/// The bench's own instruments, on the frames' clock.
template <class Instrument>
class Simulated final : public Reference {
 public:
  Simulated(const sim::Bench& bench, TimePoint start, double gain_sigma, std::string description)
      : instrument_(bench),
        start_(start),
        gain_sigma_(gain_sigma),
        description_(std::move(description)) {}

  int poll_fd() const noexcept override { return -1; }
  void service() noexcept override {}
  bool next(ReferenceReading& reading) noexcept override {
    sim::SimulatedReading said;
    if (!instrument_.next(said)) return false;
    reading = {};
    reading.axes = said.axes;
    reading.time = start_ + in_seconds(said.time);
    reading.value = said.value;
    reading.sigma = said.sigma;
    reading.saturated = said.saturated;
    return true;
  }
  double gain_sigma() const noexcept override { return gain_sigma_; }
  std::string description() const override { return description_; }
  std::string trouble() override { return {}; }

 private:
  Instrument instrument_;
  TimePoint start_;
  double gain_sigma_;
  std::string description_;
};

std::unique_ptr<Reference> simulated(const WrenchPlan& plan,
                                     const ReferenceInstrumentOptions& options,
                                     const sim::Bench& bench, TimePoint start) {
  const bool cell = plan.reference == ReferenceKind::load_cell;
  if (cell && !options.board.empty() && !options.emulated_cell.empty())
    return std::make_unique<BoardCell>(options, plan.cell_channel, &bench, start);
  if (!options.board.empty() || !options.optoforce.empty()) {
    throw ConfigError(
        "--board, --optoforce: the simulated sensor has simulated instruments; leave these out, or "
        "give a camera as --source, or for an emulated board --emulated-cell");
  }
  const sim::BenchSettings& settings = bench.settings();
  if (cell) {
    const bool ideal = settings.perfect || settings.load_cell.ideal;
    return std::make_unique<Simulated<sim::SimulatedLoadCell>>(
        bench, start, ideal ? 0 : settings.load_cell.scale_error, "simulated load cell");
  }
  return std::make_unique<Simulated<sim::SimulatedSixAxis>>(bench, start, 0,
                                                            "simulated six-axis sensor");
}

}  // namespace

EmulatedCell::EmulatedCell(const std::string& orders, int channel, const sim::Bench& bench,
                           TimePoint simulation_start)
    : orders_(::open(orders.c_str(), O_WRONLY | O_APPEND | O_NONBLOCK | O_CLOEXEC)),
      channel_(channel),
      bench_(bench),
      start_(simulation_start),
      told_to_(bench.newest()) {
  if (orders_) return;
  throw ConfigError(
      "--emulated-cell {}: {}; give the pipe (mkfifo) that the emulated board has as its standard "
      "input",
      orders, errno == ENXIO ? "nobody reads it" : std::strerror(errno));
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

std::unique_ptr<Reference> open_reference(const WrenchPlan& plan,
                                          const ReferenceInstrumentOptions& options,
                                          const sim::Bench* bench, TimePoint simulation_start) {
  if (plan.reference == ReferenceKind::masses) return nullptr;
  if (bench != nullptr) return simulated(plan, options, *bench, simulation_start);
  if (plan.reference == ReferenceKind::load_cell) {
    if (options.board.empty()) {
      throw ConfigError("--plan {}: needs a load cell; give its board with --board PORT",
                        plan.name);
    }
    return std::make_unique<BoardCell>(options, plan.cell_channel);
  }
  if (options.optoforce.empty()) {
    throw ConfigError("--plan {}: needs a six-axis reference; give its port with --optoforce PORT",
                      plan.name);
  }
  if (options.counts_per_unit.size() != 6) {
    throw ConfigError(
        "--counts-per-unit: needs six numbers from the sensor's data sheet: counts per N of Fx Fy "
        "Fz, per N m of Tx Ty Tz");
  }
  return std::make_unique<Optoforce>(options);
}

}  // namespace tagwrench

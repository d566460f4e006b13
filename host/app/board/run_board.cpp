#include "host/app/board/run_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/app/board/board_output.h"
#include "host/board/cell_calibration.h"
#include "host/calibration/light/settle.h"
#include "host/core/log.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr double kUnseenLevel_permille = 100;

class SteadyLamp final : public Lamp {
 public:
  explicit SteadyLamp(link::BoardLink& link) : link_(link) {}

  void set_level(double permille) noexcept override {
    link::Led led{};
    led.level_permille = static_cast<std::uint16_t>(std::lround(std::clamp(permille, 0.0, 1000.0)));
    led.mode = led.level_permille > 0 ? link::LedMode::steady : link::LedMode::off;
    link_.session().set_led(led);
    link_.send();
  }

  /// From two of its steps, so that a small change is one, up to what it may have for ever.
  LightRange range_permille() const noexcept override {
    const link::Capabilities& can = link_.session().capabilities();
    const double most = std::clamp<double>(can.led_sustained_permille, 1, 1000);
    const double steps = std::max<double>(can.led_levels, 2);
    return {std::min(most, 2000.0 / steps), most};
  }

  int poll_fd() const noexcept override { return link_.poll_fd(); }
  void service() noexcept override { link_.service(); }

 private:
  link::BoardLink& link_;
};

}  // namespace

RunBoard::RunBoard(const BoardSetup& setup)
    : rate_(setup.cell_rate), loop_(setup.port, session_options(setup), "--board") {
  check_cells_file(setup);
  connected_ = loop_.settle();
  if (!connected_) return;
  cells_ = load_cells(setup, loop_.session());
}

RunBoard::~RunBoard() { SteadyLamp(loop_.link()).set_level(0); }

bool RunBoard::settle_light(Input& input, const UniqueFd& stop) {
  SteadyLamp lamp(loop_.link());
  if (input.kind != SourceKind::camera) {
    lamp.set_level(kUnseenLevel_permille);
    settled_permille_ = led_permille_ = kUnseenLevel_permille;
    log_info(fmt::format("the board's LED is on at {:.0f} %, but does not light this source",
                         kUnseenLevel_permille / 10));
    return true;
  }
  Acquirer finder(input.sensor.camera, input.sensor.target);
  const LightReport report =
      tagwrench::settle_light(*input.source, finder, input.sensor.camera.mirrored, lamp, stop);
  settled_permille_ = led_permille_ = report.setting.led_permille;
  exposure_us_ = report.setting.exposure_us;
  if (!report.stopped) log_info(light_text(report));
  return !report.stopped;
}

std::unique_ptr<Output> RunBoard::output(const SensorConfig& sensor, const std::string& path) {
  const bool newtons = std::any_of(cells_.begin(), cells_.end(),
                                   [](const link::CellCalibration& c) { return c.calibrated; });
  if (!path.empty() && !newtons) {
    log_info(
        "the load cells are not calibrated: the reference has counts alone; `tagwrench board "
        "calibrate-cell` makes newtons of them");
  }
  auto output =
      std::make_unique<BoardOutput>(loop_.link(), cells_, rate_, sensor.camera_latency, path);
  output_ = output.get();
  if (sensor.reference) compare(*output, sensor);
  return output;
}

void RunBoard::compare(BoardOutput& output, const SensorConfig& sensor) const {
  const ReferenceLine& line = *sensor.reference;
  if (!cells_[static_cast<std::size_t>(line.channel)].calibrated) {
    log_info(fmt::format(
        "wrench.reference: load cell {} is not calibrated, so nothing is compared with it; run "
        "`tagwrench board calibrate-cell`",
        line.channel));
    return;
  }
  const WrenchEstimator wrench(sensor.wrench);
  output.compare({line, wrench.tool(), range_through(wrench.tool(), sensor.wrench.range)});
  log_info(fmt::format("every sample is compared with load cell {}", line.channel));
}

BoardReading RunBoard::reading() const noexcept {
  BoardReading reading;
  reading.led = led_permille_ / 1000;
  reading.exposure_us = exposure_us_;
  for (std::size_t i = 0; output_ != nullptr && i < reading.cells.size(); ++i) {
    if (const std::optional<link::Newtons> felt = output_->felt(i))
      reading.cells[i] = {true, felt->value, felt->sigma};
  }
  return reading;
}

void RunBoard::set_led(double level) noexcept {
  SteadyLamp lamp(loop_.link());
  led_permille_ = std::min(1000 * level, lamp.range_permille().most);
  lamp.set_level(led_permille_);
}

void RunBoard::set_led_as_settled() noexcept { set_led(settled_permille_ / 1000); }

bool RunBoard::tare(std::size_t channel) noexcept {
  return output_ != nullptr && output_->tare(channel);
}

void RunBoard::record_to(record::RecordingWriter& writer) {
  if (output_ != nullptr) output_->record_to(writer);
}

std::unique_ptr<RunBoard> open_board(const std::string& port, const std::string& cells_file) {
  if (port.empty()) return nullptr;
  BoardSetup setup;
  setup.port = port == "auto" ? "" : port;
  setup.cells_file = cells_file;
  return std::make_unique<RunBoard>(setup);
}

}  // namespace tagwrench

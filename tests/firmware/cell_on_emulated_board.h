// The load cell in the simulated person's hand, on the emulated board: bridge, amplifier, flashed
// image, serial frames, session, newtons at host times.
#pragma once

#include <string>

#include "host/board/cell_calibration.h"
#include "host/calibration/wrench/record.h"
#include "host/source/simulator/bench.h"
#include "tests/firmware/lockstep_camera.h"

namespace tagwrench::emulator {

class CellOnEmulatedBoard final : public Reference {
 public:
  static constexpr double kCountsPerNewton = 200'000;
  static constexpr double kOffset = 31'000;  ///< counts
  static constexpr double kNoise = 60;       ///< counts

  /// Borrows both. Takes every load-cell reading of the host's session.
  CellOnEmulatedBoard(LockstepHost& host, const sim::Bench& bench, unsigned channel)
      : host_(host), channel_(channel) {
    Hx711::Bridge& bridge = host.board().cell(channel).bridge();
    bridge.counts_per_newton = kCountsPerNewton;
    bridge.offset_counts = kOffset;
    bridge.noise_counts = kNoise;
    bridge.force = [this, &bench](VirtualTime time) {
      const double t = std::chrono::duration<double>(time - kSimulationStart).count();
      return weight_ + (t < 0 ? 0.0 : bench.cell_force(t));
    };
  }

  /// As the owner does it beforehand: nothing on it, then 100 g, `each` long.
  void calibrate(VirtualTime each) {
    const link::CellPoint free = weigh(0, each);
    calibration_ = link::fit_cell({free, weigh(0.1, each)});
    calibration_.noise_counts = noise_;
    weight_ = 0;
  }
  const link::CellCalibration& calibration() const { return calibration_; }

  int poll_fd() const noexcept override { return -1; }
  void service() noexcept override {}
  bool next(ReferenceReading& reading) noexcept override {
    for (link::CellReading cell; host_.session().next(cell);) {
      if (cell.channel != channel_) continue;
      reading = {};
      reading.time = cell.time.time;
      reading.time_sigma = cell.time.sigma;
      reading.value[0] = calibration_.newtons(cell.counts).value;
      reading.sigma[0] = calibration_.noise_counts * calibration_.newtons_per_count;
      reading.axes = 1;
      reading.saturated = cell.saturated;
      return true;
    }
    return false;
  }
  double gain_sigma() const noexcept override {
    return calibration_.newtons_per_count_sigma / calibration_.newtons_per_count;
  }
  std::string description() const override { return "load cell on the emulated board"; }
  std::string trouble() override { return {}; }

 private:
  link::CellPoint weigh(double mass_kg, VirtualTime each) {
    constexpr VirtualTime kSettle = std::chrono::milliseconds(100);
    weight_ = mass_kg * link::kStandardGravity;
    host_.run_until(host_.board().now() + kSettle);
    for (link::CellReading cell; host_.session().next(cell);) {
    }
    host_.run_until(host_.board().now() + each);
    double count = 0, sum = 0, squares = 0;
    for (link::CellReading cell; host_.session().next(cell);) {
      if (cell.channel != channel_) continue;
      ++count;
      sum += cell.counts;
      squares += static_cast<double>(cell.counts) * cell.counts;
    }
    const double mean = sum / count;
    noise_ = std::sqrt(squares / count - mean * mean);
    return {mass_kg, mean, noise_ / std::sqrt(count - 1)};
  }

  LockstepHost& host_;
  unsigned channel_;
  double noise_ = 0;   ///< counts
  double weight_ = 0;  ///< N, of what the owner put on it
  link::CellCalibration calibration_;
};

}  // namespace tagwrench::emulator

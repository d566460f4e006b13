// The simulated camera before the emulated board, on one virtual clock.
#pragma once

#include <cmath>

#include "host/source/simulator/simulator_source.h"
#include "tests/firmware/lockstep_host.h"

namespace tagwrench::emulator {

/// Virtual time at which simulation time is 0: by then the board is known.
inline constexpr VirtualTime kSimulationStart = std::chrono::seconds(4);

inline VirtualTime virtual_time(double simulation_seconds) {
  return kSimulationStart + VirtualTime(std::llround(1e9 * simulation_seconds));
}

/// The board's LED, as the simulated camera sees it; runs the board as far as a picture needs it.
class BoardLight final : public sim::LedLight {
 public:
  explicit BoardLight(LockstepHost& host) : host_(host) {}
  double mean(double from, double to) noexcept override {
    host_.run_until(virtual_time(to));
    return host_.board().led().mean(virtual_time(from), virtual_time(to));
  }

 private:
  LockstepHost& host_;
};

/// The simulated camera on the board's virtual clock: a frame is delivered when its stamp says.
class LockstepCamera final : public FrameSource {
 public:
  /// `load`: as SimulatorSource's.
  LockstepCamera(const sim::Scenario& scenario, LockstepHost& host,
                 sim::AppliedLoad* load = nullptr)
      : host_(host), light_(host), camera_(scenario, /*live=*/false, &light_, load) {}
  const SourceFormat& format() const noexcept override { return camera_.format(); }
  int poll_fd() const noexcept override { return -1; }
  CameraLight* camera_light() noexcept override { return camera_.camera_light(); }
  ReadStatus read(Frame& frame) noexcept override {
    const ReadStatus status = camera_.read(frame);
    frame.capture_time += kSimulationStart;
    host_.run_until(frame.capture_time.time_since_epoch());
    stale += camera_.truth().stale ? 1 : 0;
    return status;
  }
  const sim::Truth& truth() const { return camera_.truth(); }
  int stale = 0;

 private:
  LockstepHost& host_;
  BoardLight light_;
  SimulatorSource camera_;
};

}  // namespace tagwrench::emulator

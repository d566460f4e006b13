// The simulated sensor as a frame source.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "host/os/unique_fd.h"
#include "host/source/frame_source.h"
#include "host/source/simulator/image_file.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/renderer.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// What the latest frame shows, exactly. All at the middle of the exposure of the image's middle
/// row, which is also the frame's capture time.
struct Truth {
  std::uint64_t sequence = 0;
  Duration time{};                         ///< since the simulation began
  Vector6 displacement = Vector6::Zero();  ///< of the platform from rest, m and rad
  Vector6 exposed_displacement =
      Vector6::Zero();  ///< mean of displacement over that exposure, which is what the picture
                        ///< shows; a ringing platform may be 20 um away from it in the middle
  Vector6 wrench = Vector6::Zero();  ///< that the user applies to the platform, N and N m
  RigidPose camera_T_platform;       ///< at that instant
  Eigen::Vector3d rest_position =
      Eigen::Vector3d::Zero();  ///< of the platform in the camera frame, m
  std::vector<PlacedTag> tags;  ///< as glued
  std::uint32_t disturbances =
      0;                        ///< bit() of each DisturbanceKind that is there; the motion is none
  std::vector<double> visible;  ///< per tag, share of the black square that can be seen, 0..1
  double smear_px = 0;          ///< way of a tag's centre in the image during the exposure
};

}  // namespace tagwrench::sim

namespace tagwrench {

/// Two clocks. Live: a timer ticks at the frame rate, each picture shows the platform as of the
/// tick, and ticks that passed while nobody read are dropped and counted. Not live: a virtual
/// clock, every read() gives the next frame, as fast as it can be rendered. Both go on for ever.
/// Frames that the scenario loses are skipped and counted on either clock.
class SimulatorSource final : public FrameSource {
 public:
  /// Throws ConfigError if the scenario cannot be simulated.
  SimulatorSource(const sim::Scenario& scenario, bool live);

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_ ? timer_.get() : -1; }
  ReadStatus read(Frame& frame) noexcept override;

  const sim::Truth& truth() const noexcept { return truth_; }

 private:
  void render(std::uint64_t sequence) noexcept;

  sim::Scenario scenario_;
  SourceFormat format_;
  UniqueFd timer_;  ///< none on the virtual clock
  TimePoint start_{};
  std::uint64_t next_sequence_ = 0;
  std::uint32_t lost_ = 0;  ///< frames since the last one that was delivered
  sim::DisturbancePlayer disturbances_;
  sim::TrajectoryPlayer player_;
  sim::Renderer renderer_;
  sim::PlatformMotion motion_;
  sim::JpegRoundTrip jpeg_;
  std::vector<std::uint8_t> pixels_;
  sim::Truth truth_;
};

}  // namespace tagwrench

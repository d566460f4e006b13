// The simulated sensor as a frame source; and a scenario as a folder: pictures, their times, the
// truth, and the sensor file that its user would have.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/source/frame_source.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/processor.h"
#include "host/source/simulator/renderer.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// What the latest frame shows, exactly. All at the middle of the exposure of the image's middle
/// row, which is also the frame's capture time but for what the scenario's delivery adds to that.
struct Truth {
  std::uint64_t sequence = 0;
  Duration time{};                         ///< since the simulation began
  bool stale = false;                      ///< shows the picture before it, and so does the rest
  Vector6 displacement = Vector6::Zero();  ///< of the platform from rest, as it looks, m and rad
  Vector6 exposed_displacement =
      Vector6::Zero();  ///< mean of displacement over that exposure, which is what the picture
                        ///< shows; a ringing platform may be 20 um away from it in the middle
  Vector6 wrench = Vector6::Zero();        ///< that the user applies to the platform, N and N m
  RigidPose camera_T_platform;             ///< at that instant
  Eigen::Vector3d rest_position{0, 0, 0};  ///< of the platform in the camera frame, m
  std::vector<PlacedTag> tags;             ///< as glued, or where they have slipped to
  std::uint32_t disturbances =
      0;                        ///< bit() of each DisturbanceKind that is there; the motion is none
  std::vector<double> visible;  ///< per tag, share of the black square that can be seen, 0..1
  double smear_px = 0;          ///< way of a tag's centre in the image during the exposure
};

/// Encodes and decodes a picture in place, as a camera with JPEG output and its driver do. Quality
/// 0 does nothing. Throws std::runtime_error if memory is short.
class JpegRoundTrip {
 public:
  JpegRoundTrip(int width, int height, int quality);
  void apply(std::uint8_t* pixels) noexcept;

 private:
  using Coder = std::unique_ptr<void, int (*)(void*)>;
  int width_, height_, quality_;
  Coder encoder_, decoder_;
  std::vector<std::uint8_t> encoded_;
};

/// sensor.yaml as the owner of this sensor would write it: camera calibration, family, ids and
/// nominal springs. Where the tags were glued stays unknown to it.
std::string sensor_yaml(const Scenario& scenario);

/// Writes 000000.png (or .pgm, .jpg) ..., frames.csv, sensor.yaml and truth.csv into `dir`, all or
/// nothing: they appear when the last one is written. An earlier export in `dir` is replaced; any
/// other content is left alone and refused. Throws ConfigError if the scenario or the folder cannot
/// be used, std::runtime_error if writing fails (disk full).
void export_folder(const Scenario& scenario, const std::filesystem::path& dir, int frames);

}  // namespace tagwrench::sim

namespace tagwrench {

/// Two clocks. Live: a timer ticks when a frame is delivered, each picture shows the platform as of
/// its exposure, and frames that passed while nobody read are dropped and counted. Not live: a
/// virtual clock, every read() gives the next frame, as fast as it can be rendered. Both go on for
/// ever. Frames that the scenario loses are skipped and counted on either clock.
class SimulatorSource final : public FrameSource, private CameraLight {
 public:
  static constexpr double kMaxGain = 8;

  /// Throws ConfigError if the scenario cannot be simulated. `led`, borrowed, lights the scene in
  /// place of the scenario's even light, `load`, borrowed, loads the platform in place of the
  /// scenario's trajectory, if there is one; somebody at the desk is such a load too.
  SimulatorSource(const sim::Scenario& scenario, bool live, sim::LedLight* led = nullptr,
                  sim::AppliedLoad* load = nullptr);

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_ ? timer_.get() : -1; }
  ReadStatus read(Frame& frame) noexcept override;
  /// The rendered picture; the scenario's JPEG, if it asks for one, is gone through already.
  RawFrame raw() const noexcept override { return {fourcc("GREY"), pixels_, format_.width}; }
  CameraLight* camera_light() noexcept override { return this; }

  const sim::Truth& truth() const noexcept { return truth_; }
  /// The instant, on the clock of Frame::capture_time, at which simulation time is 0.
  TimePoint time_zero() const noexcept { return start_; }

 private:
  Range exposure_range_us() const noexcept override;
  double exposure_us() const noexcept override { return renderer_.exposure() * 1e6; }
  bool set_exposure_us(double exposure_us) noexcept override;
  Range gain_range() const noexcept override { return {1, kMaxGain}; }
  double gain() const noexcept override { return renderer_.sensor_gain(); }
  bool set_gain(double gain) noexcept override;

  TimePoint delivery_time(std::uint64_t sequence) const noexcept;
  std::uint64_t newest_delivered(TimePoint now) const noexcept;
  bool stale(std::uint64_t sequence) const noexcept;
  void render(std::uint64_t sequence) noexcept;

  sim::Scenario scenario_;
  SourceFormat format_;
  Duration period_{};  ///< between exposures
  UniqueFd timer_;     ///< none on the virtual clock
  TimePoint start_{};
  std::uint64_t next_sequence_ = 0;
  std::uint32_t lost_ = 0;  ///< frames since the last one that was delivered
  sim::DisturbancePlayer disturbances_;
  std::unique_ptr<sim::AppliedLoad> desk_;  ///< the scenario's own
  sim::AppliedLoad* load_;
  sim::Renderer renderer_;
  sim::PlatformMotion motion_;
  sim::Processor processor_;
  sim::JpegRoundTrip jpeg_;
  std::vector<std::uint8_t> pixels_;
  bool rendered_ = false;  ///< pixels_ hold a picture
  sim::Truth truth_;
};

}  // namespace tagwrench

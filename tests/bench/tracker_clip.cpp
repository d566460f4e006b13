#include "tests/bench/tracker_clip.h"

#include <algorithm>
#include <cmath>

#include "host/source/simulator/simulator_source.h"

namespace tagwrench::bench {
namespace {

constexpr int kTravelFrames = 15;  // between two fixed poses

class MovingShots final : public ShotSource {
 public:
  MovingShots(const sim::Scenario& scenario, int moving_frames)
      : source_(scenario, /*live=*/false),
        first_moving_(static_cast<std::uint64_t>(
            std::ceil(scenario.trajectory.rest_time * scenario.camera.frame_rate))),
        end_(first_moving_ + static_cast<std::uint64_t>(moving_frames)) {}

  bool next(Shot& shot) override {
    Frame frame;
    if (next_ == end_ || source_.read(frame) != ReadStatus::frame) return false;
    const ImageView& image = frame.image;
    shot.width = image.width;
    shot.height = image.height;
    shot.pixels.assign(image.pixels,
                       image.pixels + static_cast<std::size_t>(image.height) * image.stride);
    shot.sequence = frame.sequence;
    shot.time = frame.capture_time;
    shot.phase = next_ < kRestFrames     ? Phase::rest
                 : next_ < first_moving_ ? Phase::travel
                                         : Phase::moving;
    shot.truth = source_.truth().displacement;
    ++next_;
    return true;
  }

 private:
  SimulatorSource source_;
  std::uint64_t next_ = 0, first_moving_, end_;
};

class HeldShots final : public ShotSource {
 public:
  HeldShots(const sim::Scenario& scenario, const std::vector<Vector6>& displacements,
            int frames_each, std::uint64_t first_noise)
      : scenario_(scenario),
        displacements_(displacements),
        frames_each_(frames_each),
        first_noise_(first_noise),
        player_(scenario.trajectory, scenario.seed),
        renderer_(scenario),
        motion_(scenario.mechanics, player_, 0, 2 * renderer_.half_window() + 0.01),
        jpeg_(scenario.camera.width_px, scenario.camera.height_px,
              scenario.compression.jpeg_quality) {}

  bool next(Shot& shot) override {
    const int each = kTravelFrames + frames_each_;
    const int after_rest = next_ - kRestFrames;
    const int pose = after_rest < 0 ? 0 : after_rest / each;
    if (pose >= static_cast<int>(displacements_.size())) return false;
    const int within = after_rest < 0 ? 0 : after_rest % each;
    shot.phase = after_rest < 0           ? Phase::rest
                 : within < kTravelFrames ? Phase::travel
                                          : Phase::held;
    shot.pose = pose;
    shot.truth = Vector6::Zero();
    if (after_rest >= 0) {
      const Vector6 from = pose == 0 ? Vector6::Zero() : displacements_[pose - 1];
      const double share = std::min(1.0, (within + 1.0) / kTravelFrames);
      const double smooth = share * share * (3 - 2 * share);
      shot.truth = from + smooth * (displacements_[pose] - from);
    }
    shot.width = scenario_.camera.width_px;
    shot.height = scenario_.camera.height_px;
    shot.pixels.resize(static_cast<std::size_t>(shot.width) * shot.height);
    shot.sequence = static_cast<std::uint64_t>(next_);
    const double time = next_ / scenario_.camera.frame_rate;
    shot.time = TimePoint(Duration(std::llround(1e9 * time)));
    motion_.set_state({shot.truth, Vector6::Zero()});
    renderer_.render(motion_, 0, first_noise_ + shot.sequence, shot.pixels.data());
    jpeg_.apply(shot.pixels.data());
    ++next_;
    return true;
  }

 private:
  sim::Scenario scenario_;
  std::vector<Vector6> displacements_;
  int frames_each_;
  std::uint64_t first_noise_;
  int next_ = 0;
  sim::TrajectoryPlayer player_;
  sim::Renderer renderer_;
  sim::PlatformMotion motion_;
  sim::JpegRoundTrip jpeg_;
};

}  // namespace

std::unique_ptr<ShotSource> moving_shots(const sim::Scenario& scenario, int moving_frames) {
  return std::make_unique<MovingShots>(scenario, moving_frames);
}

std::unique_ptr<ShotSource> held_shots(const sim::Scenario& scenario,
                                       const std::vector<Vector6>& displacements, int frames_each,
                                       std::uint64_t first_noise) {
  return std::make_unique<HeldShots>(scenario, displacements, frames_each, first_noise);
}

}  // namespace tagwrench::bench

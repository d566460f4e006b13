#include <cmath>

#include "tests/bench/tracker_case.h"
#include "tests/support/semi_real.h"

namespace tagwrench::bench {
namespace {

class SemiRealShots final : public ShotSource {
 public:
  SemiRealShots(std::shared_ptr<const test::SemiReal> renderer, double frame_rate, int frames)
      : renderer_(std::move(renderer)), frame_rate_(frame_rate), frames_(frames) {}

  bool next(Shot& shot) override {
    if (next_ == frames_) return false;
    shot.truth = renderer_->displacement(next_);
    shot.sequence = static_cast<std::uint64_t>(next_);
    const cv::Mat picture = renderer_->picture(shot.truth, shot.sequence);
    shot.width = picture.cols;
    shot.height = picture.rows;
    shot.pixels.assign(picture.begin<std::uint8_t>(), picture.end<std::uint8_t>());
    shot.time = TimePoint(Duration(std::llround(1e9 * next_ / frame_rate_)));
    shot.phase = next_ < kRestFrames ? Phase::rest : Phase::moving;
    ++next_;
    return true;
  }

 private:
  std::shared_ptr<const test::SemiReal> renderer_;
  double frame_rate_;
  int frames_;
  int next_ = 0;
};

}  // namespace

std::optional<Clip> semi_real_clip(int moving_frames) {
  const auto picture = test::real_picture();
  if (!picture) return std::nullopt;
  const test::SemiRealOptions options;
  const auto renderer = std::make_shared<const test::SemiReal>(*picture, options);
  Clip clip;
  clip.sensor = parse_sensor(renderer->sensor_yaml(false), "the semi-real sensor");
  clip.known = parse_sensor(renderer->sensor_yaml(true), "the semi-real sensor");
  clip.open = [=] {
    return std::make_unique<SemiRealShots>(renderer, options.frame_rate,
                                           kRestFrames + moving_frames);
  };
  return clip;
}

}  // namespace tagwrench::bench

#include "host/calibration/light/settle.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>

namespace tagwrench {
namespace {

// A setting shows in the picture after next: one is being exposed, one may wait in the driver. One
// more for the LED's command.
constexpr int kFramesUntilSeen = 4;
constexpr int kMaxPictures = 24;
constexpr Duration kPatience = std::chrono::seconds(3);  // for one frame
constexpr double kMaxGain = 16;  // of a camera whose gain has no unit: as if its range were 1..16
constexpr double kMuchAmbient = 0.3;

/// The camera's own gain for one of 1..kMaxGain.
double raw_gain(const CameraLight::Range& range, double gain) {
  return range.least + (gain - 1) / (kMaxGain - 1) * (range.most - range.least);
}

class Settling {
 public:
  Settling(FrameSource& source, Acquirer& finder, bool mirrored, Lamp& lamp, const UniqueFd& stop)
      : source_(source), finder_(finder), mirrored_(mirrored), lamp_(lamp), stop_(stop) {}

  LightReport run() {
    LightControl control(limits());
    for (int pictures = 0; pictures < kMaxPictures; ++pictures) {
      apply(control.setting());
      if (!look()) break;
      tags_ = finder_.find(frame_.image).tags;
      const LightReading reading = read_light(frame_.image, mirrored_, tags_);
      report_.white_counts = reading.white_counts;
      report_.setting = control.setting();
      report_.state = control.take(reading);
      if (report_.state != LightControl::State::settling) break;
    }
    report_.tags_found = static_cast<int>(tags_.size());
    if (!report_.stopped) measure_ambient();
    return report_;
  }

 private:
  LightLimits limits() const {
    LightLimits limits;
    limits.led_permille = lamp_.range_permille();
    limits.exposure_us = {1, 1};
    limits.gain = {1, 1};
    if (const CameraLight* camera = source_.camera_light(); camera != nullptr) {
      const CameraLight::Range exposure = camera->exposure_range_us();
      limits.exposure_us = {exposure.least, exposure.most};
      if (exposure.most <= exposure.least)
        limits.exposure_us = {camera->exposure_us(), camera->exposure_us()};
      const CameraLight::Range gain = camera->gain_range();
      if (gain.most > gain.least) limits.gain = {1, kMaxGain};
    }
    return limits;
  }

  void apply(const LightSetting& setting) {
    lamp_.set_level(setting.led_permille);
    CameraLight* camera = source_.camera_light();
    if (camera == nullptr) return;
    const CameraLight::Range exposure = camera->exposure_range_us();
    if (exposure.most > exposure.least) camera->set_exposure_us(setting.exposure_us);
    const CameraLight::Range gain = camera->gain_range();
    if (gain.most > gain.least) camera->set_gain(raw_gain(gain, setting.gain));
  }

  /// The share of light that stays when the LED is off, in the same places.
  void measure_ambient() {
    lamp_.set_level(0);
    const bool seen = look();
    if (seen && report_.white_counts > 0) {
      const LightReading dark = read_light(frame_.image, mirrored_, tags_);
      report_.ambient_fraction = std::min(1.0, dark.white_counts / report_.white_counts);
    }
    lamp_.set_level(report_.setting.led_permille);
    if (seen) look();  // nobody shall learn from a picture without light
  }

  /// The first picture that shows the present setting.
  bool look() {
    for (int frames = 0; frames < kFramesUntilSeen; ++frames) {
      if (!next_picture()) {
        report_.stopped = true;
        return false;
      }
    }
    return true;
  }

  bool next_picture() {
    const TimePoint until = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < until) {
      pollfd fds[3] = {
          {source_.poll_fd(), POLLIN, 0}, {lamp_.poll_fd(), POLLIN, 0}, {stop_.get(), POLLIN, 0}};
      constexpr int kLook_ms = 100;
      ::poll(fds, 3, source_.poll_fd() < 0 ? 0 : kLook_ms);
      if (fds[2].revents != 0) return false;
      if (fds[1].revents != 0) lamp_.service();
      const ReadStatus status = source_.read(frame_);
      if (status == ReadStatus::end) return false;
      if (status == ReadStatus::frame) return true;
    }
    return false;
  }

  FrameSource& source_;
  Acquirer& finder_;
  bool mirrored_;
  Lamp& lamp_;
  const UniqueFd& stop_;
  Frame frame_;
  std::vector<FoundTag> tags_;
  LightReport report_;
};

}  // namespace

LightReport settle_light(FrameSource& source, Acquirer& finder, bool mirrored, Lamp& lamp,
                         const UniqueFd& stop) {
  return Settling(source, finder, mirrored, lamp, stop).run();
}

std::string light_text(const LightReport& report) {
  std::string line = fmt::format(
      "light: LED {:.1f} %, white of the {} {:.0f} of 255", report.setting.led_permille / 10,
      report.tags_found > 0 ? "tags" : "picture (no tag found)", report.white_counts);
  if (report.setting.exposure_us > 1)
    line += fmt::format(", exposure {:.1f} ms", report.setting.exposure_us * 1e-3);
  if (report.setting.gain > 1) line += fmt::format(", gain {:.1f}", report.setting.gain);
  line += fmt::format(", {:.0f} % of it ambient", 100 * report.ambient_fraction);
  switch (report.state) {
    case LightControl::State::settling:
      return line + "; it did not become steady: does the light flicker?";
    case LightControl::State::too_dark:
      return line + "; too dark with everything at its end: is the LED wired, and the lens free?";
    case LightControl::State::too_bright:
      return line + "; too bright with everything at its end: keep other light off the tags";
    case LightControl::State::settled:
      break;
  }
  if (report.ambient_fraction > 0.9) return line + "; the LED hardly shows: is it wired?";
  if (report.ambient_fraction > kMuchAmbient) line += "; keep other light off the tags";
  return line;
}

}  // namespace tagwrench

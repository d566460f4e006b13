#include "host/tools/camera_timing/measurement.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "protocol/pattern.h"

namespace tagwrench {
namespace {

constexpr double kSettle = 0.6;  // s, longer than the longest latency that is looked for
constexpr double kDarkSeconds = 0.6;
constexpr double kPatience = 3;  // s without a frame
constexpr int kWhite_counts = 235;
constexpr double kMaxWhite = 0.02;  // of a picture that is not too bright
constexpr double kShorten = 0.4;
constexpr int kMaxShortenings = 6;
constexpr std::uint16_t kSeed = 0x2A5C;

double seconds(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

double white_fraction(const ImageView& image) {
  std::size_t white = 0;
  for (int row = 0; row < image.height; ++row) {
    const std::uint8_t* pixels = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    white += static_cast<std::size_t>(std::count_if(
        pixels, pixels + image.width, [](std::uint8_t v) { return v >= kWhite_counts; }));
  }
  return static_cast<double>(white) / (static_cast<double>(image.width) * image.height);
}

class Run {
 public:
  Run(FrameSource& source, PatternLamp& lamp, const CameraTimingOptions& options)
      : source_(source),
        lamp_(lamp),
        options_(options),
        profiler_(source.format().width, source.format().height) {}

  CameraTimingMeasurement measure();

 private:
  bool next(Frame& frame);
  bool settle();
  template <typename Take>
  bool watch(double length, Take take);
  bool take_lit();
  bool shorten_exposure();
  bool take_dark();
  bool take_pattern();
  bool fail(std::string why);
  void evaluate();
  /// s; what most cameras have, where a driver announces none.
  double announced_period() const {
    const double period = std::chrono::duration<double>(source_.format().period).count();
    return period > 0 ? period : 1.0 / 30;
  }

  FrameSource& source_;
  PatternLamp& lamp_;
  const CameraTimingOptions& options_;
  RowProfiler profiler_;
  CameraTimingInput input_;
  CameraTimingMeasurement out_;
};

bool Run::fail(std::string why) {
  if (out_.refusal.empty()) out_.refusal = std::move(why);
  out_.failed = true;
  return false;
}

/// Waits for a whole frame; false when there will be none.
bool Run::next(Frame& frame) {
  constexpr int kWake_ms = 20;
  const TimePoint patience =
      std::chrono::steady_clock::now() +
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(kPatience));
  while (std::chrono::steady_clock::now() < patience) {
    std::array<pollfd, 3> fds{{{source_.poll_fd(), POLLIN, 0},
                               {lamp_.poll_fd(), POLLIN, 0},
                               {options_.stop_fd, POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), source_.poll_fd() < 0 ? 0 : kWake_ms);
    lamp_.service();
    if (options_.stopped && options_.stopped()) return fail("stopped");
    if (const std::string trouble = lamp_.trouble(); !trouble.empty()) return fail(trouble);
    if (source_.poll_fd() >= 0 && fds[0].revents == 0) continue;
    source_.want({});
    const ReadStatus status = source_.read(frame);
    if (status == ReadStatus::end) return fail("the source has no more pictures");
    if (status == ReadStatus::disconnected) return fail(source_.detail());
    if (status == ReadStatus::frame) return true;
  }
  return fail("no picture comes from the camera");
}

/// Frames of `length` seconds, by their stamps.
template <typename Take>
bool Run::watch(double length, Take take) {
  std::optional<TimePoint> first;
  while (true) {
    Frame frame;
    if (!next(frame)) return false;
    if (!first) first = frame.capture_time;
    if (std::chrono::duration<double>(frame.capture_time - *first).count() >= length) return true;
    take(frame);
  }
}

/// Until the camera shows the light as it was ordered last.
bool Run::settle() {
  return watch(kSettle, [](Frame&) {});
}

bool Run::shorten_exposure() {
  CameraLight* camera = source_.camera_light();
  for (int i = 0; i < kMaxShortenings; ++i) {
    Frame frame;
    if (!next(frame)) return false;
    if (white_fraction(frame.image) <= kMaxWhite) return true;
    if (camera == nullptr) return true;  // the profiler will say
    const double wanted =
        std::max(kShorten * camera->exposure_us(), camera->exposure_range_us().least);
    if (wanted >= camera->exposure_us() || !camera->set_exposure_us(wanted)) return true;
    out_.exposure_set_us = camera->exposure_us();
    if (!settle()) return false;
  }
  return true;
}

bool Run::take_lit() {
  lamp_.steady(options_.reference_permille);
  if (!settle() || !shorten_exposure()) return false;
  return watch(options_.reference_seconds, [&](Frame& frame) {
    if (options_.process) {
      options_.process(frame);
      const auto done = std::chrono::steady_clock::now() - frame.latency_origin;
      out_.processing.push_back(std::chrono::duration<double>(done).count());
    }
    profiler_.learn_lit(frame.image);
  });
}

bool Run::take_dark() {
  lamp_.off();
  return settle() && watch(kDarkSeconds, [&](Frame& frame) { profiler_.learn_dark(frame.image); });
}

bool Run::take_pattern() {
  const Duration bit = std::max<Duration>(
      lamp_.shortest_bit(),
      std::chrono::microseconds(std::llround(1e6 * bit_period_for(announced_period()))));
  lamp_.pattern(bit, kSeed);
  return settle() && watch(options_.seconds, [&](Frame& frame) {
           input_.frames.push_back(
               {seconds(frame.capture_time), frame.dropped, profiler_.measure(frame.image)});
         });
}

void Run::evaluate() {
  const std::optional<PatternTiming> timing = lamp_.timing();
  if (!timing) {
    fail("the lamp's clock is not known: is the board connected?");
    return;
  }
  out_.bit = timing->period;
  out_.edge_sigma = timing->start_sigma;
  input_.bands = profiler_.bands();
  input_.lit = profiler_.lit();
  input_.dark = profiler_.dark();
  input_.bit = timing->period;
  input_.edge_sigma = timing->start_sigma;
  input_.clock_rate_sigma = timing->rate_sigma;
  input_.period = announced_period();
  const double start = seconds(timing->start);
  const double end = input_.frames.empty() ? start : input_.frames.back().stamp + 1;
  std::uint16_t state = timing->seed;
  bool light = false;
  for (std::int64_t k = 0; start + static_cast<double>(k) * timing->period < end; ++k) {
    if (link::pattern_light(state) != light)
      input_.edges.push_back(start + static_cast<double>(k) * timing->period);
    light = link::pattern_light(state);
    state = link::next_pattern_state(state);
  }
  out_.result = measure_camera_timing(input_);
  out_.refusal = out_.result.refusal;
}

CameraTimingMeasurement Run::measure() {
  const auto say = [&](const std::string& line) {
    if (options_.say) options_.say(line);
  };
  CameraLight* camera = source_.camera_light();
  const double exposure_us = camera != nullptr ? camera->exposure_us() : 0;
  say("LED steady: what it lights, and the time from stamp to output");
  bool good = take_lit();
  if (good) {
    say("LED off: light from elsewhere");
    good = take_dark();
  }
  if (good) {
    out_.refusal = profiler_.choose();
    out_.used_fraction = profiler_.used_fraction();
    out_.saturated_fraction = profiler_.saturated_fraction();
    out_.ambient_fraction = profiler_.ambient_fraction();
    good = out_.refusal.empty();
  }
  if (good) {
    say("LED flashing");
    good = take_pattern();
  }
  if (good) evaluate();
  lamp_.off();
  lamp_.service();
  if (camera != nullptr && out_.exposure_set_us > 0) camera->set_exposure_us(exposure_us);
  std::sort(out_.processing.begin(), out_.processing.end());
  return std::move(out_);
}

}  // namespace

CameraTimingMeasurement measure_camera_timing(FrameSource& source, PatternLamp& lamp,
                                              const CameraTimingOptions& options) {
  return Run(source, lamp, options).measure();
}

}  // namespace tagwrench

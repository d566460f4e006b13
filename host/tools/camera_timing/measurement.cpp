#include "host/tools/camera_timing/measurement.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>

#include "protocol/pattern.h"

namespace tagwrench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSettle = 0.6;  // s, longer than the longest latency that is looked for
constexpr double kDarkSeconds = 0.6;
constexpr double kPatience = 3;  // s without a frame
constexpr int kWhite_counts = 235;
constexpr double kMaxWhite = 0.02;  // of a picture that is not too bright
constexpr double kShorten = 0.4;
constexpr int kMaxShortenings = 6;
constexpr std::uint16_t kSeed = 0x2A5C;
constexpr double kReference = 0.5;  // s of a black screen, and of a white one
constexpr double kMax = 1.5;        // s from a flip to its picture
constexpr double kSlowest = 3;      // s from an order to its flip
constexpr double kMinContrast = 4;  // grey levels
constexpr double kClearly = 6;      // standard deviations
constexpr int kMinFlips = 10;

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

Duration duration(double s) { return Duration(std::llround(1e9 * s)); }

/// Waits for a whole frame. Empty: it came; else why there will be none. `trouble` keeps the light
/// alive and says what is wrong with it; it is asked when `light_fd` is readable, and often.
template <typename Options, typename Trouble>
std::string await_frame(FrameSource& source, const Options& options, int light_fd, Trouble trouble,
                        Frame& frame) {
  constexpr int kWake_ms = 20;
  const TimePoint patience = Clock::now() + duration(kPatience);
  while (Clock::now() < patience) {
    std::array<pollfd, 3> fds{
        {{source.poll_fd(), POLLIN, 0}, {light_fd, POLLIN, 0}, {options.stop_fd, POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), source.poll_fd() < 0 ? 0 : kWake_ms);
    std::string why = trouble();
    if (options.stopped && options.stopped()) return "stopped";
    if (!why.empty()) return why;
    if (source.poll_fd() >= 0 && fds[0].revents == 0) continue;
    source.want({});
    const ReadStatus status = source.read(frame);
    if (status == ReadStatus::end) return "the source has no more pictures";
    if (status == ReadStatus::disconnected) return source.detail();
    if (status == ReadStatus::frame) return {};
  }
  return "no picture comes from the camera";
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

class LampRun {
 public:
  LampRun(FrameSource& source, PatternLamp& lamp, const CameraTimingOptions& options)
      : source_(source),
        lamp_(lamp),
        options_(options),
        profiler_(source.format().width, source.format().height) {}

  CameraTimingMeasurement measure() {
    CameraLight* camera = source_.camera_light();
    const double exposure_us = camera != nullptr ? camera->exposure_us() : 0;
    say("LED steady: what it lights, and the time from stamp to output");
    if (take_lit() && take_dark() && choose_pixels() && take_pattern()) evaluate();
    lamp_.off();
    lamp_.service();
    if (camera != nullptr && out_.exposure_set_us > 0) camera->set_exposure_us(exposure_us);
    std::sort(out_.processing.begin(), out_.processing.end());
    return std::move(out_);
  }

 private:
  void say(const char* line) const {
    if (options_.say) options_.say(line);
  }

  bool next(Frame& frame) {
    const auto trouble = [this] {
      lamp_.service();
      return lamp_.trouble();
    };
    out_.refusal = await_frame(source_, options_, lamp_.poll_fd(), trouble, frame);
    out_.failed = !out_.refusal.empty();
    return !out_.failed;
  }

  /// Frames of `length` seconds, by their stamps.
  template <typename Take>
  bool watch(double length, Take take) {
    std::optional<TimePoint> first;
    for (Frame frame; next(frame); frame = {}) {
      if (!first) first = frame.capture_time;
      if (seconds(frame.capture_time - *first) >= length) return true;
      take(frame);
    }
    return false;
  }

  /// Until the camera shows the light as it was ordered last.
  bool settle() {
    return watch(kSettle, [](Frame&) {});
  }

  bool shorten_exposure() {
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

  bool take_lit() {
    lamp_.steady(options_.reference_permille);
    if (!settle() || !shorten_exposure()) return false;
    return watch(options_.reference_seconds, [&](Frame& frame) {
      if (options_.process) {
        options_.process(frame);
        out_.processing.push_back(seconds(Clock::now() - frame.latency_origin));
      }
      profiler_.learn_lit(frame.image);
    });
  }

  bool take_dark() {
    say("LED off: light from elsewhere");
    lamp_.off();
    return settle() &&
           watch(kDarkSeconds, [&](Frame& frame) { profiler_.learn_dark(frame.image); });
  }

  bool choose_pixels() {
    out_.refusal = profiler_.choose();
    out_.used_fraction = profiler_.used_fraction();
    out_.saturated_fraction = profiler_.saturated_fraction();
    out_.ambient_fraction = profiler_.ambient_fraction();
    return out_.refusal.empty();
  }

  bool take_pattern() {
    say("LED flashing");
    const Duration bit = std::max<Duration>(
        lamp_.shortest_bit(),
        std::chrono::microseconds(std::llround(1e6 * bit_period_for(announced_period()))));
    lamp_.pattern(bit, kSeed);
    return settle() && watch(options_.seconds, [&](Frame& frame) {
             input_.frames.push_back({seconds(frame.capture_time.time_since_epoch()), frame.dropped,
                                      profiler_.measure(frame.image)});
           });
  }

  void evaluate() {
    const std::optional<PatternTiming> timing = lamp_.timing();
    if (!timing) {
      out_.refusal = "the lamp's clock is not known: is the board connected?";
      out_.failed = true;
      return;
    }
    input_.bands = profiler_.bands();
    input_.lit = profiler_.lit();
    input_.dark = profiler_.dark();
    out_.bit = input_.bit = timing->period;
    out_.edge_sigma = input_.edge_sigma = timing->start_sigma;
    input_.clock_rate_sigma = timing->rate_sigma;
    input_.period = announced_period();
    const double start = seconds(timing->start.time_since_epoch());
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

  /// s; what most cameras have, where a driver announces none.
  double announced_period() const {
    const double period = seconds(source_.format().period);
    return period > 0 ? period : 1.0 / 30;
  }

  FrameSource& source_;
  PatternLamp& lamp_;
  const CameraTimingOptions& options_;
  RowProfiler profiler_;
  CameraTimingInput input_;
  CameraTimingMeasurement out_;
};

double mean_level(const Frame& frame) {
  const Region part = frame.readable();
  std::uint64_t sum = 0;
  for (int row = part.y; row < part.y + part.height; ++row) {
    const std::uint8_t* pixels =
        frame.image.pixels + static_cast<std::ptrdiff_t>(row) * frame.image.stride + part.x;
    sum = std::accumulate(pixels, pixels + part.width, sum);
  }
  return static_cast<double>(sum) / (static_cast<double>(part.width) * part.height);
}

class ScreenRun {
 public:
  ScreenRun(FrameSource& source, FlipPatch& patch, const ScreenOptions& options)
      : source_(source), patch_(patch), options_(options) {}

  ScreenMeasurement measure() {
    if (!reference(false, black_) || !reference(true, white_)) return out_;
    out_.contrast = white_.mean - black_.mean;
    if (out_.contrast < std::max(kMinContrast, kClearly * (white_.sigma + black_.sigma))) {
      out_.refusal = fmt::format(
          "the camera does not see the screen flip ({:.1f} grey levels between black and white): "
          "point it there, and fix its exposure",
          out_.contrast);
      return out_;
    }
    if (flip_for(options_.seconds)) evaluate();
    return out_;
  }

 private:
  struct Level {
    double mean = 0, sigma = 0;
  };

  bool next(Frame& frame) {
    std::string why = await_frame(
        source_, options_, -1, [this] { return patch_.ended(); }, frame);
    if (!why.empty()) return fail(std::move(why));
    number_ += 1.0 + frame.dropped;
    if (!first_) {
      first_ = frame.capture_time;
      number_ = 0;
    }
    last_ = frame.capture_time;
    stamps_.add(number_, seconds(last_ - *first_));
    return true;
  }

  /// On a virtual clock the last stamp is all there is.
  TimePoint now() const { return source_.poll_fd() < 0 ? last_ : Clock::now(); }

  bool fail(std::string why) {
    out_.refusal = std::move(why);
    return false;
  }

  bool reference(bool white, Level& level) {
    Frame frame;
    if (!first_ && !next(frame)) return false;
    patch_.show(white, last_);
    if (!await_shown()) return false;
    const TimePoint from = last_ + duration(kSettle), to = from + duration(kReference);
    double sum = 0, squares = 0;
    int count = 0;
    while (last_ < to) {
      if (!next(frame)) return false;
      if (last_ < from) continue;
      const double value = mean_level(frame);
      sum += value;
      squares += value * value;
      ++count;
    }
    level.mean = sum / std::max(count, 1);
    level.sigma = std::sqrt(std::max(squares / std::max(count, 1) - level.mean * level.mean, 0.0));
    return true;
  }

  bool flip_for(double length) {
    const TimePoint end = last_ + duration(length);
    const double period = std::max(seconds(source_.format().period), 1e-3);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> phase(0.0, period);
    bool white = true;
    while (last_ < end) {
      white = !white;
      // From now, not from the stamp: what would have to happen in the past happens now, and the
      // flips would no longer fall evenly between the pictures.
      const TimePoint ordered = now();
      patch_.show(white, ordered + duration(phase(random)));
      Frame frame;
      bool seen = false;
      while (!seen && seconds(last_ - patch_.shown().value_or(last_)) < kMax) {
        if (seconds(now() - ordered) > kSlowest) return fail("the screen does not flip any more");
        if (!next(frame)) return false;
        seen = last_ > patch_.shown().value_or(ordered) &&
               (mean_level(frame) > 0.5 * (white_.mean + black_.mean)) == white;
      }
      if (!seen) {
        ++out_.missed;
        continue;
      }
      const bool dropped = frame.dropped > 0;  // the first to show it may be the one that was lost
      const TimePoint stamp = last_, arrived = now();
      if (!await_shown()) return false;
      const TimePoint flipped = *patch_.shown();
      if (dropped) continue;
      delays_.push_back(seconds(stamp - flipped));
      arrivals_ += seconds(arrived - flipped);
      ++out_.flips;
      if (!next(frame)) return false;  // the picture that saw only a part of the flip
    }
    return true;
  }

  bool await_shown() {
    const TimePoint from = now();
    for (Frame frame; !patch_.shown();) {
      if (seconds(now() - from) > kSlowest) return fail("the screen does not flip any more");
      if (!next(frame)) return false;
    }
    return true;
  }

  /// The widest part of a picture's period in which no flip fell, s.
  double widest_gap(double period) const {
    std::vector<double> phases;
    for (const double delay : delays_)
      phases.push_back(delay - period * std::floor(delay / period));
    std::sort(phases.begin(), phases.end());
    double widest = phases.front() + period - phases.back();
    for (std::size_t i = 1; i < phases.size(); ++i)
      widest = std::max(widest, phases[i] - phases[i - 1]);
    return widest;
  }

  void evaluate() {
    if (out_.flips < kMinFlips) {
      out_.refusal = fmt::format("only {} flips were seen: give it more time", out_.flips);
      return;
    }
    const double period = stamps_.slope();
    const double residual =
        std::max(stamps_.yy - stamps_.offset() * stamps_.y - period * stamps_.xy, 0.0) /
        (stamps_.n - 2);
    out_.frame_rate = {
        1 / period, std::sqrt(residual * stamps_.n / stamps_.spread()) / (period * period), true};
    double mean = 0, variance = 0;
    for (const double delay : delays_) mean += delay / out_.flips;
    for (const double delay : delays_) variance += (delay - mean) * (delay - mean) / out_.flips;
    const double even = widest_gap(period) / std::sqrt(12.0);
    const double sigma = std::hypot(std::sqrt(variance / out_.flips), even,
                                    seconds(patch_.clock_error()) / std::sqrt(3.0));
    out_.latency = {mean - 0.5 * period, sigma, true};
    out_.round_trip = arrivals_ / out_.flips;
  }

  FrameSource& source_;
  FlipPatch& patch_;
  const ScreenOptions& options_;
  ScreenMeasurement out_;
  Level black_, white_;
  std::optional<TimePoint> first_;
  TimePoint last_{};
  double number_ = 0;
  LineSums stamps_;             ///< s, over the numbers of the frames
  std::vector<double> delays_;  ///< from a flip to the stamp of the picture that shows it, s
  double arrivals_ = 0;
};

}  // namespace

CameraTimingMeasurement measure_camera_timing(FrameSource& source, PatternLamp& lamp,
                                              const CameraTimingOptions& options) {
  return LampRun(source, lamp, options).measure();
}

ScreenMeasurement measure_screen(FrameSource& source, FlipPatch& patch,
                                 const ScreenOptions& options) {
  return ScreenRun(source, patch, options).measure();
}

}  // namespace tagwrench

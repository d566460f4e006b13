#include "host/tools/camera_timing/screen_measurement.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <vector>

#include "host/core/json/json_text.h"

namespace tagwrench {
namespace {

constexpr double kSettle = 0.6;     // s
constexpr double kReference = 0.5;  // s of black, and of white
constexpr double kPatience = 3;     // s without a frame
constexpr double kMax = 1.5;        // s from a flip to its picture
constexpr double kSlowest = 3;      // s from an order to its flip
constexpr double kMinContrast = 4;  // grey levels
constexpr double kClearly = 6;      // standard deviations
constexpr int kMinFlips = 10;

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

Duration duration(double s) { return Duration(std::llround(1e9 * s)); }

double mean_level(const Frame& frame) {
  const Region part = frame.readable();
  std::uint64_t sum = 0;
  for (int row = part.y; row < part.y + part.height; ++row) {
    const std::uint8_t* pixels =
        frame.image.pixels + static_cast<std::ptrdiff_t>(row) * frame.image.stride + part.x;
    for (int i = 0; i < part.width; ++i) sum += pixels[i];
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
    constexpr int kWake_ms = 100;
    const TimePoint patience = std::chrono::steady_clock::now() + duration(kPatience);
    while (std::chrono::steady_clock::now() < patience) {
      std::array<pollfd, 2> fds{{{source_.poll_fd(), POLLIN, 0}, {options_.stop_fd, POLLIN, 0}}};
      ::poll(fds.data(), fds.size(), source_.poll_fd() < 0 ? 0 : kWake_ms);
      if (options_.stopped && options_.stopped()) return fail("stopped");
      if (std::string why = patch_.ended(); !why.empty()) return fail(std::move(why));
      if (source_.poll_fd() >= 0 && fds[0].revents == 0) continue;
      const ReadStatus status = source_.read(frame);
      if (status == ReadStatus::end) return fail("the source has no more pictures");
      if (status == ReadStatus::disconnected) return fail(source_.detail());
      if (status != ReadStatus::frame) continue;
      note(frame);
      return true;
    }
    return fail("no picture comes from the camera");
  }

  /// On a virtual clock the last stamp is all there is.
  TimePoint now() const { return source_.poll_fd() < 0 ? last_ : std::chrono::steady_clock::now(); }

  bool fail(std::string why) {
    out_.refusal = std::move(why);
    return false;
  }

  /// Sums of a straight line through the stamps over the numbers of the frames.
  void note(const Frame& frame) {
    number_ += 1.0 + frame.dropped;
    if (!first_) {
      first_ = frame.capture_time;
      number_ = 0;
    }
    last_ = frame.capture_time;
    const double time = seconds(last_ - *first_);
    n_ += 1;
    x_ += number_;
    y_ += time;
    xx_ += number_ * number_;
    xy_ += number_ * time;
    yy_ += time * time;
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
      const TimePoint stamp = last_;
      const TimePoint arrived = now();
      if (!await_shown()) return false;
      const TimePoint flipped = *patch_.shown();
      if (dropped) continue;
      const double delay = seconds(stamp - flipped);
      delays_.push_back(delay);
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
    const double spread = n_ * xx_ - x_ * x_;
    const double period = (n_ * xy_ - x_ * y_) / spread;
    const double offset = (y_ - period * x_) / n_;
    const double residual = std::max(yy_ - offset * y_ - period * xy_, 0.0) / (n_ - 2);
    out_.frame_rate = {1 / period, std::sqrt(residual * n_ / spread) / (period * period), true};
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
  double number_ = 0, n_ = 0, x_ = 0, y_ = 0, xx_ = 0, xy_ = 0, yy_ = 0;
  std::vector<double> delays_;  ///< from a flip to the stamp of the picture that shows it, s
  double arrivals_ = 0;
};

}  // namespace

ScreenMeasurement measure_screen(FrameSource& source, FlipPatch& patch,
                                 const ScreenOptions& options) {
  return ScreenRun(source, patch, options).measure();
}

std::string report_text(const ScreenMeasurement& m, const std::string& camera,
                        const std::string& screen, double announced_period) {
  std::string text;
  const auto line = [&text](const char* name, const std::string& value, const std::string& remark) {
    text += remark.empty() ? fmt::format("{:<15}{}\n", name, value)
                           : fmt::format("{:<15}{:<26}{}\n", name, value, remark);
  };
  line("camera", camera, "");
  line("screen", screen, "");
  line("frame rate", fmt::format("{:.3f} +/- {:.3f} Hz", m.frame_rate.value, m.frame_rate.sigma),
       announced_period > 0
           ? fmt::format("by the time stamps; announced {:.5g} Hz", 1 / announced_period)
           : "by the time stamps; none announced");
  line("latency", fmt::format("{:.1f} +/- {:.1f} ms", 1e3 * m.latency.value, 1e3 * m.latency.sigma),
       "screen and camera together, to the kernel's time stamp");
  line("round trip", fmt::format("{:.1f} ms", 1e3 * m.round_trip),
       "mean, from a flip to the arrival of the picture that shows it");
  line("flips", fmt::format("{} seen, {} missed", m.flips, m.missed),
       fmt::format("{:.0f} grey levels between black and white", m.contrast));
  return text;
}

std::string report_json(const ScreenMeasurement& m, const std::string& camera,
                        const std::string& screen, double announced_period) {
  const auto figure = [](const Figure& f) {
    return nlohmann::ordered_json{{"value", f.value}, {"sigma", f.sigma}};
  };
  nlohmann::ordered_json json;
  json["format"] = "tagwrench-screen-1";
  json["camera"] = camera;
  json["screen"] = screen;
  if (announced_period > 0) json["announced_hz"] = 1 / announced_period;
  json["frame_rate_hz"] = figure(m.frame_rate);
  json["latency_s"] = figure(m.latency);
  json["round_trip_s"] = m.round_trip;
  json["flips"] = {{"seen", m.flips}, {"missed", m.missed}};
  json["contrast_counts"] = m.contrast;
  return dump_json(json, 2) + "\n";
}

}  // namespace tagwrench

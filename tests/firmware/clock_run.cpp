#include "tests/firmware/clock_run.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "host/board/board_session.h"

namespace tagwrench::emulator {

namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr VirtualTime kStep = microseconds(100);
/// Host time of virtual time zero: any number that is not zero.
constexpr TimePoint kHostZero{std::chrono::hours(30)};

VirtualTime of_us(double us) { return VirtualTime(std::llround(us * 1000)); }
double us_of(VirtualTime time) { return static_cast<double>(time.count()) * 1e-3; }

/// One way of the path. What went in earlier comes out earlier.
class Way {
 public:
  Way(const PathDelays& delays, unsigned seed) : delays_(delays), random_(seed) {}

  /// When something that is ready at `at` comes out; `anew`: its own delay, else that of what was
  /// before.
  VirtualTime out(VirtualTime at, bool anew) {
    if (anew) delay_ = draw();
    VirtualTime out = at + delay_;
    if (delays_.usb_frames) {
      constexpr VirtualTime kFrame = milliseconds(1);
      out = (out + kFrame - VirtualTime(1)) / kFrame * kFrame;
    }
    last_ = std::max(last_, out);
    return last_;
  }

 private:
  VirtualTime draw() {
    double us = delays_.fixed_us + std::uniform_real_distribution<>(0, delays_.jitter_us)(random_);
    if (std::bernoulli_distribution(delays_.tail_probability)(random_))
      us += std::exponential_distribution<>(1 / delays_.tail_us)(random_);
    return of_us(us);
  }

  PathDelays delays_;
  std::mt19937 random_;
  VirtualTime delay_{};
  VirtualTime last_{};
};

class ClockRun {
 public:
  ClockRun(const std::filesystem::path& elf, const ClockRunOptions& options)
      : options_(options),
        board_(elf, {.clock_ppm = options.clock_ppm, .seed = options.seed}),
        session_(session_options()),
        to_board_(options.to_board, 2 * options.seed),
        to_host_(options.to_host, 2 * options.seed + 1) {
    if (options.told_asymmetry_us)
      session_.clock().set_asymmetry(of_us(*options.told_asymmetry_us), microseconds(10));
  }

  ClockRunFigures run() {
    bool reset_due = options_.reset_at_s.has_value();
    for (VirtualTime now = kStep; now < of_us(options_.seconds * 1e6); now += kStep) {
      if (reset_due && now >= of_us(*options_.reset_at_s * 1e6)) {
        board_.press_reset();
        reset_due = false;
      }
      board_.advance_to(now);
      deliver(now);
      send(now);
      judge(now);
    }
    return finish();
  }

 private:
  struct Waiting {
    std::uint8_t value;
    VirtualTime arrival;
  };

  static link::BoardSessionOptions session_options() {
    link::BoardSessionOptions options;
    options.session = 77;
    return options;
  }
  static TimePoint host(VirtualTime time) { return kHostZero + time; }

  void deliver(VirtualTime now) {
    for (const SentByte& byte : board_.read()) {
      waiting_.push_back({byte.value, to_host_.out(byte.end, frame_begins_)});
      frame_begins_ = byte.value == 0;
    }
    while (!waiting_.empty() && waiting_.front().arrival <= now) {
      const VirtualTime arrival = waiting_.front().arrival;
      std::vector<std::uint8_t> bytes;
      for (; !waiting_.empty() && waiting_.front().arrival == arrival; waiting_.pop_front())
        bytes.push_back(waiting_.front().value);
      session_.take(bytes, host(arrival));
    }
  }

  void send(VirtualTime now) {
    if (session_.next_poll() > host(now)) return;
    std::array<std::uint8_t, link::BoardSession::kMaxBytesOut> bytes;
    const std::size_t count = session_.poll(host(now), bytes.data());
    if (count > 0) board_.write_at(to_board_.out(now, true), {bytes.data(), count});
  }

  void judge(VirtualTime now) {
    const double seconds = us_of(now) * 1e-6;
    if (converged_after_s_ < 0 && session_.clock().report().converged) converged_after_s_ = seconds;
    for (link::CellReading reading; session_.next(reading);) {
      const auto& conversions = board_.cell(reading.channel).conversions();
      const VirtualTime stated = reading.time.time - kHostZero;
      const auto ready = std::min_element(
          conversions.rbegin(), conversions.rend(), [&](const auto& a, const auto& b) {
            return std::abs((a.ready - stated).count()) < std::abs((b.ready - stated).count());
          });
      if (ready == conversions.rend()) continue;
      take(seconds, us_of(stated - ready->ready), us_of(reading.time.sigma));
      if (conversions.size() > 64) board_.cell(reading.channel).forget_conversions();
    }
    for (link::AdcReading reading; session_.next(reading);) {
    }
  }

  void take(double seconds, double error_us, double sigma_us) {
    if (figures_.first_reading_s < 0) figures_.first_reading_s = seconds;
    figures_.worst_ever_sigmas =
        std::max(figures_.worst_ever_sigmas, std::abs(error_us) / sigma_us);
    if (std::abs(error_us) > 50) figures_.below_50_us_after_s = seconds;
    if (seconds < options_.settled_after_s) return;
    ++figures_.readings;
    sum_ += error_us;
    squares_ += error_us * error_us;
    sigmas_ += sigma_us;
    normalised_squares_ += error_us * error_us / (sigma_us * sigma_us);
    within_ += std::abs(error_us) <= 3 * sigma_us ? 1 : 0;
    figures_.worst_us = std::max(figures_.worst_us, std::abs(error_us));
  }

  ClockRunFigures finish() {
    const double count = std::max<double>(1, static_cast<double>(figures_.readings));
    figures_.bias_us = sum_ / count;
    figures_.rms_us = std::sqrt(squares_ / count);
    figures_.sigma_us = sigmas_ / count;
    figures_.normalised_rms = std::sqrt(normalised_squares_ / count);
    figures_.within_3_sigma = static_cast<double>(within_) / count;
    figures_.converged_after_s = converged_after_s_;
    const link::ClockReport report = session_.clock().report();
    figures_.skew_ppm = report.skew_ppm;
    figures_.skew_sigma_ppm = report.skew_sigma_ppm;
    figures_.restarts = session_.counters().restarts;
    figures_.lost_conversions = session_.counters().lost_conversions;
    return figures_;
  }

  ClockRunOptions options_;
  EmulatedBoard board_;
  link::BoardSession session_;
  Way to_board_;
  Way to_host_;
  std::deque<Waiting> waiting_;
  bool frame_begins_ = true;
  ClockRunFigures figures_;
  double converged_after_s_ = -1;
  double sum_ = 0;
  double squares_ = 0;
  double sigmas_ = 0;
  double normalised_squares_ = 0;
  std::size_t within_ = 0;
};

}  // namespace

ClockRunFigures run_clock(const std::filesystem::path& elf, const ClockRunOptions& options) {
  return ClockRun(elf, options).run();
}

}  // namespace tagwrench::emulator

// A board's clock and a path to it, both made up: the truth that a clock synchronisation can be
// held against. Its times are seconds of the host's clock.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "host/board/clock_sync.h"

namespace tagwrench::link {

struct PathDelays {
  double there = 60e-6;  ///< s, least
  double back = 60e-6;   ///< s, least
  double jitter = 1e-3;  ///< s, uniform from zero
  double tail_share = 0.05;
  double tail = 1e-3;  ///< s, mean of an exponential
  bool jitter_there = true;
};

class SyntheticLink {
 public:
  static constexpr std::uint16_t kRequestBytes = 6;
  static constexpr std::uint16_t kReplyBytes = 18;

  SyntheticLink(unsigned seed, const PathDelays& path, double skew, double wander = 2e-6)
      : path_(path), skew_(skew), wander_(wander), random_(seed) {
    phase_ = 6.28 * draw();
  }

  static TimePoint host(double t) {
    return TimePoint(Duration(static_cast<std::int64_t>(std::llround(t * 1e9))));
  }
  static double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

  /// Board time (s) at host time t: skew, and a wander of the skew with a period of 60 s.
  double board(double t) const {
    const double since = t - kStart;
    const double swing = wander_ / kTurn;
    return board_start_ + since * (1 + skew_) +
           swing * (std::sin(kTurn * since + phase_) - std::sin(phase_));
  }
  std::uint32_t board_us(double t) const {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(board(t) * 1e6)));
  }

  /// One exchange that begins at host time t; `end` is when it is over.
  TimeExchange exchange(double t, double& end) {
    const double received = t + kRequestBytes * 20e-6 + delay(path_.there, path_.jitter_there);
    const double sent = received + 0.5e-3 + 2e-3 * draw();
    end = sent + kReplyBytes * 20e-6 + delay(path_.back, true);
    const auto stamp = [&](double when) { return board_us(when + 3e-6 * draw()); };
    return {host(t), host(end), stamp(received), stamp(sent), kRequestBytes, kReplyBytes};
  }

  double draw() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  void set_board_start(double board_seconds) { board_start_ = board_seconds; }

  static constexpr double kStart = 100;

 private:
  static constexpr double kTurn = 6.283185307 / 60;

  double delay(double least, bool jitters) {
    double d = least;
    if (jitters) d += path_.jitter * draw();
    if (path_.tail_share > 0 && draw() < path_.tail_share)
      d += std::exponential_distribution<double>(1 / path_.tail)(random_);
    return d;
  }

  PathDelays path_;
  double skew_;
  double wander_;
  double phase_ = 0;
  double board_start_ = 3000;
  std::mt19937 random_;
};

}  // namespace tagwrench::link

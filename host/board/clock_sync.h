// The board's clock in terms of the host's. Pure: it is told exchanges, and says host times.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "host/core/types.h"

namespace tagwrench::link {

/// One request and its reply.
struct TimeExchange {
  TimePoint host_sent{};                ///< the request's first byte began to leave
  TimePoint host_received{};            ///< the reply's last byte was there
  std::uint32_t board_received_us = 0;  ///< the request's last byte was there
  std::uint32_t board_sent_us = 0;      ///< the reply's first byte began to leave
  std::uint16_t request_bytes = 0;      ///< on the wire, delimiter included
  std::uint16_t reply_bytes = 0;
};

/// A board time as the host's clock would have shown it.
struct HostTime {
  TimePoint time{};
  Duration sigma{};         ///< one standard deviation of all that is not known
  Duration random_sigma{};  ///< of these, what the path's unknown asymmetry has no part in: it is
                            ///< the same for all times, and cancels in their differences
};

struct ClockSyncOptions {
  double request_byte_us = 20;  ///< time of a byte on the wire; 8N1 at 500,000 baud
  double reply_byte_us = 20;
  double skew_sigma_ppm = 3000;  ///< before anything is measured: a resonator's +-5000 ppm
  double wander_ppm = 0.5;       ///< random walk of the skew over one second: it warms up
  double stamp_sigma_us = 4;     ///< of the board's stamps: resolution, interrupts that wait
};

struct ClockReport {
  std::uint32_t exchanges = 0;  ///< in the window
  std::uint32_t accepted = 0;   ///< since the last restart
  std::uint32_t rejected = 0;   ///< since the last restart
  std::uint32_t jumps = 0;      ///< times that the exchanges began to contradict all earlier ones
  double skew_ppm = 0;          ///< the board's clock is faster by so much
  double skew_sigma_ppm = 0;
  double round_trip_us = 0;  ///< the least there can be, without wire and board times
  double one_sided = 0;      ///< part of the jitter on the way back, 0..1 (1/2: as much either way)
  Duration random_sigma{};   ///< of a time one second after the last exchange
  Duration asymmetry_sigma{};
  bool converged = false;  ///< random_sigma is below kConverged
};

/// Offset and skew from two-way exchanges: a Kalman filter over those of the last 30 s, run anew
/// with each one, so that all are weighed by what is known by then.
///
/// The middle of an exchange errs by half the difference of the delays d1, d2 of its two ways. What
/// the round trip exceeds the least one by, e, is their jitter; for exponential or uniform delays
/// the error given e is uniform in +-e/2, so its variance is e^2/12. If the jitter sits on one way
/// (a USB adapter collects bytes on the way back), the error is k e with a constant k, which is the
/// filter's third state. A constant difference of the two ways cannot be seen: half of the least
/// round trip bounds it, and it stands in the sigma until set_asymmetry() tells it.
class ClockSync {
 public:
  static constexpr Duration kWindow = std::chrono::seconds(30);
  static constexpr Duration kConverged = std::chrono::microseconds(250);

  explicit ClockSync(const ClockSyncOptions& options = {}) noexcept : options_(options) {}

  /// The board started anew: everything but the asymmetry is forgotten.
  void restart() noexcept;

  /// False: rejected and counted; it cannot be (a reply before its request, seconds late, or before
  /// the last exchange), or contradicts the others; then the sigma covers by how much.
  bool add(const TimeExchange& exchange) noexcept;

  /// Delay of the way to the board minus delay of the way back, and its standard deviation; from an
  /// event that both clocks saw. Half of it is added to every host time.
  void set_asymmetry(Duration asymmetry, Duration sigma) noexcept {
    asymmetry_ = std::chrono::duration<double>(asymmetry).count();
    asymmetry_sigma_ = std::abs(std::chrono::duration<double>(sigma).count());
  }

  bool known() const noexcept { return count_ > 0; }
  /// The last exchange's; host times are good about here.
  TimePoint latest() const noexcept { return host_reference_; }

  /// Within 35 min of the last exchange, in either direction. Only when known().
  HostTime to_host(std::uint32_t board_us) const noexcept;
  /// The reverse, rounded. Only when known().
  std::uint32_t to_board(TimePoint host) const noexcept;

  ClockReport report() const noexcept;

 private:
  struct Entry {
    std::int64_t board_us2 = 0;  ///< twice the middle, unwrapped
    std::int64_t host_ns = 0;    ///< middle, wire times removed, since the clock's epoch
    double host_span = 0;        ///< s, wire times removed
    double board_span = 0;       ///< s
  };
  struct State {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();  ///< host minus board time since the reference
                                                     ///< (s), its rate, k
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  struct RoundTrip {
    double time = 0;         ///< s, without jitter
    double sigma = 0;        ///< s
    double beyond_zero = 0;  ///< s; the fastest is below zero by so much
  };
  /// Of the exchanges since the last that fitted: what their times may err by.
  struct Misfit {
    double size = 0;  ///< s
    double rate = 0;  ///< s per s from the last exchange
  };
  struct Pass {
    State state;
    std::size_t begin = 0;  ///< entries before it are contradicted by those from it on
    double jump = 0;        ///< s; how much these contradict them
    Misfit misfit;          ///< zero: the last fits
    double surprise = 0;    ///< sum of squared innovations over their variances
    std::size_t fitting = 0;
  };
  static constexpr std::size_t kMaxEntries = 600;
  static constexpr std::size_t kFewForRoundTrip = 8;

  const Entry& entry(std::size_t i) const noexcept { return entries_[(first_ + i) % kMaxEntries]; }
  void append(const Entry& entry) noexcept;
  void drop_oldest(std::size_t count) noexcept {
    first_ = (first_ + count) % kMaxEntries;
    count_ -= count;
  }
  std::int64_t unwrap(std::uint32_t board_us, std::int64_t near_us) const noexcept;
  double round_trip(const Entry& entry) const noexcept {
    return entry.host_span - entry.board_span * (1 + state_.mean[1]);
  }
  RoundTrip least_round_trip() const noexcept;
  /// What a delay might exceed its least by; where the wire times are not as told, either way.
  double excess(const Entry& entry) const noexcept {
    return std::abs(round_trip(entry) - least_.time);
  }
  double offset(const Entry& entry) const noexcept;
  bool begins_anew(const Entry& late) noexcept;
  void refit() noexcept;
  /// One jump is a clock that was set. Two in a window are one that the filter cannot follow.
  void note_jump(double size, std::int64_t host_ns) noexcept {
    const bool again = jumps_ > 0 && std::abs(host_ns - last_jump_ns_) <= kWindow.count();
    unsteady_ = again ? std::max(unsteady_, size) : 0;
    last_jump_ns_ = host_ns;
    ++jumps_;
  }
  Pass pass(double scale) const noexcept;
  void start(State& state, const Entry& entry, double excess) const noexcept;
  void predict(State& state, double seconds) const noexcept;
  double variance_after(double seconds) const noexcept;
  double asymmetry_sigma() const noexcept;

  ClockSyncOptions options_;
  std::array<Entry, kMaxEntries> entries_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  State state_;  ///< at the reference
  std::int64_t board_reference_us2_ = 0;
  TimePoint host_reference_{};
  TimePoint last_sent_{};
  RoundTrip least_;
  Misfit misfit_;
  double unsteady_ = 0;  ///< s; how far the clock jumps, while it does so again and again
  std::int64_t last_jump_ns_ = 0;
  std::size_t out_of_order_ = 0;  ///< exchanges in a row that were before the last
  double asymmetry_ = 0;          ///< s
  double asymmetry_sigma_ = -1;   ///< s; negative: not told
  std::uint32_t accepted_ = 0;
  std::uint32_t rejected_ = 0;
  std::uint32_t jumps_ = 0;
};

// Times of a sensor that counts its samples: from the counter, not from when the bytes came.

/// time = start + period * count, by a Kalman filter over the arrivals; the period is learned
/// around the nominal one. Arrivals are late by a mean that nobody can see here (the sensor's
/// filter, the driver): times are those of a frame that is as late as they are on average.
class CounterClock {
 public:
  explicit CounterClock(double period_s) noexcept : nominal_(period_s) {}

  /// Of a sample that was there at `arrival`. A counter that does not go on, or arrivals that do
  /// not fit for half a second, start it anew.
  HostTime take(std::uint16_t counter, TimePoint arrival) noexcept;
  void restart() noexcept { known_ = false; }

  double period() const noexcept { return known_ ? state_[1] : nominal_; }
  std::uint32_t restarts() const noexcept { return restarts_; }

 private:
  void start(std::uint16_t counter, TimePoint arrival) noexcept;
  HostTime now() const noexcept;

  double nominal_;
  bool known_ = false;
  TimePoint reference_{};
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();  ///< time of the last sample since the
                                                     ///< reference (s), period (s)
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
  double jitter_variance_ = 0;  ///< of arrivals, s^2
  std::uint16_t last_ = 0;
  unsigned misfits_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace tagwrench::link

// Seeded random numbers that are the same on every machine; the standard library's distributions
// are not.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace tagwrench::sim {

/// SplitMix64 (Steele, Lea, Flood 2014). Streams with different names never share numbers in
/// practice.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) noexcept
      : state_(seed * 0x9e3779b97f4a7c15ULL + (stream + 1) * 0xd1342543de82ef95ULL) {
    next();
  }

  /// One of many from the same seed and stream. (Seeds that follow each other give the same
  /// numbers, one apart.)
  static Random numbered(std::uint64_t seed, std::uint64_t stream, std::uint64_t number) noexcept {
    Random random(seed, stream);
    random.state_ ^= number * 0xd1342543de82ef95ULL;
    random.state_ = random.next();
    return random;
  }

  std::uint64_t next() noexcept {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

  /// In [0, 1).
  double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }

  /// The position-th of `count` things (up to 16) in an order shuffled anew for each round of them:
  /// number 0, 1, 2 ... visits every thing once a round.
  static int shuffled(std::uint64_t seed, std::uint64_t stream, std::uint64_t number,
                      int count) noexcept {
    const auto things = static_cast<std::uint64_t>(count);
    Random random = numbered(seed, stream, number / things);
    std::array<int, 16> order{};
    for (int i = 0; i < count; ++i) {  // Fisher and Yates, inside out
      const int other = static_cast<int>(random.uniform(0, i + 1));
      order[static_cast<std::size_t>(i)] = order[static_cast<std::size_t>(other)];
      order[static_cast<std::size_t>(other)] = i;
    }
    return order[number % things];
  }

  /// Standard normal (Box and Muller).
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

/// Who draws from the scenario's seed; one stream each, so that a change in one leaves the others
/// alone.
// clang-format off
enum Stream : std::uint64_t {
  kPlacement = 1, kMotion, kPlate, kNoiseTable, kNoiseOffsets,
  kHardMotion, kHardMotionOrder, kDisturbances, kDisturbanceOrder, kDirt, kLostFrames,
  kDeliveryJitter, kStaleFrames,
  kBenchMass, kBenchPoint, kBenchMounting, kBenchAction, kBenchStroke, kBenchHand,
  kLoadCell, kSixAxis, kBenchString, kDeskActs, kDeskWander, kPrintFault,
  kPrint = 100
};
// clang-format on

}  // namespace tagwrench::sim

// The person at the simulated bench: mounts the sensor, hangs masses, pushes with a load cell,
// moves the platform by hand; in simulation time, with a hand's and a scale's imperfections.
//
// An order given now is begun after the reaction time, counted from the newest instant that anyone
// has asked about. What is on the platform by an earlier order is taken off first. Nothing here
// shares mathematics with the room that calibrates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/random.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench::sim {

class Bench final : public AppliedLoad {
 public:
  /// The sensor stands on the table, the camera looks up: gravity along -z, but for the error of
  /// its mounting. `settings` must have no problem().
  Bench(const BenchSettings& settings, std::uint64_t seed);

  // Orders.

  /// Mounts the sensor so that gravity pulls along `gravity` (camera axes; any length but 0).
  void turn(const Eigen::Vector3d& gravity) noexcept;
  /// Hangs `mass` (kg) by a string from a point of the platform (platform frame, m). It pulls with
  /// m g along true gravity at the point as it moves with the platform, M = (p + d + r x p) x F to
  /// all orders; it swings, and the string's pull with it, until that has decayed. The mass's
  /// inertia does not load the platform otherwise.
  void hang(double mass, const Eigen::Vector3d& point) noexcept;
  /// Presses the load cell against a point along `direction` (of the force on the platform, camera
  /// axes), up to `peak` N: `strokes` times from nothing to about the peak and back, each slowly
  /// and not quite alike, never pulling, within `seconds`. The point moves with the platform.
  void push(const Eigen::Vector3d& point, const Eigen::Vector3d& direction, double peak,
            double seconds, int strokes = 3) noexcept;
  /// Compound motion of the hand on all six axes within `amplitude` (N and N m about the platform
  /// origin at rest), up to `bandwidth` Hz.
  void move_about(const Vector6& amplitude, double seconds, double bandwidth = 1.0) noexcept;
  /// Takes off whatever hangs there, ends a push or a movement.
  void let_go() noexcept { begin_order(); }

  /// The person still has hands on it: the order is not begun, or the sensor is being turned, the
  /// mass hung, the push going on. A mass may swing afterwards.
  bool busy() const noexcept { return newest_ < done_; }
  /// Orders given so far.
  int orders() const noexcept { return orders_; }

  // The truth, for tests and benchmarks.

  /// Unit vector along which masses truly pull now, camera axes.
  Eigen::Vector3d true_gravity() const noexcept { return gravity(newest_); }
  /// What `mass` on the plan's list truly is, kg; and where a point truly is, but for the contact.
  double true_mass(double mass) const noexcept;
  Eigen::Vector3d true_point(const Eigen::Vector3d& point) const noexcept;

  // AppliedLoad.
  Vector6 wrench(double time, const Vector6& displacement) noexcept override;
  Eigen::Vector3d gravity_change(double time) noexcept override;
  Vector6 rest_change(double time) noexcept override;
  Eigen::Vector3d slip(int tag, double time) noexcept override;

  // What reference instruments feel.

  /// Newest instant that anyone has asked about, s of simulation time.
  double newest() const noexcept { return newest_; }
  /// Says that simulation time has come this far where nothing integrates the platform.
  void pass(double time) noexcept { newest_ = time > newest_ ? time : newest_; }
  /// The force with which the load cell is pressed, N: 0 or more. At any time from the last order
  /// on.
  double cell_force(double time) const noexcept;
  /// The wrench on the platform as it was applied, from `oldest_felt()` to `newest_felt()`; beyond,
  /// at the nearer end.
  Vector6 felt(double time) const noexcept;
  double oldest_felt() const noexcept {  ///< minus infinity as long as nothing was forgotten
    return felt_count_ <= felt_.size() ? -kNever : felt_at(felt_count_ - felt_.size()).time;
  }
  double newest_felt() const noexcept {
    return felt_count_ == 0 ? 0 : felt_at(felt_count_ - 1).time;
  }

  const BenchSettings& settings() const noexcept { return settings_; }
  std::uint64_t seed() const noexcept { return seed_; }

 private:
  static constexpr std::size_t kActions = 8;    ///< that may still matter to the latest frame
  static constexpr double kMemory = 2.0;        ///< s of felt wrenches
  static constexpr double kFeltStep = 0.15e-3;  ///< s, least time between two of them

  enum class What : std::uint8_t { nothing, mass, push, hand };
  struct Action {
    What what = What::nothing;
    std::uint64_t number = 0;                             ///< what it draws its random numbers by
    double begin = kNever;                                ///< s
    double length = kNever;                               ///< s, of a push or a movement
    double end = kNever;                                  ///< s, when it begins to be taken off
    double ease_in = 0;                                   ///< s
    double ease_out = 0;                                  ///< s
    Eigen::Vector3d point = Eigen::Vector3d::Zero();      ///< where it truly is, platform frame, m
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< of a push, unit
    double size = 0;                                      ///< kg of a mass, N of a push
    int strokes = 1;
    std::array<double, 2> sway_hz{}, sway_phase{};
    std::array<double, 2> lean{};  ///< of a string, rad
    double tremor_hz = 0;
    double tremor_phase = 0;
    std::optional<TrajectoryPlayer> hand;
  };
  struct Turn {
    double begin = -kNever;
    Eigen::Vector3d from = -Eigen::Vector3d::UnitZ();  ///< unit vectors
    Eigen::Vector3d to = -Eigen::Vector3d::UnitZ();
  };
  struct Felt {
    double time = 0;
    Vector6 wrench = Vector6::Zero();
  };

  /// When the order being given is begun; whatever is there is off by then.
  double begin_order() noexcept;
  Action& add(What what, double begin) noexcept;
  Eigen::Vector3d touched(const Eigen::Vector3d& point, std::uint64_t number) const noexcept;
  Eigen::Vector3d mounted(const Eigen::Vector3d& gravity) noexcept;
  Eigen::Vector3d gravity(double time) const noexcept;
  double hands(const Action& action, double time) const noexcept;
  double tremor(const Action& action, double time) const noexcept;
  double push_force(const Action& action, double time) const noexcept;
  Eigen::Vector3d push_direction(const Action& action, double time) const noexcept;
  Eigen::Vector3d string_pull(const Action& action, double time) const noexcept;
  Vector6 wrench_of(const Action& action, double time, const Vector6& displacement) const noexcept;
  void remember(double time, const Vector6& wrench) noexcept;
  const Felt& felt_at(std::uint64_t number) const noexcept { return felt_[number % felt_.size()]; }

  BenchSettings settings_;
  std::uint64_t seed_;
  double newest_ = 0;
  double done_ = 0;  ///< the person's hands are off from then on
  int orders_ = 0;
  int masses_ = 0;
  std::uint64_t mountings_ = 0;
  std::uint64_t acts_ = 0;
  std::array<Action, kActions> actions_;
  std::array<Turn, 2> turns_;  ///< the one before, and the latest
  Eigen::Vector3d gravity_at_start_;
  double bump_time_ = kNever;
  double slip_time_ = kNever;
  std::vector<Felt> felt_;
  std::uint64_t felt_count_ = 0;
};

// The reference instruments at the simulated bench, each with its own rate, lag, noise and steps.

struct SimulatedReading {
  double time = 0;                ///< s of simulation time, as the instrument stamps it
  std::array<double, 6> value{};  ///< N; of six axes N and N m about its own origin, camera axes
  std::array<double, 6> sigma{};  ///< one standard deviation of the noise, steps included
  std::uint8_t axes = 0;          ///< 1 or 6
  bool saturated = false;
};

/// Ticks of an instrument's own clock, and what is wrong with it.
class ReferenceTicks {
 public:
  /// The first comes within a period of time 0, drawn from the instrument's `stream`.
  ReferenceTicks(double rate, std::uint64_t seed, Stream stream,
                 const ReferenceFaults& faults) noexcept
      : period_(1 / rate),
        first_(Random::numbered(seed, stream, kFirstTick).uniform() / rate),
        time_(first_),
        faults_(faults) {}
  double time() const noexcept { return time_; }  ///< of the next reading, s, true
  double stamp() const noexcept {                 ///< what it says
    return time_ * (1 + 1e-6 * faults_.clock_ppm) + faults_.clock_offset;
  }
  bool silent() const noexcept { return time_ >= faults_.silent_from && time_ < faults_.silent_to; }
  void advance() noexcept { time_ = first_ + static_cast<double>(++count_) * period_; }

 private:
  static constexpr std::uint64_t kFirstTick = 1'000'000;  ///< number in the seed's stream
  double period_, first_, time_;
  std::uint64_t count_ = 0;
  ReferenceFaults faults_;
};

/// Feels the force with which it is pressed against the platform.
class SimulatedLoadCell {
 public:
  /// Borrows the bench.
  explicit SimulatedLoadCell(const Bench& bench);

  /// Takes the next reading up to the bench's newest instant; false if there is none.
  bool next(SimulatedReading& reading) noexcept;

 private:
  const Bench& bench_;
  LoadCellSettings settings_;
  ReferenceTicks ticks_;
  Random random_;
  double scale_ = 1;
};

/// Sits under the sensor, its axes along the camera's, and feels what is applied to the platform:
/// F, and M - origin x F. It was zeroed with the sensor on it. The platform's inertia (F = m a,
/// less than 1 mN at hand speeds) and what the sensor's weight does after a turn are left out.
class SimulatedSixAxis {
 public:
  /// Borrows the bench.
  explicit SimulatedSixAxis(const Bench& bench);

  /// As above; what nobody took within the bench's memory is lost.
  bool next(SimulatedReading& reading) noexcept;

 private:
  void filter_to(double time) noexcept;

  const Bench& bench_;
  SixAxisSettings settings_;
  ReferenceTicks ticks_;
  Random random_;
  double delay_;            ///< s before the filter
  Eigen::Vector3d origin_;  ///< where it really is
  Eigen::Matrix3d reference_R_platform_ = Eigen::Matrix3d::Identity();
  double filtered_to_ = 0;  ///< s, true time of the load that the filter has taken
  Vector6 filtered_ = Vector6::Zero();
};

}  // namespace tagwrench::sim

// The plan of a calibration: which known loads act along which lines, one after the other; a plan
// file -> WrenchPlan, and the ready-made plans that are part of the program. Then the load that a
// step stands for, with what is not known of it; which loads a calibration has seen so far, and
// which are still guessed.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/axis_names.h"
#include "host/core/types.h"
#include "host/wrench/fit.h"

namespace tagwrench {

/// Where a load takes hold of the platform.
struct PlanPoint {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< platform frame, m
  double sigma = 0.3e-3;                               ///< of each coordinate, m
};

/// How the sensor is fixed.
struct Mounting {
  std::string name;
  Eigen::Vector3d gravity{0, 0, -1};  ///< unit vector along which masses pull, camera axes
  double sigma = 0.02;                ///< of its direction, rad
  std::string say;                    ///< how to fix it, for people
};

enum class StepKind : std::uint8_t {
  rest,      ///< nobody touches it: the zero of the steps that follow in this mounting
  mass,      ///< a mass hangs from a point
  push,      ///< the hand pushes a point with the load cell, along a line
  six_axis,  ///< the hand moves the platform every way, a six-axis reference underneath
};

struct PlanStep {
  StepKind kind = StepKind::rest;
  std::string say;   ///< what to do now, for people
  int mounting = 0;  ///< index
  int visit = 0;     ///< counts the changes of mounting: steps of one visit share a zero
  int point = -1;    ///< index; -1: none
  double mass = 0;   ///< kg
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< of a push's force on the platform: unit
  double seconds = 0;  ///< how long a push or a movement is taken; 0 for holds
  double force = 0;    ///< of a push: as hard as this, N
};

/// Which instrument tells the load.
enum class ReferenceKind : std::uint8_t { masses, load_cell, six_axis };

struct WrenchPlan {
  std::string name;
  std::string about;  ///< one line: what is needed
  int minutes = 0;    ///< that a person takes, about; 0: nobody says
  ReferenceKind reference = ReferenceKind::masses;
  int cell_channel = 0;       ///< of a load cell
  double mass_sigma = 0.005;  ///< relative, of each mass
  double gravity = 9.80665;   ///< m/s^2
  double line_sigma = 0.03;   ///< of a push's direction, rad
  /// Of a six-axis reference: where its torque counts from, platform frame, m; and its axes.
  Eigen::Vector3d reference_origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d camera_R_reference = Eigen::Matrix3d::Identity();
  double reference_sign = 1;  ///< -1: it feels what the platform's base does to it
  std::vector<PlanPoint> points;
  std::vector<Mounting> mountings;
  std::vector<PlanStep> steps;

  const PlanStep& step(int index) const { return steps[index]; }
  const PlanPoint& point_of(const PlanStep& step) const { return points[step.point]; }
  const Mounting& mounting_of(const PlanStep& step) const { return mountings[step.mounting]; }
};

/// "step 7 (50 g at left, on its right side)", counted from 1.
std::string describe(const WrenchPlan& plan, int step);

/// What to do now, for people: how to fix the sensor where that has changed, and the load.
std::string instruction(const WrenchPlan& plan, int step, bool new_mounting);

/// Throws ConfigError: "file:line: key: what is wrong and what to do". Keys, with their defaults in
/// brackets:
///
///   about: one line for people
///   minutes [0]: that a person takes, about; 0: nobody says
///   reference: masses | load_cell | six_axis
///   gravity_m_s2 [9.80665], mass_sigma_percent [0.5]
///   cell_channel [0], line_sigma_deg [1.5]                 of pushes with a load cell
///   reference_origin_mm [0 0 0], reference_rotation_rad [0 0 0], reference_sign [1]
///                                                  of a six-axis reference, in the platform frame
///   points:    [{name, position_mm: [x, y, z], sigma_mm [0.3]}]
///   mountings: [{name, say, gravity: [x, y, z], sigma_deg [1], steps: [...]}]
///   a step:    {do: rest} | {do: mass, mass_g, at} | {do: push, at, along: [x, y, z], up_to_n,
///              seconds [8]} | {do: move, seconds}, each with its own `say` if that is clearer
///
/// The sensor is used as the first mounting has it. Each mounting begins with a rest.
WrenchPlan parse_plan(const std::string& text, const std::string& name);

struct ReadyPlan {
  std::string name, text;
};
const std::vector<ReadyPlan>& ready_plans();

/// The text of a ready-made plan or, if there is none of that name, of a file. Throws ConfigError.
std::string plan_text(const std::string& name_or_file);

/// What is known of a load: N, N m about the platform origin at rest, camera axes.
struct KnownLoad {
  Vector6 wrench = Vector6::Zero();
  Matrix6 covariance = Matrix6::Zero();
};

/// A mass that hangs from a point of the platform, which has moved with it: F = m g u, M = p x F.
/// Sets the wrench's part of the observation.
void set_hanging(const WrenchPlan& plan, int step, const Vector6& displacement,
                 Observation& observation);

/// What a load cell tells of a push along the step's line: N, its noise, and the relative standard
/// deviation of its calibration, common to all pushes.
struct CellForce {
  double value = 0, noise = 0, gain_sigma = 0;
};
void set_push(const WrenchPlan& plan, int step, const CellForce& force, const Vector6& displacement,
              Observation& observation);

/// What a six-axis reference tells (N, N m), moved from its own origin, axes and sign to the
/// platform's.
void set_six_axis(const WrenchPlan& plan, const Vector6& value, const Vector6& sigma,
                  Observation& observation);

/// A reading of a six-axis reference as a wrench on the platform.
Vector6 six_axis_wrench(const WrenchPlan& plan, const Vector6& value);

/// The load that a step is expected to bring, before it is measured; zero for rests and for
/// movements by hand.
KnownLoad expected_load(const WrenchPlan& plan, int step);

/// The displacement is linear in the load, so that each known load w tells the response along
/// itself: information w w^T / s^2 on every row of the compliance, where s is what is not known of
/// the load. With a prior from the spring model (the response along each axis is known to 30 %),
/// its inverse is the variance with which a load of full range along any direction would be told
/// (Bayesian linear regression: Gelman et al., Bayesian Data Analysis, 14.8).
class WrenchCoverage {
 public:
  static constexpr double kPrior = 0.3;    ///< of full load, known from the springs alone
  static constexpr double kCovered = 0.1;  ///< of full load: better than this is measured

  /// `range`: full load per axis, N and N m.
  explicit WrenchCoverage(const Vector6& range);

  void add(const KnownLoad& load);
  /// Six-axis loads come by the hundred, each by the same instrument: all together count as one
  /// with this standard deviation, share of range.
  static constexpr double kMovementSigma = 0.02;
  void add_movement(const Matrix6& second_moment);
  /// What a step will have told when it is done. Movements by hand are taken to load every axis to
  /// half of its range.
  void add_expected(const WrenchPlan& plan, int step);

  /// Standard deviation with which a full load on each axis would be told, share of that load.
  Vector6 sigma() const { return posterior().diagonal().cwiseSqrt(); }
  /// Share of what the springs leave open that is measured: 0..1 per axis.
  Vector6 covered() const { return (1 - sigma().array() / kPrior).max(0).matrix(); }
  /// Whether every direction is measured.
  bool complete() const { return missing().empty(); }
  /// One line per direction that is not: "no load twists about z: Mz".
  std::vector<std::string> missing() const;
  /// How much the sum of the six variances would fall: 0..1.
  double gain(const KnownLoad& load) const;

 private:
  Matrix6 posterior() const;
  /// Relative load and its information along itself.
  Vector6 scaled(const KnownLoad& load) const { return load.wrench.cwiseQuotient(range_); }
  double relative_variance(const KnownLoad& load) const;

  Vector6 range_;
  Matrix6 information_;
};

/// What a plan will have covered when all is done.
WrenchCoverage coverage_of(const WrenchPlan& plan, const Vector6& range);

}  // namespace tagwrench

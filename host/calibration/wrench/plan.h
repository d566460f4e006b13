// The plan of a calibration: which known loads act along which lines, one after the other; a plan
// file -> WrenchPlan, and the ready-made plans that are part of the program.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/axis_names.h"
#include "host/core/types.h"

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

  const PlanStep& step(int index) const { return steps[static_cast<std::size_t>(index)]; }
  const PlanPoint& point_of(const PlanStep& step) const {
    return points[static_cast<std::size_t>(step.point)];
  }
  const Mounting& mounting_of(const PlanStep& step) const {
    return mountings[static_cast<std::size_t>(step.mounting)];
  }
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
  std::string name;
  std::string text;
};
const std::vector<ReadyPlan>& ready_plans();

/// The text of a ready-made plan or, if there is none of that name, of a file. Throws ConfigError.
std::string plan_text(const std::string& name_or_file);

}  // namespace tagwrench

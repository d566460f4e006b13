// A plan file -> WrenchPlan, and the ready-made plans that are part of the program.
#pragma once

#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"

namespace tagwrench {

/// Throws ConfigError: "file:line: key: what is wrong and what to do". Keys, with their defaults in
/// brackets:
///
///   about: one line for people
///   minutes [0]: that a person takes, about; 0: nobody says
///   reference: masses | load_cell | six_axis
///   gravity_m_s2 [9.80665], mass_sigma_percent [0.5]
///   cell_channel [0], line_sigma_deg [1.5]                 of pushes with a load cell
///   reference_origin_mm [0 0 0], reference_rotation_rad [0 0 0], reference_sign [1]   of a
///   six-axis
///                                                          reference: its pose in the platform
///                                                          frame
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

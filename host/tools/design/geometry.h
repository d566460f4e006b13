// Where everything of a chosen sensor is, how far it moves, and what it bears: from the parameters
// alone, pure. The drawing takes its heights from here, so that the checks see what is printed.
// Then whether it can be built (checks.cpp), and its drawing (drawing.cpp).
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/tools/design/design.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/edges.h"
#include "host/wrench/estimate.h"

namespace tagwrench::hardware {

/// In the drawing frame.
struct Mirror : study::MirrorPlane {
  /// The piece that the camera needs of it over the whole travel: its middle, and its half size
  /// along the slope and along y.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double half_slope = 0, half_y = 0;
};

struct TagPlace {
  int id = 0;
  Eigen::Isometry3d platform_T_tag = Eigen::Isometry3d::Identity();
  bool in_mirror = false;  ///< seen in Geometry::mirror only
};

/// Heights above the lower face of the mounting plate (m), unless it says otherwise.
struct Geometry {
  double board_bottom = 0, board_top = 0;
  double lens_front = 0, pupil = 0;
  double ledge = 0;      ///< top of the cover's lower part
  double cover_top = 0;  ///< where the springs begin
  double platform = 0;   ///< origin of the platform frame: the middle of the tags
  double plate_bottom = 0, plate_top = 0;
  double shield_bottom_x = 0, shield_bottom_y = 0;  ///< of its walls across x, across y
  double top = 0;
  double bottom = 0;  ///< of the whole: below zero where a base holds more than the plate

  double spring_attachment = 0;       ///< where their full length ends, platform frame
  double spring_clear = 0;            ///< length between the parts that they are glued into
  double spring_solid = 0;            ///< length with the coils closed
  double window_x = 0, window_y = 0;  ///< half width of the plate's opening for the tags
  double inner_x_from = 0, inner_x_to = 0, inner_y = 0;  ///< of the shield; to: open end
  double bore = 0;                        ///< radius of the cover's hole over the lens
  double socket = 0;                      ///< radius of the holes that springs are glued into
  double plate_x = 0, plate_y = 0;        ///< half size of the plate that the springs carry
  double overhang_x = 0, overhang_y = 0;  ///< most that the ledge stands out from the cover's block
  double bolt_length = 0;                 ///< of those that hold plate, camera and cover together

  std::vector<TagPlace> tags;
  std::optional<Mirror> mirror;
  std::vector<Eigen::Vector2d> springs;     ///< axes
  std::vector<Eigen::Vector2d> bolts;       ///< through plate, camera and cover
  std::vector<Eigen::Vector2d> top_screws;  ///< through the roof into the plate
  /// Where stop screws reach into the cover's face, and the axis (0 x, 1 y) along which they point.
  struct StopScrew {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    int along = 0;
    double reach = 0;   ///< into the cover, at rest
    double length = 0;  ///< under its head, as sold
    double head = 0;    ///< distance of the head's seat from the cover's face
  };
  std::vector<StopScrew> stop_screws;
};

Geometry geometry(const Parameters& parameters);

/// Drawing frame <- platform frame, displaced from rest (m, rotation vector in rad).
Eigen::Isometry3d platform_pose(const Geometry& geometry, const Vector6& displacement);

/// The parts to print, by their names in hardware/scad/sensor.scad.
std::vector<std::string> printed_parts(const Parameters& parameters);

/// Lateral over axial stiffness of a helical spring clamped at both ends, of this length and mean
/// diameter: as a beam whose bending stiffness is that of the helix and whose coils shear. 1/ratio
/// = 0.295 (l/D)^2 + 0.385 with steel's Poisson ratio (Haringx; Wahl, Mechanical Springs, ch. on
/// lateral loading has 1.44 (0.204 (l/D)^2 + 0.265)).
double lateral_ratio(double length, double mean_diameter);

/// The four, each a helix that bends and twists as well (Wahl, Mechanical Springs, ch. 6 and 15).
Springs springs(const Parameters& parameters, const Geometry& geometry);

/// About the platform's origin, camera axes; of the four springs.
Matrix6 stiffness(const Parameters& parameters, const Geometry& geometry);

/// Largest force or torque along each axis alone, either way, before a stop is met, N and N m.
Vector6 range(const Parameters& parameters, const Geometry& geometry);

/// Displacements (m, rad) at which a stop is about to be met: 8 corners of the travel, turning
/// about each axis, and what the largest force or torque along each axis does, both ways.
std::vector<Vector6> travel_corners(const Parameters& parameters, const Geometry& geometry);

// When what moves meets what stands still: the stop screws in their slots, the hood and the cover.

/// Whether something has met under this displacement (m, rotation vector in rad), turned in full:
/// at 5 degrees what small angles leave out is as much as a twentieth of the travel.
bool stopped(const Parameters& parameters, const Geometry& geometry, const Vector6& displacement);

/// The part of the travel that a displacement takes: 1 where, on its way from rest or on the way
/// opposite, something is about to be met.
double share_of_travel(const Parameters& parameters, const Geometry& geometry,
                       const Vector6& displacement);

// Can it be built, and will it work? Each complaint names the parameter as the file writes it.

struct Complaint {
  std::string parameter;  ///< "target.lens_distance_mm"
  std::string message;    ///< what is wrong and what to do
};

/// Empty: it can be built. Looked at over the whole travel: walls and the nozzle, room for springs,
/// lens and LED, springs before they are solid, tags inside the picture and not hidden by springs,
/// cover, plate or the mirror's holder, the lens' focus.
std::vector<Complaint> complaints(const Parameters& parameters, const Geometry& geometry);

/// Where a point of the drawing is seen, px. Behind the lens: not finite.
Eigen::Vector2d seen_at(const Parameters& parameters, const Geometry& geometry,
                        const Eigen::Vector3d& point);

/// The corners of all papers, displaced, drawing frame; those of a tag in the mirror where they
/// seem to be.
std::vector<Eigen::Vector3d> paper_corners(const Parameters& parameters, const Geometry& geometry,
                                           const Vector6& displacement);

/// By how much a helical spring may be shortened before it gives way sideways, m; `length` and
/// `mean_diameter` of the free coils, clamped at both ends, one of which moves sideways. Steel;
/// EN 13906-1, critical deflection with seating coefficient 1. Infinite: never.
double buckling_deflection(double length, double mean_diameter);

// Where a known weight is hung from a finished sensor.

/// Of the thread, which lies between a screw's head and the wall.
constexpr double kThreadOffWall = 0.5e-3;

/// Right (+x), left, lower (+y), upper; platform frame. In the middle of the roof's edges, half-way
/// up, or in a knob's side at the height of the tags.
std::array<Eigen::Vector3d, 4> load_points(const Parameters& parameters, const Geometry& geometry);

/// What to hang there, kg: the largest usual weight that stays clear of the stops in every
/// direction, with force and torque together.
double load_mass(const Parameters& parameters, const Geometry& geometry);

/// The sensor as OpenSCAD takes it, every number that the parts need, in mm and degrees.
/// Assignments, one a line: of what stands in the file under its own name without the unit
/// (`springs_free_length = 25.4;`), and of what follows from it (`z_cover_top = ...;`).
/// `patterns`: what is printed on each of the geometry's tags.
std::string scad_parameters(const Parameters& parameters, const Geometry& geometry,
                            const std::vector<TagPattern>& patterns);

}  // namespace tagwrench::hardware

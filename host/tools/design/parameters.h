// A sensor as its builder chooses it: what stands in hardware/sensors/NAME.yaml, in SI units. The
// parts to print, sensor.yaml, the simulator and the design tables all follow from this.
//
// Drawing frame: the camera's axes (x along the long side of the board, z up, away from the lens),
// origin under the lens on the lower face of the mounting plate.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "host/source/simulator/scenario.h"
#include "host/tracker/camera_model.h"

namespace tagwrench::hardware {

enum class CameraBody : std::uint8_t { board, barrel };

/// A camera module: a board with a lens on it, or a barrel (endoscope) that is all lens.
struct CameraBoard {
  std::string name;  ///< of hardware/cameras/NAME.yaml
  std::string about;
  CameraBody body = CameraBody::board;
  double width = 0, depth = 0, thickness = 0;  ///< along x, y, z; of a barrel: its diameter twice,
                                               ///< and the length that is clamped
  double hole_spacing_x = 0, hole_spacing_y = 0;  ///< of the four mounting holes; 0: none
  double hole = 2.2e-3;      ///< diameter; of a barrel, of the bolts into its block
  double below = 0;          ///< free height that parts and plug take under the board
  double plug_width = 0;     ///< of the cable's plug, which leaves towards -x
  double lens_diameter = 0;  ///< of the lens holder at its widest
  double lens_height = 0;    ///< of the front above the board
  double pupil_depth = 0;    ///< of the point where rays meet, behind the front
  double nearest_focus = 0;  ///< that turning the lens reaches
  double price = 0;          ///< US dollars, as in the bill of materials
  double frame_rate = 25;    ///< Hz, in the mode below
  CameraModel image;         ///< nominal: focal length, size
};

enum class TagLayout : std::uint8_t {
  roof,    ///< two tags, above and below a ridge towards the camera
  slope,   ///< one, inclined as the upper half of the roof
  mirror,  ///< one flat, facing the camera; one sideways, seen in a mirror at 45 degrees
};

struct TargetChoice {
  std::string family = "aruco_original";
  TagLayout layout = TagLayout::roof;
  std::vector<int> ids{5, 2};
  double tag_size = 0, border = 0;
  double angle = 0;          ///< of the roof's sides to the plate, rad
  double ridge_gap = 0;      ///< from the ridge to each paper
  double lens_distance = 0;  ///< from the point where rays meet to the middle of the tags
};

struct SpringChoice {
  double free_length = 0, outer_diameter = 0, wire = 0;
  double axial = 0;    ///< of each, N/m
  double lateral = 0;  ///< of each, N/m; without a number in the file that of the helix
  double spacing_x = 0, spacing_y = 0;
  double socket = 0;  ///< glued depth at each end
  double price = 0;   ///< of four, US dollars
};

/// Free travel from rest to the stops, each way.
struct Stops {
  double x = 0, y = 0, z = 0;
  double gap = 0;          ///< between the walls and the cover; not less than the travel
  double screw = 3e-3;     ///< diameter of the screws that stop
  double thread_hole = 0;  ///< for them in the shield: to cut into plastic, or for an insert
  double grip = 1e-3;      ///< they still reach into the cover at the end of the travel
};

struct Printing {
  double nozzle = 0.4e-3, layer = 0.2e-3;
  double wall = 0;          ///< of the shield
  double clearance = 0;     ///< between parts that are put together
  double density = 1.24e3;  ///< kg/m^3, of PLA
};

/// What the hand or the gripper takes hold of.
struct Top {
  bool knob = false;         ///< or a box, open where walls are missing
  int walls = 3;             ///< 3: open towards +x
  double plate = 0;          ///< thickness of the plate that the springs carry
  double roof = 0;           ///< thickness above it
  double knob_diameter = 0;  ///< of a knob
  double screw = 0;          ///< diameter of the two that hold it to the plate
  double thread_hole = 0;    ///< for them in the plate
};

struct Cover {
  double x_from = 0, x_to = 0;  ///< of the upper block
  double y_half = 0;
  double ledge = 0;  ///< height of the lower part, as wide as the board, above the board; of a
                     ///< barrel's block, above the mounting plate
  double thread_hole = 0;  ///< for the bolts through the camera's holes
  double wall = 0;
};

struct Mount {
  bool puck = false;      ///< a round base that holds the board with the LED driver, or ears
  double thickness = 0;   ///< of the plate under the camera
  double width = 0;       ///< over the ears; diameter of a round base
  double hole = 0;        ///< diameter of the holes in the ears
  double bay_height = 0;  ///< of a round base: room under the plate
  double weight = 0;      ///< kg, put into it
};

struct Light {
  double width = 0, height = 0;  ///< of the LED's seat
  double x = 0, y = 0;           ///< of its middle
  double diffuser = 0;           ///< thickness of the wall that it shines through
};

/// What moves, as printed.
struct Moving {
  double mass = 0;                                    ///< kg
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< platform frame
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();  ///< principal, about the centre, kg m^2
};

struct Parameters {
  std::string name, about;
  CameraBoard camera;
  TargetChoice target;
  SpringChoice springs;
  Stops stops;
  Printing printing;
  Top top;
  Cover cover;
  Mount mount;
  Light light;
  Moving moving;
};

}  // namespace tagwrench::hardware
namespace tagwrench {

// hardware/sensors/NAME.yaml -> hardware::Parameters, and what a simulator makes of them. Every
// check of a single value is here; whether they go together, host/tools/design/geometry.h says.

/// The camera comes from ../cameras/NAME.yaml, seen from the file. Throws ConfigError with file,
/// line and key.
hardware::Parameters load_hardware(const std::string& path);

/// The same, and it can be built. Throws ConfigError naming the first parameter that is in the way.
hardware::Parameters load_buildable(const std::string& path);

/// Whether a file describes hardware, and not a scenario or a sensor: by its keys.
bool is_hardware(const std::string& path);

/// The simulated sensor, built without errors but for gluing; all its tags, as if there were no
/// mirror.
sim::Scenario scenario_of(const hardware::Parameters& parameters);

/// The same with those tags alone that the program follows: none in a mirror.
sim::Scenario runnable_scenario_of(const hardware::Parameters& parameters);

}  // namespace tagwrench

// Room source/simulator: a sensor that is not there, with its print, light, lens, noise and hand.
// In:  a scenario; time. Out: frames as a camera delivers them, and the truth (m, rad, N, N m).
// It shares no mathematics with tracker and wrench: shared errors would cancel.
// Then: simulator_source.h, renderer.h, mechanics.h, trajectory.h, bench.h.
//
// Everything that can be set about the simulated sensor. Scenario{} is the sensor of Ouyang & Howe
// (ICRA 2020): a camera 21 mm below a roof with two hand-glued tags, on a platform that four
// compression springs carry.
//
// SI units unless the name carries another one. Frames as in host/core/types.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host/source/simulator/bench_settings.h"
#include "host/source/simulator/disturbances.h"

namespace tagwrench::sim {

// How an hour at the desk goes (desk_use.h); used where trajectory.motion is `desk`.

struct DeskSettings {
  double length = 3600;        ///< s, after the first rest; then nothing happens any more
  double gesture_share = 0.2;  ///< of what the person does
  double wander = 0.015;       ///< largest way of the zero, of the range
  double knock = 5.0;          ///< m/s^2, largest acceleration of the table; most are far smaller
};

/// Four equal helical springs between base and platform, axes along z. Seen from its elastic centre
/// (mid-length), a fixed-fixed spring is uncoupled: three forces against three translations, three
/// moments against three rotations.
struct Mechanics {
  double mass = 0.010;                                      ///< of the platform, kg
  Eigen::Vector3d centre_of_mass{0, 0, 4.0e-3};             ///< platform frame, m
  Eigen::Vector3d principal_inertia{1.0e-6, 1.3e-6, 2e-6};  ///< about the centre of mass, kg m^2
  double damping_ratio = 0.06;                              ///< of every mode

  double spring_half_spacing_x = 7.5e-3;  ///< spring axes at +-x, +-y, m
  double spring_half_spacing_y = 6.5e-3;
  double spring_length = 25.4e-3;       ///< m
  double spring_attachment_z = 1.8e-3;  ///< where the springs meet the platform, platform frame, m
  double axial_stiffness = 700;         ///< each, N/m
  double lateral_stiffness = 70;        ///< each, N/m
  /// Each, N m/rad. Both follow from the axial stiffness k of the same helix with mean diameter D
  /// = 4.04 mm and steel's Poisson ratio v = 0.3, whatever the wire and the number of coils:
  /// bending k D^2 (1+v) / (2 (2+v)), torsion k D^2 (1+v) / 4 (Wahl, Mechanical Springs).
  double bending_stiffness = 3.23e-3;
  double torsion_stiffness = 3.71e-3;

  std::array<double, 6> range{0.9,   0.9,   2.5,
                              0.016, 0.016, 0.009};  ///< usable range, N and N m, told to the user

  // What real springs and glue add to Hooke's law; none of it by default.

  /// Under a constant load the displacement grows by this share of what it was at first, as 1 -
  /// exp(-t / creep_time).
  double creep_share = 0;
  double creep_time = 60;  ///< s
  /// Dry friction beside the springs: on each axis up to this share of the range, which gives a
  /// loop of twice that width between going and coming. It is reached after friction_travel of the
  /// range's displacement; until then it is a spring (Jenkins element).
  double friction = 0;
  double friction_travel = 0.1;
};

struct Camera {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 805.0;
  double fy_px = 805.0;
  double cx_px = 319.5;
  double cy_px = 239.5;
  std::array<double, 5> distortion{-0.06, 0.02, 4e-4, -3e-4,
                                   0.0};  ///< k1 k2 p1 p2 k3, OpenCV's model
  double frame_rate = 25.0;               ///< Hz
  bool mirrored =
      false;  ///< delivers the image flipped left to right; the numbers above describe it unflipped
};

struct Optics {
  double psf_sigma_px = 0.9;        ///< of the Gaussian point spread at the focal distance
  double focus_distance = 20.0e-3;  ///< m
  double defocus_px_per_m =
      450.0;                 ///< growth of the point spread with |z - focus|, added in quadrature
  double vignetting = 0.25;  ///< loss of light at the image corner, 0..1
};

/// A tag as the designer drew it; the glued one differs by the placement errors of Target.
struct TagPlacement {
  int id = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the tag's centre, platform frame, m
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< rotation vector, platform_R_tag, rad
};

/// The paper's roof: the upper tag leans back above the ridge, the lower one below it, the ridge
/// towards the camera.
std::vector<TagPlacement> roof_placement(int upper_id, int lower_id, double tag_size,
                                         double border);

struct Target {
  std::string family = "aruco_original";
  double tag_size = 3.8e-3;  ///< edge of the black square, m
  double border = 0.35e-3;   ///< white margin, m
  std::vector<TagPlacement> tags = roof_placement(5, 2, 3.8e-3, 0.35e-3);
  double position_error =
      0.12e-3;  ///< largest placement error along each axis, m (seeded, uniform)
  double rotation_error =
      0.035;  ///< largest placement error about each axis, rad (seeded, uniform)
  Eigen::Vector3d rest_position{0.15e-3, -0.10e-3,
                                21.0e-3};  ///< of the platform origin in the camera frame, m

  double paper_reflectance = 0.86;
  double ink_reflectance = 0.14;
  double ink_spread = 2.0e-6;        ///< every ink edge lies this much too far out, m
  double ink_edge_roughness = 3e-6;  ///< standard deviation of the ink's edge, m
  double ink_grain = 0.02;           ///< standard deviation of the reflectance of ink and paper
  double paper_raggedness = 30e-6;   ///< standard deviation of the cut edge, m
};

struct Light {
  double level_counts =
      238.0;  ///< grey level of a perfectly white plate facing the camera in the image centre
  double unevenness =
      0.25;                ///< fall of the LED's light from its bright side to its dark side, 0..1
  double direction = 3.7;  ///< of the bright side in the image, rad from x towards y
  double ambient = 0.65;   ///< share of light that does not depend on a surface's inclination, 0..1
  double glare_counts = 320.0;  ///< added in the blown-out corner
  /// Of use where an LED outside of the simulation lights the scene:
  double led_level = 0.3;  ///< its mean brightness that level_counts stands for, 0..1
  double room = 0.05;      ///< light that is there without the LED, over level_counts
};

enum class Motion : std::uint8_t {
  rest,
  hold,
  push,
  steps,
  sweep,
  tap,
  drop,
  compound,
  hard,  ///< all of them in an order, with a size and at times drawn from the seed
  desk,  ///< somebody works with it (desk_use.h)
};

struct Trajectory {
  Motion motion = Motion::compound;
  double rest_time = 1.5;  ///< nothing touches the platform before, s
  std::array<double, 6> amplitude{0.45,  0.45,  1.4,
                                  0.007, 0.007, 0.004};  ///< largest wrench per axis, N and N m
  int axis = 2;              ///< of push, sweep and tap: 0..5 = fx fy fz mx my mz
  double share = 1.0;        ///< of push, sweep and tap: part of that axis's amplitude, with sign
  double hold_time = 0.0;    ///< of push and hold: released after this, s; 0 = never
  double bandwidth = 1.0;    ///< of compound: highest frequency, Hz
  double sweep_from = 0.2;   ///< Hz
  double sweep_to = 12.0;    ///< Hz
  double sweep_time = 20.0;  ///< s, then again from the start
  double event_time =
      2.0;  ///< of hard: each event has so long, its rest before and after included, s
};

struct Exposure {
  double time = 4.0e-3;          ///< s
  double rolling_readout = 0.0;  ///< from first to last row, s; 0 = global shutter
  /// Every sample of a pixel sees the whole exposure. Otherwise each of its four sees a quarter,
  /// which is quicker but displaces edges that lie along the rows: a target that moves by 1 px
  /// during the exposure seems to be off by about 1 um in y, 5 um in z and 0.6 mrad about x.
  bool even = false;
};

/// What a real camera, its driver and what lies between do to a picture and its time stamp. Nothing
/// by default: the stamp is the middle of the exposure of the middle row.
struct Delivery {
  double latency = 0.0;  ///< mean time from the middle of the exposure to the stamp, s
  /// Standard deviation of that time, s: a seeded exponential, so that latency - jitter is the
  /// least.
  double jitter = 0.0;
  double stale_share = 0.0;      ///< of frames that show the picture before them once more, 0..0.5
  double true_frame_rate = 0.0;  ///< Hz, where it is not the announced camera.frame_rate; 0: it is
};

struct Noise {
  double read_counts = 0.8;             ///< standard deviation without light, grey levels
  double shot_counts_per_count = 0.02;  ///< variance per grey level of light, grey levels
};

enum class FileFormat : std::uint8_t { png, pgm, jpeg };

struct Compression {
  int jpeg_quality = 0;  ///< 1..100 re-encodes every frame as the camera would; 0 = off
  FileFormat file = FileFormat::png;  ///< of exported frames
};

struct Scenario {
  std::uint64_t seed = 1;  ///< of placement errors, paper, ink, motion and noise
  Mechanics mechanics;
  Camera camera;
  Optics optics;
  Target target;
  Light light;
  Trajectory trajectory;
  Exposure exposure;
  Delivery delivery;
  Noise noise;
  Compression compression;
  Disturbances disturbances;
  DeskSettings desk;    ///< of use where trajectory.motion is `desk`
  BenchSettings bench;  ///< of use where someone calibrates the simulated sensor
};

/// Time between the exposures of two frames, s.
double true_period(const Scenario& scenario);

/// The first thing wrong with a scenario ("exposure: ...", what and what to do), or an empty
/// string.
std::string problem(const Scenario& scenario);

}  // namespace tagwrench::sim

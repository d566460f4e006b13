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
#include <limits>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {
class YamlReader;
}

namespace tagwrench::sim {

// How an hour at the desk goes (trajectory.h); used where trajectory.motion is `desk`.

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

  /// Usable range, N and N m, told to the user.
  std::array<double, 6> range{0.9, 0.9, 2.5, 0.016, 0.016, 0.009};

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
  std::array<double, 5> distortion{-0.06, 0.02, 4e-4, -3e-4, 0};  ///< OpenCV's k1 k2 p1 p2 k3
  double frame_rate = 25.0;                                       ///< Hz
  bool mirrored = false;  ///< delivers the image flipped left to right; this is of it unflipped

  // What the owner's sensor.yaml says of this camera, where that is wrong. OpenCV's own calibration
  // of two public sets of real boards is known to 0.4 and 0.6 % of the focal length.

  double told_focal_factor = 1;  ///< of fx and fy
  std::array<double, 2> told_centre_offset_px{0, 0};
  bool told_distortion = true;  ///< false: sensor.yaml knows of none
};

struct Optics {
  double psf_sigma_px = 0.9;        ///< of the Gaussian point spread at the focal distance
  double focus_distance = 20.0e-3;  ///< m
  double defocus_px_per_m = 450;    ///< growth of the point spread with |z - focus|, in quadrature
  double vignetting = 0.25;         ///< loss of light at the image corner, 0..1
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
  double position_error = 0.12e-3;  ///< largest along each axis, m (placement; seeded, uniform)
  double rotation_error = 0.035;    ///< largest about each axis, rad (likewise)
  /// Of the platform's origin in the camera frame, m.
  Eigen::Vector3d rest_position{0.15e-3, -0.10e-3, 21.0e-3};

  double paper_reflectance = 0.86;
  double ink_reflectance = 0.14;
  double ink_spread = 2.0e-6;        ///< every ink edge lies this much too far out, m
  double ink_edge_roughness = 3e-6;  ///< standard deviation of the ink's edge, m
  double ink_grain = 0.02;           ///< standard deviation of the reflectance of ink and paper
  double paper_raggedness = 30e-6;   ///< standard deviation of the cut edge, m

  // What is alike over a whole tag (print_fault.h), for all tags; none of it by default. Parts of
  // the tag's size. Lines along and across the feed of two laser printers differed by 0.2 and by
  // 2.8 %, at 2 % allowed (B. Beeton, comp.laser-printers, June 1988).

  double print_size = 0;    ///< printed larger
  double print_aspect = 0;  ///< x longer and y shorter
  double print_shear = 0;   ///< x moves with y, and y with x
  /// Black grows beyond ink_spread on both sides of a line, along x and along y, m: toner goes with
  /// the drum's turn, ink with the fibres. An estimate; a dot of 600 dpi is 42 um.
  double ink_growth_x = 0;
  double ink_growth_y = 0;
  double paper_curl = 0;            ///< the middle stands off the plane of the edges, m: damp, glue
  double paper_curl_direction = 0;  ///< along which it is bent, rad from x towards y
  /// Draws all of these on top for each tag, from the seed: size, aspect and shear up to this part,
  /// half of it in common, growth and curl up to this part of half the tag.
  double print_error = 0;
};

struct Light {
  double level_counts = 238;  ///< grey level of a white plate facing the camera in the image centre
  double unevenness = 0.25;   ///< fall of the LED's light from its bright to its dark side, 0..1
  double direction = 3.7;     ///< of the bright side in the image, rad from x towards y
  double ambient = 0.65;  ///< share of light that does not depend on a surface's inclination, 0..1
  double glare_counts = 320.0;  ///< added in the blown-out corner
  /// Of use where an LED outside of the simulation lights the scene:
  double led_level = 0.3;  ///< its mean brightness that level_counts stands for, 0..1
  double room = 0.05;      ///< light that is there without the LED, over level_counts
};

/// `hard`: all of them in an order, with a size and at times drawn from the seed; `desk`: somebody
/// works with it (trajectory.h).
// clang-format off
enum class Motion : std::uint8_t {
  rest, hold, push, steps, sweep, tap, drop, compound, hard, desk
};
// clang-format on

struct Trajectory {
  Motion motion = Motion::compound;
  double rest_time = 1.5;  ///< nothing touches the platform before, s
  /// Largest wrench per axis, N and N m.
  std::array<double, 6> amplitude{0.45, 0.45, 1.4, 0.007, 0.007, 0.004};
  int axis = 2;              ///< of push, sweep and tap: 0..5 = fx fy fz mx my mz
  double share = 1.0;        ///< of push, sweep and tap: part of that axis's amplitude, with sign
  double hold_time = 0.0;    ///< of push and hold: released after this, s; 0 = never
  double bandwidth = 1.0;    ///< of compound: highest frequency, Hz
  double sweep_from = 0.2;   ///< Hz
  double sweep_to = 12.0;    ///< Hz
  double sweep_time = 20.0;  ///< s, then again from the start
  double event_time = 2.0;   ///< of hard: s that each event has, its rest before and after included
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

/// What the camera's own image processor does, in this order (processor.h); nothing by default.
/// Webcams have it in firmware and show little of it: brightness, gamma, sharpness and the like are
/// controls of the USB Video Class (1.5, section 4.2.2.3). Strengths are estimates.
struct Processing {
  double exposure_hunt = 0;     ///< an auto exposure in search: largest part of the light, +-
  double exposure_hunt_hz = 0;  ///< how fast
  bool demosaicing = false;     ///< every other pixel's brightness comes from its neighbours
  /// Pixels that differ by less are averaged over 3 x 3, grey levels.
  double spatial_counts = 0;
  /// Part of the picture before that a pixel keeps which has not changed, 0..0.95; one that has
  /// changed by temporal_counts or more keeps nothing.
  double temporal = 0;
  double temporal_counts = 12;
  /// Brightness to this power. Video's is nearly 0.5 (ITU-R BT.709-6, section 1.2).
  double gamma = 1;
  double contrast = 0;  ///< part of a smooth step that is mixed into the tone curve, 0..1
  /// Unsharp mask: so much of what a Gaussian of this width takes away is added.
  double sharpening = 0;
  double sharpening_radius_px = 1;
};

enum class FileFormat : std::uint8_t { png, pgm, jpeg };

struct Compression {
  int jpeg_quality = 0;  ///< 1..100 re-encodes every frame as the camera would; 0 = off
  FileFormat file = FileFormat::png;  ///< of exported frames
};

// What goes wrong in front of a real lens: things that pass before it, glare, light that changes,
// dirt, lost focus, lost frames. All off by default; none of it changes the truth of the motion.
//
// Pixel lengths are pixels of the image as the lens makes it (before any mirroring), positions
// count from its centre, x right and y down. Seconds count from the first frame.

/// When a disturbance is there: from `start` for `length`, and again every `every`.
struct Occurrence {
  double start = 3.0;   ///< s
  double length = 1.0;  ///< s
  double every = 0.0;   ///< s; 0 = once
};

enum class OccluderShape : std::uint8_t {
  band,  ///< straight edges across its way: a hair, a cable, a hand
  disc,  ///< a fingertip
};

/// An opaque object near the lens. It moves along a straight line and is at `aim` in the middle of
/// its time; at speed 0 it is there at once and lies still. Its edges are a linear ramp, widened by
/// the way it goes during the exposure.
struct Occluder {
  Occurrence when;
  OccluderShape shape = OccluderShape::band;
  double width_px = 40;          ///< of the band; the disc's diameter
  double softness_px = 3;        ///< width of the edge
  double direction = 0;          ///< in which it moves, rad from x towards y
  double speed_px_per_s = 0;     ///< along `direction`
  Eigen::Vector2d aim_px{0, 0};  ///< of its middle
  double reflectance = 0.3;      ///< it is lit as a plate that faces the camera
  double texture = 0.05;         ///< largest deviation of its reflectance, both ways
  double texture_wavelength_px = 25;
};

/// A specular spot, a Gaussian of light that wanders about `aim`.
struct Glare {
  Occurrence when;
  double peak_counts = 400;  ///< grey levels added in its middle
  double sigma_px = 30;
  Eigen::Vector2d aim_px{0, 0};
  double wander_px = 20;   ///< largest way from `aim` along x and along y
  double wander_hz = 0.5;  ///< of the faster of the two sines that it wanders by
  double fade = 0.05;      ///< s to come and to go
};

/// All light times `factor`: a step, a lens cap (factor 0) or, with a long fade, a drifting LED.
struct LightChange {
  Occurrence when;
  double factor = 0.6;
  double fade = 0.0;  ///< s to come and to go
};

/// Lamps on mains: light times 1 + depth sin(2 pi 2 mains_hz t), averaged over each row's exposure.
/// A rolling readout shows bands, a global shutter a gain that changes from frame to frame.
struct Flicker {
  Occurrence when;
  double depth = 0.1;      ///< 0..1
  double mains_hz = 50.0;  ///< the light has twice this frequency
};

/// Light from the side that turns about the optical axis: times 1 + depth (off . direction(t)),
/// with `off` the pixel's place from the image centre over half the image's diagonal.
struct TurningLight {
  Occurrence when;
  double depth = 0.3;  ///< 0..1
  double turn = 4.0;   ///< s for a full turn
  double fade = 0.2;   ///< s to come and to go
};

/// Specks and scratches on one tag's paper: texture that nobody learned.
struct Dirt {
  Occurrence when;
  int tag = 0;               ///< position in target.tags
  int specks = 4;            ///< round, up to `size` across
  int scratches = 1;         ///< straight, a sixth of `size` wide, up to half the tag long
  double size = 0.25e-3;     ///< m
  double reflectance = 0.4;  ///< of the dirt
};

/// The lens focuses elsewhere; the image's scale stays (a breathing lens would change it).
struct FocusChange {
  Occurrence when;
  double shift = 4.0e-3;  ///< m, added to optics.focus_distance
  double fade = 0.15;     ///< s to go there and back
  double hunt_hz = 0.0;   ///< an autofocus in search: the shift swings as a sine; 0 = it stays
};

/// Frames that never arrive. Whether a frame is lost depends on the seed and its number alone.
struct LostFrames {
  double share = 0.0;     ///< probability that a gap begins at a frame, 0..0.5
  int most_in_a_row = 1;  ///< gaps have 1 to this many frames, equally likely
};

/// Disturbances of every kind above but lost frames, drawn from the seed: one in each period of
/// `every`, a second one beside it in a quarter of them. Each begins in the first quarter of its
/// period and is over by three quarters, so that undisturbed time lies in between.
struct RandomDisturbances {
  double start = std::numeric_limits<double>::infinity();  ///< s; never
  double every = 2.0;                                      ///< s
};

struct Disturbances {
  std::vector<Occluder> occluders;
  std::vector<Glare> glare;
  std::vector<LightChange> light;
  std::vector<Flicker> flicker;
  std::vector<TurningLight> turning_light;
  std::vector<Dirt> dirt;
  std::vector<FocusChange> focus;
  LostFrames lost_frames;
  RandomDisturbances random;
};

// What is imperfect at the simulated bench: the person, the masses, the reference instruments.
// Every error is drawn from the scenario's seed; a plan that states these numbers as its own
// standard deviations is honest about this bench.

constexpr double kNever = std::numeric_limits<double>::infinity();

/// The person and the masses. All `_error` are standard deviations of seeded normal errors, cut at
/// three of them.
struct BenchErrors {
  double mass = 0.002;          ///< relative; the same each time that the same mass is hung
  double point = 0.2e-3;        ///< of each coordinate of a point, m; the same at each use of it
  double contact = 0.1e-3;      ///< and anew at each use: where in its dimple the load sits, m
  double gravity_rad = 0.0087;  ///< about each of the two axes that matter, anew at each mounting
  double lean_rad = 0.003;      ///< of a string that rubs, about each of two axes, anew at each use
  double string = 0.3e-3;       ///< weight of string and knot, N, anew at each use
  double direction_rad = 0.0087;  ///< of a push, about each of two axes, anew at each push
  double sway_rad = 0.004;        ///< of a push's direction while it lasts, about each of two axes
  double tremor = 0.02;           ///< of a hand's force, relative, at 8 to 12 Hz
};

struct BenchTimes {
  double reaction = 0.4;        ///< s until an order is begun
  double turn = 1.0;            ///< s to mount the sensor another way
  double load = 0.5;            ///< s to hang a mass or to take it off
  double swing_rad = 0.06;      ///< of a mass that has just been let go
  double swing_decay = 0.7;     ///< s after which it swings by a factor e less
  double string_length = 0.12;  ///< m, which gives the swing's frequency
};

/// What goes wrong on purpose, once. Counted from 1; 0: never.
struct BenchFaults {
  int wrong_mass = 0;            ///< this mass, in the order in which they are hung, is another ...
  double wrong_mass_factor = 2;  ///< ... by this factor
  int bump = 0;                  ///< the sensor is knocked at the beginning of this order ...
  Vector6 bump_change = (Vector6() << 20e-6, -15e-6, 30e-6, 1e-3, -5e-4, 4e-4)
                            .finished();  ///< ... so that its rest is elsewhere, m and rad
  int slip = 0;                           ///< a tag slips at the beginning of this order ...
  int slip_tag = 0;                       ///< ... this one (position in target.tags) ...
  Eigen::Vector3d slip_change{60e-6, 40e-6, 0.01};  ///< ... by this, in its plane: m, m, rad
  Vector6 drift_per_hour = Vector6::Zero();         ///< of the rest, m and rad
};

/// What is wrong with a reference instrument.
struct ReferenceFaults {
  double silent_from = kNever;  ///< s
  double silent_to = kNever;    ///< s
  bool wrong_sign = false;      ///< wired the other way round
  double clock_offset = 0;      ///< s added to its times
  double clock_ppm = 0;         ///< its clock is fast by this
};

/// A load cell on an amplifier HX711 at 80 conversions a second.
struct LoadCellSettings {
  bool ideal = false;     ///< no noise, no steps, no lag, no error of scale, no saturation
  double rate = 80;       ///< Hz
  double noise = 0.5e-3;  ///< standard deviation of one conversion, N
  double counts_per_newton = 2.0e5;  ///< whole counts
  double lag = 0.010;                ///< s: a reading stamped t shows t - lag
  double scale_error = 0.002;        ///< standard deviation of its calibration, relative; seeded
  double range = 10;                 ///< N, either way; beyond it is saturated
  ReferenceFaults faults;
};

/// A six-axis sensor under the simulated one, after OptoForce's HEX-58-RE-400N.
struct SixAxisSettings {
  bool ideal = false;  ///< no noise, no steps, no filter, no lag, no saturation, exactly in place
  double rate = 100;   ///< Hz
  /// Per N, per N m.
  std::array<double, 6> counts_per_unit{96.11, 95.64, 20.92, 5425.36, 5524.60, 8103.25};
  double noise_counts = 1;  ///< standard deviation of a reading, before it becomes whole counts
  double filter_hz = 15;    ///< of its first-order low pass
  double lag = 0.040;       ///< s in all at low frequency, the filter's share of it included
  std::array<double, 6> range{400, 400, 2000, 10, 10, 10};  ///< N, N m; beyond it is saturated
  Eigen::Vector3d origin{0, 0, -0.051};  ///< where its torque counts from, platform frame, m
  double place_error = 0.3e-3;  ///< standard deviation of each coordinate of the origin, m; seeded
  double turn_error = 0.003;    ///< how it is turned about each axis, rad; seeded
  ReferenceFaults faults;
};

struct BenchSettings {
  bool perfect = false;      ///< no errors, no tremor, no swing, ideal references; faults stay
  double gravity = 9.80665;  ///< m/s^2
  BenchErrors errors;
  BenchTimes times;
  BenchFaults faults;
  LoadCellSettings load_cell;
  SixAxisSettings six_axis;
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
  Processing processing;
  Compression compression;
  Disturbances disturbances;
  DeskSettings desk;    ///< of use where trajectory.motion is `desk`
  BenchSettings bench;  ///< of use where someone calibrates the simulated sensor
};

/// Lays the sections of a scenario.yaml over `scenario`: its members by their names, with the unit
/// of a key after it; all may be left out. Throws ConfigError with file, line and key.
void read_scenario(YamlReader& root, Scenario& scenario);

/// Time between the exposures of two frames, s.
double true_period(const Scenario& scenario);

/// The first thing wrong with a scenario ("exposure: ...", what and what to do), or an empty
/// string.
std::string problem(const Scenario& scenario);

}  // namespace tagwrench::sim

// What goes wrong in front of a real lens, as settings: things that pass before it, glare, light
// that changes, dirt, lost focus, lost frames. All off by default; none of it changes the truth of
// the motion.
//
// Pixel lengths are pixels of the image as the lens makes it (before any mirroring), positions
// count from its centre, x right and y down. Seconds count from the first frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace tagwrench {
class YamlReader;
}

namespace tagwrench::sim {

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

/// The first thing wrong with the disturbances of a target of `tags` tags ("disturbances.glare:
/// ...", what and what to do), or an empty string.
std::string problem(const Disturbances& disturbances, int tags);

/// What is going on in a frame; bits of a mask, 1U << kind.
enum class DisturbanceKind : std::uint8_t {
  occluder,
  glare,
  light_step,   ///< a LightChange with a fade of less than a second
  light_drift,  ///< one with a longer fade
  darkness,     ///< one with a factor below 0.05
  flicker,
  turning_light,
  dirt,
  focus,
};
constexpr int kDisturbanceKinds = 9;

constexpr const char* name(DisturbanceKind kind) {
  constexpr const char* kNames[kDisturbanceKinds] = {"occluder", "glare",    "light step",
                                                     "drift",    "darkness", "flicker",
                                                     "turning",  "dirt",     "focus"};
  return kNames[static_cast<int>(kind)];
}

constexpr std::uint32_t bit(DisturbanceKind kind) { return 1U << static_cast<unsigned>(kind); }

// The section `disturbances` of scenario.yaml -> Disturbances. Each kind is a list of mappings
// (lost_frames and random are one mapping); keys are the fields of disturbances.h, with the unit
// after the name.
//
//   disturbances:
//     occluders: [{start_s: 3, length_s: 1, every_s: 5, shape: band, width_px: 40, softness_px: 3,
//                  direction_rad: 0, speed_px_per_s: 700, aim_px: [0, 0], reflectance: 0.3,
//                  texture: 0.05, texture_wavelength_px: 25}]
//     glare: [{start_s: 3, length_s: 1, every_s: 0, peak_counts: 400, sigma_px: 30,
//              aim_px: [0, 0], wander_px: 20, wander_hz: 0.5, fade_s: 0.05}]
//     light: [{start_s: 3, length_s: 1, every_s: 0, factor: 0.6, fade_s: 0}]
//     flicker: [{start_s: 3, length_s: 1, every_s: 0, depth: 0.1, mains_hz: 50}]
//     turning_light: [{start_s: 3, length_s: 1, every_s: 0, depth: 0.3, turn_s: 4, fade_s: 0.2}]
//     dirt: [{start_s: 3, length_s: 1, every_s: 0, tag: 0, specks: 4, scratches: 1, size_mm: 0.25,
//             reflectance: 0.4}]
//     focus: [{start_s: 3, length_s: 1, every_s: 0, shift_mm: 4, fade_s: 0.15, hunt_hz: 0}]
//     lost_frames: {share: 0.02, most_in_a_row: 3}
//     random: {start_s: 3, every_s: 2}

/// Throws ConfigError with file, line and key.
void read_disturbances(YamlReader reader, Disturbances& disturbances);

}  // namespace tagwrench::sim

// The section `disturbances` of scenario.yaml -> sim::Disturbances. Each kind is a list of mappings
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
#pragma once

#include "host/core/yaml/yaml_reader.h"
#include "host/source/simulator/disturbances.h"

namespace tagwrench {

/// Throws ConfigError with file, line and key.
void read_disturbances(YamlReader reader, sim::Disturbances& disturbances);

}  // namespace tagwrench

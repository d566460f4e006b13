// What one sensor of hardware/sensors measures, in the simulator: its own mechanics, camera and
// tags, and this project's tracker.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "host/core/types.h"
#include "host/tools/design/parameters.h"

namespace tagwrench::bench {

/// Through rendered pictures. N, N m.
struct VariantLoop {
  Vector6 noise = Vector6::Zero();  ///< standard deviation of one picture's wrench, over all holds
  Vector6 displacement_noise = Vector6::Zero();  ///< the same, m, rad
  Vector6 bound = Vector6::Zero();               ///< Cramer-Rao, of the same pictures at rest
  /// Worst wrong reading on each axis while another one alone is loaded with half of its range,
  /// over the range. The springs are known; where the tags sit is learned at rest.
  Vector6 cross_talk = Vector6::Zero();
  int lost = 0;    ///< pictures at fixed loads that gave no numbers, ...
  int frames = 0;  ///< ... of so many
};

struct VariantFigures {
  std::string name, about;
  Vector6 range = Vector6::Zero();              ///< before a stop, N, N m
  Vector6 edge_bound = Vector6::Zero();         ///< that of `tagwrench design`, N, N m
  Vector6 edge_displacement = Vector6::Zero();  ///< the same, m, rad
  std::array<double, 6> modes{};                ///< Hz, rising
  double frame_rate = 0;                        ///< Hz
  double size_x = 0, size_y = 0, height = 0;    ///< over all but the ears, m
  VariantLoop loop;
};

VariantFigures measure_variant(const hardware::Parameters& parameters);

/// The same with both tags on a roof of 45 degrees in place of the mirror: what the mirror is
/// worth. It need not fit into the housing.
hardware::Parameters with_roof(hardware::Parameters mirror);

/// What its parts cost, US dollars, from a bill of materials with a row for each part: variants,
/// part, quantity, what to look for, least and highest price of one. Empty: no such file.
struct PriceRange {
  double low = 0, high = 0;
};
std::optional<PriceRange> parts_price(const std::string& file, const std::string& variant);

}  // namespace tagwrench::bench

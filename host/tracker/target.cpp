#include "host/tracker/target.h"

#include <array>

#include "host/core/grid_tags.h"

namespace tagwrench {
namespace {

struct FamilyRow {
  std::string_view name;
  int bits;
  int ids;
};

// In the order of TagFamily.
constexpr std::array<FamilyRow, kTagFamilies> kFamilies = {{
    {"aruco_original", 5, 1024}, {"aruco_4x4_50", 4, 50},
    {"aruco_4x4_100", 4, 100},   {"aruco_4x4_250", 4, 250},
    {"aruco_4x4_1000", 4, 1000}, {"aruco_5x5_50", 5, 50},
    {"aruco_5x5_100", 5, 100},   {"aruco_5x5_250", 5, 250},
    {"aruco_5x5_1000", 5, 1000}, {"aruco_6x6_50", 6, 50},
    {"aruco_6x6_100", 6, 100},   {"aruco_6x6_250", 6, 250},
    {"aruco_6x6_1000", 6, 1000}, {"aruco_7x7_50", 7, 50},
    {"aruco_7x7_100", 7, 100},   {"aruco_7x7_250", 7, 250},
    {"aruco_7x7_1000", 7, 1000}, {"apriltag_16h5", 4, 30},
    {"apriltag_25h9", 5, 35},    {"apriltag_36h10", 6, 2320},
    {"apriltag_36h11", 6, 587},  {"grid_10x10", kGridCells, kGridIds},
}};

const FamilyRow& row(TagFamily family) { return kFamilies[static_cast<std::size_t>(family)]; }

}  // namespace

std::string_view name(TagFamily family) { return row(family).name; }

std::optional<TagFamily> family_from_name(std::string_view text) {
  for (std::size_t i = 0; i < kFamilies.size(); ++i)
    if (kFamilies[i].name == text) return static_cast<TagFamily>(i);
  return std::nullopt;
}

int bits_per_side(TagFamily family) { return row(family).bits; }

int id_count(TagFamily family) { return row(family).ids; }

}  // namespace tagwrench

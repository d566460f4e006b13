// The six axes of a wrench, as people and files call them.
#pragma once

#include <array>
#include <cstddef>

namespace tagwrench {

/// In the order of a Vector6.
inline constexpr std::array<const char*, 6> kWrenchAxes{"Fx", "Fy", "Fz", "Mx", "My", "Mz"};

constexpr const char* wrench_axis(int axis) { return kWrenchAxes[static_cast<std::size_t>(axis)]; }

}  // namespace tagwrench

// The six axes of a wrench, as people and files call them.
#pragma once

#include <array>

namespace tagwrench {

/// In the order of a Vector6.
inline constexpr std::array<const char*, 6> kWrenchAxes{"Fx", "Fy", "Fz", "Mx", "My", "Mz"};

}  // namespace tagwrench

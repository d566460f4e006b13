// What a camera calibration demands of its views.
#pragma once

namespace tagwrench {

constexpr int kFewestCameraViews = 8;
constexpr int kMostCameraViews = 80;

}  // namespace tagwrench

// What a camera calibration demands of its views.
#pragma once

namespace tagwrench {

constexpr int kMinCameraViews = 8;
constexpr int kMaxCameraViews = 80;

}  // namespace tagwrench

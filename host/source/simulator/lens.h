// The lens: pinhole with OpenCV's five-coefficient distortion, and the ray that every pixel looks
// along.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// Where the ray (x/z, y/z) lands in the image, px.
Eigen::Vector2d project(const Camera& camera, const Eigen::Vector2d& ray) noexcept;

/// The ray (x/z, y/z) that lands on a pixel: Newton's method on project(). False if it does not
/// converge, that is, if the distortion folds the image over.
bool unproject(const Camera& camera, const Eigen::Vector2d& pixel, Eigen::Vector2d& ray) noexcept;

/// One ray per pixel, and one more pixel on each side so that rays between pixels follow from
/// neighbours.
class RayTable {
 public:
  /// Throws ConfigError if the distortion cannot be inverted all over the image.
  explicit RayTable(const Camera& camera);

  const float* x(int row) const noexcept { return x_.data() + offset(row); }
  const float* y(int row) const noexcept { return y_.data() + offset(row); }

 private:
  std::size_t offset(int row) const noexcept {
    return static_cast<std::size_t>(row + 1) * static_cast<std::size_t>(stride_) + 1;
  }

  int stride_;
  std::vector<float> x_, y_;
};

}  // namespace tagwrench::sim

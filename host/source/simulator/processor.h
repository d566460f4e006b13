// What a camera's image processor makes of a picture before it leaves the camera.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// In the order of a usual pipeline: gain of the auto exposure, demosaicing, noise reduction in
/// space and in time, tone curve, sharpening. Pictures are 8-bit grey before and after; what is
/// done with colour leaves brightness alone.
class Processor {
 public:
  Processor(const Processing& settings, int width, int height);

  /// One picture after the other, in place; `time` of its exposure, s. No heap.
  void apply(std::uint8_t* pixels, double time) noexcept;

  /// The factor of an auto exposure that hunts.
  double exposure_gain(double time) const noexcept;

 private:
  void smooth_rows_and_columns(const std::vector<float>& kernel) noexcept;
  void reduce_noise_in_space() noexcept;
  void reduce_noise_in_time() noexcept;
  void sharpen() noexcept;

  Processing settings_;
  int width_, height_;
  bool does_anything_;
  std::vector<float> picture_, other_, before_;  ///< grey levels
  bool has_before_ = false;
  std::vector<float> demosaicing_, blur_;  ///< weights 0..radius of even kernels
  std::array<float, 256> tone_{};
};

}  // namespace tagwrench::sim

// Frames of any renderer as a folder that `tagwrench run --source images:DIR` reads.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>

#include "host/core/types.h"

namespace tagwrench::test {

struct FrameFolder {
  int frames = 0;
  double frame_rate = 25;
  std::string sensor_yaml;
  std::function<Vector6(int frame)> displacement;  ///< truth, m and rad
  std::function<cv::Mat(int frame)> picture;       ///< CV_8U
};

/// Writes PNG frames, frames.csv, sensor.yaml and truth.csv (its wrenches are zero) into an
/// existing folder. Throws std::runtime_error if a file cannot be written.
void write_frame_folder(const FrameFolder& what, const std::filesystem::path& folder);

}  // namespace tagwrench::test

// A scenario as a folder: pictures, their times, the truth, and the sensor file that its user would
// have.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// Encodes and decodes a picture in place, as a camera with JPEG output and its driver do. Quality
/// 0 does nothing. Throws std::runtime_error if memory is short.
class JpegRoundTrip {
 public:
  JpegRoundTrip(int width, int height, int quality);
  void apply(std::uint8_t* pixels) noexcept;

 private:
  using Coder = std::unique_ptr<void, int (*)(void*)>;
  int width_, height_, quality_;
  Coder encoder_, decoder_;
  std::vector<std::uint8_t> encoded_;
};

/// sensor.yaml as the owner of this sensor would write it: camera calibration, family, ids and
/// nominal springs. Where the tags were glued stays unknown to it.
std::string sensor_yaml(const Scenario& scenario);

/// Writes 000000.png (or .pgm, .jpg) ..., frames.csv, sensor.yaml and truth.csv into `dir`, all or
/// nothing: they appear when the last one is written. An earlier export in `dir` is replaced; any
/// other content is left alone and refused. Throws ConfigError if the scenario or the folder cannot
/// be used, std::runtime_error if writing fails (disk full).
void export_folder(const Scenario& scenario, const std::filesystem::path& dir, int frames);

}  // namespace tagwrench::sim

// Room web/wasm: the tracker and the wrench, compiled for a page.
// In:  grey pixels of a browser's camera; sensor.yaml and what was measured.
// Out: displacement (m, rad), wrench (N, N m), sigmas and status, as the program has them.
// Then: browser_core.cpp (what JavaScript calls), page.h (what it asks of the page).
//
// A sensor that a page has opened: frame -> displacement -> wrench, as the program's pipeline does
// it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "host/sensor/sensor_config.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {

/// One sample as numbers, for whoever reads the core's memory: core.ts knows the places too.
struct PageSample {
  static constexpr std::size_t kMaxTags = 8;

  double status = 0;  ///< as Status counts
  std::array<double, 6> displacement{}, displacement_sigma{}, wrench{}, wrench_sigma{}, zero{};
  double zero_state = 0;  ///< as ZeroState counts
  double tags_held = 0;
  double residual_px = 0;
  double residual_fraction = 0;
  double blur_px2 = 0;
  std::array<double, 4> wanted{};  ///< x, y, width, height; zeros: all
  double needs_whole_frame = 0;
  double news = 0;  ///< 1: diagnostic() has changed
  double tags = 0;
  std::array<std::array<double, 9>, kMaxTags> tag{};  ///< id, then x, y of its corners
};

class Session {
 public:
  using Bytes = std::vector<std::uint8_t>;
  /// What goes with the sensor's text; empty: not given.
  struct Files {
    std::string calibration;                   ///< as the text names it, beside it
    std::span<const std::uint8_t> appearance;  ///< alike
    std::map<std::string, Bytes> measured;     ///< by name
  };
  /// Throws ConfigError.
  static SensorConfig read(const std::string& yaml, const std::string& name, const Files& files);

  Session(const SensorConfig& sensor, std::string name);

  const PageSample& track(const Frame& frame) noexcept;
  void ask_zero() noexcept { zero_.ask(); }

  /// What the tracker noticed last, in words; empty when all is well.
  const std::string& diagnostic() const noexcept { return diagnostic_; }
  /// What there is to know about the sensor, as JSON.
  std::string description() const;
  /// What was learned at rest, as files of measured/: a JSON object of names and texts. Empty where
  /// nothing had to be learned; "null" while it is not known. `date`: YYYY-MM-DD.
  std::string learned(const std::string& date) const;

 private:
  void note(const Track& track) noexcept;
  void fill(const Track& track, const Sample& sample) noexcept;

  SensorConfig sensor_;
  std::string name_;
  Tracker tracker_;
  bool rest_given_;  ///< together with the places of all tags
  WrenchEstimator wrench_;
  ZeroTracking zero_;
  PageSample sample_;
  std::string diagnostic_;
  Diagnostic last_diagnostic_ = Diagnostic::none;
  bool trouble_shown_ = false;
};

}  // namespace tagwrench

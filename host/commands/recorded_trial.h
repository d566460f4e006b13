// A recording with a six-axis reference -> a Trial: what the tracker saw, and what the reference
// felt meanwhile, on the frames' clock.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/calibration/analysis/trial_csv.h"

namespace tagwrench {

bool is_recording(const std::filesystem::path& file);

/// Times count from the first frame. What was left out (readings while the target was not held,
/// saturated rows of the reference) is added to `notes`. Steps are those of its marks. Throws
/// ConfigError: no recording, damaged, no tracks, no six-axis reference in it.
study::Trial recorded_trial(const std::filesystem::path& file, std::vector<std::string>& notes);

}  // namespace tagwrench

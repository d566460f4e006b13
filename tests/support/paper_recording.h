// The paper's only published recording (Ouyang & Howe, ICRA 2020), in the folder that
// TAGWRENCH_DATA names: how its columns are to be read, and the analyses that are compared.
#pragma once

#include <filesystem>
#include <optional>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench::test {

/// The folder of the recording; empty without TAGWRENCH_DATA, or where it does not hold one.
std::optional<std::filesystem::path> paper_recording();

/// The 6 numbers that the paper fits: mean translation and mean Euler angles of both tags, their
/// smoothing undone, and all smoothed alike.
study::Analysis analyze_mean_of_tags(const std::filesystem::path& recording);

/// 12 numbers: translation and rotation of each tag, ridge 1e-3, all smoothed alike.
study::Analysis analyze_both_tags(const std::filesystem::path& recording);

}  // namespace tagwrench::test

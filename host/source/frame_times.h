// frames.csv of a recorded folder: one line a picture, `file,t_ns`. Pure.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// The times of `files` (names without folder, in the order of playing) from the text of a
/// frames.csv. The first line may be the header. Throws ConfigError that names `source` and the
/// line: a line that is not `file,t_ns`, a file that does not exist or is named twice, a file
/// without a time, times that do not increase in the order of playing.
std::vector<Duration> parse_frame_times(std::string_view text, const std::string& source,
                                        std::span<const std::string> files);

}  // namespace tagwrench

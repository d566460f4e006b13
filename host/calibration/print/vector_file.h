// A drawing -> a PDF or SVG file, true to scale. Uses cairo.
#pragma once

#include <filesystem>
#include <string>

#include "host/calibration/print/drawing.h"

namespace tagwrench {

/// Writes to a file beside and renames it, so that `path` is never half-written. The name's ending,
/// .pdf or .svg, says which. Throws ConfigError for another ending or a folder that takes no file,
/// std::runtime_error if writing fails later.
void write_vector_file(const Drawing& drawing, const std::filesystem::path& path);

}  // namespace tagwrench

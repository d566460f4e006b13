// A printed page as plain data. Millimetres from the top left corner of the paper, x right, y down.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tagwrench {

struct PagePoint {
  double x_mm = 0;
  double y_mm = 0;
};

/// Closed polygons filled black as one shape, even-odd: what lies inside two of them is white.
using Area = std::vector<std::vector<PagePoint>>;

struct Line {
  PagePoint from;
  PagePoint to;
  double width_mm = 0.1;
};

enum class TextAnchor : std::uint8_t { left, centre };

/// One line in a typewriter face, each letter kLetterWidth * height_mm wide.
struct Text {
  PagePoint at;          ///< on the baseline
  double height_mm = 2;  ///< of the type, from line to line
  TextAnchor anchor = TextAnchor::left;
  bool upward = false;  ///< runs from bottom to top
  std::string text;
};

constexpr double kLetterWidth = 0.61;

struct Drawing {
  double width_mm = 0;
  double height_mm = 0;
  std::vector<Area> areas;
  std::vector<Line> lines;
  std::vector<Text> texts;
};

// A drawing -> a PDF or SVG file, true to scale. Uses cairo.

/// Writes to a file beside and renames it, so that `path` is never half-written. The name's ending,
/// .pdf or .svg, says which. Throws ConfigError for another ending or a folder that takes no file,
/// std::runtime_error if writing fails later.
void write_vector_file(const Drawing& drawing, const std::filesystem::path& path);

}  // namespace tagwrench

// Image -> squares, and what is printed in them, as a library of computer vision finds them: OpenCV
// in the program, OpenCV.js in a web page.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "host/tracker/target.h"

namespace tagwrench {

/// Corners clockwise, top left first if it is a tag as printed; px.
using Square = std::array<Eigen::Vector2d, 4>;

struct SquareList {
  std::vector<int> ids;        ///< of the family
  std::vector<Square> tags;    ///< one for each id
  std::vector<Square> others;  ///< four corners, but no tag of the family
};

class SquareFinder {
 public:
  explicit SquareFinder(TagFamily family);
  ~SquareFinder();
  SquareFinder(const SquareFinder&) = delete;
  SquareFinder& operator=(const SquareFinder&) = delete;

  /// Tags may be listed more than once. `sharpen`: an unsharp mask goes over the image first. Empty
  /// while the library is not there yet; an empty list where it refuses the image, for one as too
  /// small.
  std::optional<SquareList> find(const ImageView& image, bool sharpen);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace tagwrench

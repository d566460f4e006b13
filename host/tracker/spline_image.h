// A picture as a smooth function: quintic B-spline interpolation, and the polynomial that describes
// it best over one pixel. A cubic spline would leave a few thousandths of a pixel at edges that run
// along the pixels' rows.
#pragma once

#include <array>
#include <vector>

namespace tagwrench {

/// I(x + dx, y + dy) for |dx|, |dy| <= 1/2, as a full cubic. Order of the coefficients:
/// 1, dx, dy, dx^2, dx dy, dy^2, dx^3, dx^2 dy, dx dy^2, dy^3.
using PixelPolynomial = std::array<double, 10>;

/// A rectangle of a picture. Coordinates are those of the picture, pixel centres at integers.
class SplineImage {
 public:
  /// `levels`: width * height numbers, row by row; the rectangle's first pixel is (left, top).
  /// Mirror boundary (Unser, "Splines: a perfect fit", IEEE SPM 16(6), 1999).
  SplineImage(std::vector<float> levels, int left, int top, int width, int height);

  /// The interpolated level; at integers, the given one. Outside, the nearest border repeats.
  double level(double x, double y) const;

  /// Least squares over the pixel's area: within a pixel the cubic is closer to the spline than a
  /// Taylor series about its centre.
  PixelPolynomial polynomial(int x, int y) const;

 private:
  double coefficient(int column, int row) const;

  std::vector<float> coefficients_;
  int left_, top_, width_, height_;
};

}  // namespace tagwrench

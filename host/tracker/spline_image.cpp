#include "host/tracker/spline_image.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace tagwrench {
namespace {

const double kPole = std::sqrt(3.0) - 2.0;

/// Turns samples into spline coefficients, in place.
void prefilter(float* line, int count, std::ptrdiff_t step) {
  if (count < 2) return;
  constexpr int kHorizon = 16;  // |pole|^16 is below float's resolution
  const auto at = [&](int i) -> float& { return line[i * step]; };
  const int horizon = std::min(kHorizon, count);
  double first = 0;
  double power = 1;
  for (int i = 0; i < horizon; ++i, power *= kPole) first += power * at(i);
  double previous = first;
  at(0) = static_cast<float>(6.0 * previous);
  for (int i = 1; i < count; ++i) {
    previous = at(i) + kPole * previous;
    at(i) = static_cast<float>(6.0 * previous);
  }
  const double last = at(count - 1);
  const double before = at(count - 2);
  double next = kPole / (kPole * kPole - 1.0) * (kPole * before + last);
  at(count - 1) = static_cast<float>(next);
  for (int i = count - 2; i >= 0; --i) {
    next = kPole * (next - at(i));
    at(i) = static_cast<float>(next);
  }
}

std::array<double, 4> cubic_weights(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6,
          t * t * t / 6};
}

constexpr int kGrid = 7;  // samples along a side of the pixel's area

using Fit = Eigen::Matrix<double, 10, kGrid * kGrid>;

double offset(int i) { return (i + 0.5) / kGrid - 0.5; }

Fit make_fit() {
  Eigen::Matrix<double, kGrid * kGrid, 10> basis;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) {
      const double x = offset(i);
      const double y = offset(j);
      basis.row(j * kGrid + i) << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y,
          y * y * y;
    }
  }
  return (basis.transpose() * basis).ldlt().solve(basis.transpose());
}

}  // namespace

SplineImage::SplineImage(std::vector<float> levels, int left, int top, int width, int height)
    : coefficients_(std::move(levels)), left_(left), top_(top), width_(width), height_(height) {
  for (int row = 0; row < height; ++row) {
    prefilter(coefficients_.data() + static_cast<std::ptrdiff_t>(row) * width, width, 1);
  }
  for (int column = 0; column < width; ++column) {
    prefilter(coefficients_.data() + column, height, width);
  }
}

double SplineImage::coefficient(int column, int row) const {
  column = std::clamp(column, 0, width_ - 1);
  row = std::clamp(row, 0, height_ - 1);
  return coefficients_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(column)];
}

double SplineImage::level(double x, double y) const {
  x -= left_;
  y -= top_;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const std::array<double, 4> wx = cubic_weights(x - column);
  const std::array<double, 4> wy = cubic_weights(y - row);
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    double line = 0;
    for (int i = 0; i < 4; ++i) {
      line += wx[static_cast<std::size_t>(i)] * coefficient(column + i - 1, row + j - 1);
    }
    sum += wy[static_cast<std::size_t>(j)] * line;
  }
  return sum;
}

PixelPolynomial SplineImage::polynomial(int x, int y) const {
  static const Fit fit = make_fit();
  Eigen::Matrix<double, kGrid * kGrid, 1> levels;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) levels[j * kGrid + i] = level(x + offset(i), y + offset(j));
  }
  PixelPolynomial out;
  Eigen::Map<Eigen::Matrix<double, 10, 1>>(out.data()) = fit * levels;
  return out;
}

}  // namespace tagwrench

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "host/core/algebra/decompositions.h"

namespace tagwrench {

/// The data of a fit summed up at one place: what a step from there needs.
template <int N>
struct FitSums {
  using Vector = Eigen::Matrix<double, N, 1>;

  Eigen::Matrix<double, N, N> normal = Eigen::Matrix<double, N, N>::Zero();
  Vector right = Vector::Zero();
  double squares = 0;  ///< infinite: no model at this place

  /// `residual`: measured less model; `slope`: of the model.
  void add(const Vector& slope, double residual, double weight = 1) {
    normal.noalias() += weight * slope * slope.transpose();
    right += weight * residual * slope;
    squares += weight * residual * residual;
  }
  /// The step of the last `count` unknowns, the others as they are; the diagonal grown by the part
  /// `damping`. Unknowns that no datum tells of stay.
  Vector step(double damping, int count = N) const {
    Eigen::MatrixXd damped = normal.bottomRightCorner(count, count);
    damped.diagonal() *= 1 + damping;
    Vector out = Vector::Zero();
    out.tail(count) = Ldlt<Eigen::Dynamic>(damped).solve(right.tail(count));
    return out;
  }
};

/// Goes from `place` to a least sum of squares near it (Levenberg 1944, Marquardt, "An algorithm
/// for least-squares estimation of nonlinear parameters", J. SIAM 11, 431, 1963): the more damped,
/// the shorter a step and the more downhill. `look(place)` makes the FitSums there,
/// `moved(place, step)` the next place. Ends after a step that promises less than a millionth of
/// the squares, and returns the sums at the end.
template <class Place, class Look, class Moved>
auto levenberg_marquardt(Place& place, const Look& look, const Moved& moved) {
  constexpr int kMostSteps = 30;
  constexpr double kEnough = 1e-6;
  auto here = look(place);
  double damping = 1e-3;
  for (int i = 0; i < kMostSteps && std::isfinite(here.squares); ++i) {
    const auto step = here.step(damping);
    const double promised = step.dot(here.right);
    Place next = moved(place, step);
    const auto there = look(next);
    const bool last = !(promised > kEnough * here.squares);
    if (there.squares < here.squares) {
      place = next;
      here = there;
      damping = std::max(1e-9, 0.1 * damping);
    } else {
      damping *= 10;
    }
    if (last) break;
  }
  return here;
}

}  // namespace tagwrench

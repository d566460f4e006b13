#include "host/calibration/camera/bundle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "host/core/algebra/decompositions.h"
#include "host/core/algebra/levenberg_marquardt.h"

namespace tagwrench {
namespace {

/// fx fy cx cy k1 k2 p1 p2, the shape's bow, k3: what may be held comes last.
constexpr int kUnknowns = 12, kBow = 8, kK3 = 11;
using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Slope = Eigen::Matrix<double, 2, kUnknowns>;

constexpr double kFlat = 0.01;           // of half the board's length, one standard deviation
constexpr double kNoInformation = 1e-9;  // of a view's largest eigenvalue, terms scaled to one size
constexpr double kSingular = 1e-14;      // reciprocal condition of the scaled normal matrix
constexpr double kUnknownK3 = 1;         // a standard deviation; webcams' lenses stay below
constexpr int kPlaces = 12;              // looked at, across and down the image

/// Of a point's pixel by the terms of the lens; nothing by the shape.
Slope by_lens(const CameraModel& camera, const Eigen::Vector3d& point) {
  const double x = point.x() / point.z(), y = point.y() / point.z();
  const double r2 = x * x + y * y;
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const Eigen::Vector2d outward(camera.fx_px * x, camera.fy_px * y);
  Slope out = Slope::Zero();
  out(0, 0) = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  out(1, 1) = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  out(0, 2) = out(1, 3) = 1;
  out.col(4) = r2 * outward;
  out.col(5) = r2 * r2 * outward;
  out.col(6) << camera.fx_px * 2 * x * y, camera.fy_px * (r2 + 2 * y * y);
  out.col(7) << camera.fx_px * (r2 + 2 * x * x), camera.fy_px * 2 * x * y;
  out.col(kK3) = r2 * r2 * r2 * outward;
  return out;
}

/// Of a point by a turn about the camera's axes.
Eigen::Matrix3d by_turn(const Eigen::Vector3d& p) {
  Eigen::Matrix3d out;
  out << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
  return out;
}

/// One view's residuals, and how they depend on everything.
struct Linear {
  Eigen::MatrixXd pose;      ///< px by a turn about the board's origin (rad) and a shift
  Eigen::MatrixXd rest;      ///< px by the other unknowns
  Eigen::VectorXd residual;  ///< px, measured less projected
};

Linear linear(const CameraBundle& bundle, const PlacedView& view) {
  const auto rows = static_cast<Eigen::Index>(2 * view.corners.size());
  Linear out{Eigen::MatrixXd(rows, 6), Eigen::MatrixXd(rows, kUnknowns), Eigen::VectorXd(rows)};
  const Eigen::Matrix3d r = view.camera_T_board.linear();
  for (Eigen::Index i = 0; i < rows / 2; ++i) {
    const BoardCorner& corner = view.corners[static_cast<std::size_t>(i)];
    const Eigen::Vector3d turned = r * bundle.shape.point(corner.board);
    const Eigen::Vector3d point = turned + view.camera_T_board.translation();
    const ProjectedPoint is = project(bundle.camera, point);
    Slope slope = by_lens(bundle.camera, point);
    if (!bundle.k3_free) slope.col(kK3).setZero();
    const Eigen::Vector2d d = corner.board - bundle.shape.middle;
    slope.block<2, 3>(0, kBow) =
        is.jacobian * r.col(2) * Eigen::RowVector3d(d.x() * d.x(), d.x() * d.y(), d.y() * d.y());
    out.rest.block<2, kUnknowns>(2 * i, 0) = slope;
    out.pose.block<2, 3>(2 * i, 0) = is.jacobian * by_turn(turned);
    out.pose.block<2, 3>(2 * i, 3) = is.jacobian;
    out.residual.segment<2>(2 * i) = corner.pixel - is.pixel;
  }
  return out;
}

/// What one view says about all but its pose.
struct Evidence {
  Matrix information = Matrix::Zero();
  Vector pull = Vector::Zero();
  double squares = 0;  ///< px^2
};

Evidence evidence(const CameraBundle& bundle, const PlacedView& view) {
  const Linear at = linear(bundle, view);
  const Eigen::MatrixXd free = at.rest - at.pose * least_squares(at.pose, at.rest).x;
  return {free.transpose() * free, free.transpose() * at.residual, at.residual.squaredNorm()};
}

/// Of a coefficient of the bow, 1/squares.
double flatness(const BoardShape& shape) { return kFlat / shape.half; }

/// The variance that balances the corners against the board's flatness, px^2.
double variance_of(const CameraBundle& bundle) {
  double squares = 0;
  std::size_t data = 0;
  for (const PlacedView& view : bundle.views) {
    squares += std::pow(rms_px(bundle, view), 2) * static_cast<double>(view.corners.size());
    data += 2 * view.corners.size();
  }
  return std::max(1e-12, squares / static_cast<double>(std::max<std::size_t>(1, data)));
}

/// The next place: lens and shape by `step`, and each pose by what then suits it best.
CameraBundle moved(const CameraBundle& from, const Vector& step) {
  CameraBundle to = from;
  CameraModel& camera = to.camera;
  camera.fx_px += step[0];
  camera.fy_px += step[1];
  camera.cx_px += step[2];
  camera.cy_px += step[3];
  for (int i = 0; i < 4; ++i) camera.distortion[static_cast<std::size_t>(i)] += step[4 + i];
  camera.distortion[4] += step[kK3];
  to.shape.bow += step.segment<3>(kBow);
  for (PlacedView& view : to.views) {
    const Linear at = linear(from, view);
    const Eigen::VectorXd by = least_squares(at.pose, at.residual - at.rest * step).x;
    const Eigen::Vector3d turn = by.head<3>();
    Eigen::Isometry3d& pose = view.camera_T_board;
    if (turn.norm() > 0)
      pose.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * pose.linear();
    pose.translation() += by.tail<3>();
  }
  return to;
}

struct Own {
  double squares = 0;  ///< by which a lens of its own would fit a view better, px^2
  int terms = 0;       ///< of it that the view tells of
};

Own own_lens(const Evidence& view, int terms, const Vector& scale) {
  const Eigen::MatrixXd information =
      (scale.asDiagonal() * view.information * scale.asDiagonal()).topLeftCorner(terms, terms);
  const Eigen::VectorXd pull = scale.cwiseProduct(view.pull).head(terms);
  const auto eigen = symmetric_eigen(information);
  Own out;
  for (Eigen::Index i = 0; i < terms; ++i) {
    if (!(eigen.values[i] > kNoInformation * eigen.values[terms - 1])) continue;
    out.squares += std::pow(eigen.vectors.col(i).dot(pull), 2) / eigen.values[i];
    ++out.terms;
  }
  return out;
}

/// Of the leading terms; the others' rows are 0. Infinite variances where it is singular.
Matrix inverted(const Matrix& information, int terms, const Vector& scale) {
  const Eigen::MatrixXd scaled =
      (scale.asDiagonal() * information * scale.asDiagonal()).topLeftCorner(terms, terms);
  Matrix out = Matrix::Zero();
  const Ldlt<Eigen::Dynamic> factor(scaled);
  if (factor.positive(kSingular)) {
    out.topLeftCorner(terms, terms) = factor.inverse();
    return scale.asDiagonal() * out * scale.asDiagonal();
  }
  out.diagonal().head(terms).setConstant(std::numeric_limits<double>::infinity());
  return out;
}

/// Variances by the jackknife: how far each unknown moves when one view after the other is left
/// out (Efron and Stein, "The jackknife estimate of variance", Annals of Statistics 9, 1981), to
/// first order.
Vector left_out(const std::vector<Evidence>& views, const Matrix& known, double variance, int terms,
                const Vector& scale) {
  Vector out = Vector::Zero();
  if (!(variance > 0)) return out;
  for (const Evidence& view : views) {
    const Matrix rest = inverted(known - view.information / variance, terms, scale);
    if (rest.allFinite()) out += (rest * view.pull / variance).cwiseAbs2();
  }
  const auto count = static_cast<double>(views.size());
  return out * (count - 1) / count;
}

/// Of the pixels' slopes by the lens what a turn of the camera, the one that suits `seen` best,
/// leaves of them.
class FreeTurn {
 public:
  FreeTurn(const CameraModel& camera, const std::vector<Eigen::Vector3d>& seen) : camera_(camera) {
    Eigen::MatrixXd turn(2 * seen.size(), 3), lens(2 * seen.size(), kUnknowns);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(2 * i);
      turn.block<2, 3>(row, 0) = project(camera, seen[i]).jacobian * by_turn(seen[i]);
      lens.block<2, kUnknowns>(row, 0) = by_lens(camera, seen[i]);
    }
    turn_ = least_squares(turn, lens).x;
  }
  Slope left(const Eigen::Vector3d& ray) const {
    return by_lens(camera_, ray) - project(camera_, ray).jacobian * by_turn(ray) * turn_;
  }

 private:
  const CameraModel& camera_;
  Eigen::MatrixXd turn_;
};

std::array<double, 9> regions(const CameraBundle& bundle, const Matrix& covariance) {
  const CameraModel& camera = bundle.camera;
  std::vector<Eigen::Vector3d> seen;
  for (const PlacedView& view : bundle.views) {
    for (const BoardCorner& corner : view.corners)
      seen.push_back(view.camera_T_board * bundle.shape.point(corner.board));
  }
  const FreeTurn free(camera, seen);
  std::array<double, 9> out{};
  for (int row = 0; row < kPlaces; ++row) {
    for (int column = 0; column < kPlaces; ++column) {
      const Eigen::Vector2d pixel((camera.width_px - 1) * column / (kPlaces - 1.0),
                                  (camera.height_px - 1) * row / (kPlaces - 1.0));
      const std::optional<Eigen::Vector3d> ray = unproject(camera, pixel);
      double& sigma = out[static_cast<std::size_t>(row * 3 / kPlaces * 3 + column * 3 / kPlaces)];
      const Slope slope = ray ? free.left(*ray) : Slope::Zero();
      const double here = ray ? std::sqrt((slope * covariance * slope.transpose()).trace())
                              : std::numeric_limits<double>::infinity();
      if (!(here <= sigma)) sigma = here;
    }
  }
  return out;
}

}  // namespace

std::vector<double> errors_px(const CameraBundle& bundle, const PlacedView& view) {
  std::vector<double> out;
  for (const BoardCorner& corner : view.corners) {
    const Eigen::Vector3d point = view.camera_T_board * bundle.shape.point(corner.board);
    out.push_back((corner.pixel - project(bundle.camera, point).pixel).norm());
  }
  return out;
}

double rms_px(const CameraBundle& bundle, const PlacedView& view) {
  double squares = 0;
  for (const double error : errors_px(bundle, view)) squares += error * error;
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, view.corners.size())));
}

void adjust(CameraBundle& bundle) {
  const double variance = variance_of(bundle);
  const double weight = variance / std::pow(flatness(bundle.shape), 2);
  const auto look = [&](const CameraBundle& at) {
    FitSums<kUnknowns> sums;
    for (const PlacedView& view : at.views) {
      const Evidence one = evidence(at, view);
      sums.normal += one.information;
      sums.right += one.pull;
      sums.squares += one.squares;
    }
    for (int i = 0; i < 3; ++i) sums.add(Vector::Unit(kBow + i), -at.shape.bow[i], weight);
    return sums;
  };
  levenberg_marquardt(bundle, look, moved);
}

LensUncertainty lens_uncertainty(const CameraBundle& bundle) {
  const int terms = bundle.k3_free ? kUnknowns : kUnknowns - 1;
  CameraBundle whole = bundle;
  whole.k3_free = true;
  std::vector<Evidence> all;
  Matrix information = Matrix::Zero();
  double squares = 0;
  int data = 0;
  for (const PlacedView& view : whole.views) {
    all.push_back(evidence(whole, view));
    information += all.back().information;
    squares += all.back().squares;
    data += static_cast<int>(2 * view.corners.size()) - 6;
  }
  const Vector scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Own own;
  for (const Evidence& view : all) {
    const Own one = own_lens(view, terms, scale);
    own.squares += one.squares;
    own.terms += one.terms;
  }
  LensUncertainty out;
  const double within = std::max(0.0, squares - own.squares) / std::max(1, data - own.terms);
  out.noise_px = std::sqrt(within);
  if (own.terms > terms && within > 0)
    out.contradiction = std::max(1.0, own.squares / (own.terms - terms) / within);
  Matrix known = information / std::max(1e-300, within * out.contradiction);
  for (int i = 0; i < 3; ++i) known(kBow + i, kBow + i) += 1 / std::pow(flatness(bundle.shape), 2);
  const Matrix covariance = inverted(known, terms, scale);
  const Vector apart = left_out(all, known, within * out.contradiction, terms, scale);
  Vector wider = Vector::Ones();
  for (int i = 0; i < terms; ++i)
    if (apart[i] > covariance(i, i)) wider[i] = std::sqrt(apart[i] / covariance(i, i));
  for (int i = 0; i < kLensTerms; ++i) {
    const int at = i < kBow ? i : kK3;
    out.sigma[static_cast<std::size_t>(i)] = wider[at] * std::sqrt(covariance(at, at));
  }
  known(kK3, kK3) += 1 / (kUnknownK3 * kUnknownK3);
  const Matrix all_free = inverted(known, kUnknowns, scale);
  out.regions_px = regions(bundle, wider.asDiagonal() * all_free * wider.asDiagonal());
  return out;
}

}  // namespace tagwrench

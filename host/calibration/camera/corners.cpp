#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "host/calibration/camera/board.h"
#include "host/core/algebra/decompositions.h"
#include "host/core/algebra/levenberg_marquardt.h"
#include "host/core/robust_statistics.h"

namespace tagwrench {
namespace {

constexpr double kNeighbourhood = 2.9;  // squares
constexpr Eigen::Index kSpare = 4;      // neighbours beyond those that a fit needs
// A corner may stand off its neighbours' grid by this part of the spacing; the nearest corner of a
// marker is twice as far.
constexpr double kOffPlaneGrid = 0.12;
constexpr double kOffCurvedGrid = 0.07;
constexpr double kWidestWindow_px = 14;   // a lens bends lines too little to see over this
constexpr double kWindowFraction = 0.45;  // of the spacing, so that no other edge is in it
constexpr double kWorstFit = 0.25;        // RMS over contrast
constexpr double kWhiteTop = 252;         // grey levels
constexpr int kMinPixels = 25;

/// The board near one corner, linearised: pixel = centre + axes * (board - corner), px per square.
struct LocalGrid {
  Eigen::Vector2d centre;
  Eigen::Matrix2d axes;
  double tolerance_px;  ///< of the centre

  /// Distance between the edges of a square, px: across its columns, across its rows.
  Eigen::Vector2d across_px() const {
    const Eigen::Matrix2d to_board = axes.inverse();
    return to_board.rowwise().norm().cwiseInverse();
  }
  double spacing_px() const { return std::min(axes.col(0).norm(), axes.col(1).norm()); }
};

/// Least squares over the neighbours alone, so that it can contradict the corner itself: of second
/// order where there are enough of them, since perspective and the lens bend the grid.
std::optional<LocalGrid> local_grid(const std::vector<BoardCorner>& corners, std::size_t at) {
  std::vector<const BoardCorner*> neighbours;
  for (std::size_t i = 0; i < corners.size(); ++i)
    if (i != at && (corners[i].board - corners[at].board).norm() <= kNeighbourhood)
      neighbours.push_back(&corners[i]);
  const auto count = static_cast<Eigen::Index>(neighbours.size());
  for (const Eigen::Index terms : {6, 3}) {
    if (count < terms + (terms == 3 ? 0 : kSpare)) continue;
    Eigen::MatrixXd design(count, terms);
    Eigen::MatrixX2d pixels(count, 2);
    for (Eigen::Index i = 0; i < count; ++i) {
      const BoardCorner& neighbour = *neighbours[i];
      const Eigen::Vector2d d = neighbour.board - corners[at].board;
      design.row(i).head<3>() << 1, d.x(), d.y();
      if (terms == 6) design.row(i).tail<3>() << d.x() * d.x(), d.x() * d.y(), d.y() * d.y();
      pixels.row(i) = neighbour.pixel.transpose();
    }
    const LeastSquares solution = least_squares(design, pixels);
    if (solution.rank < terms) continue;
    const Eigen::MatrixXd& fit = solution.x;
    LocalGrid grid{fit.row(0).transpose(), fit.middleRows<2>(1).transpose(), 0};
    grid.tolerance_px = (terms == 6 ? kOffCurvedGrid : kOffPlaneGrid) * grid.spacing_px();
    if (std::abs(grid.axes.determinant()) > 1) return grid;
  }
  return std::nullopt;
}

/// Parameters: corner x y, directions of the edges' normals, ln s, a, m, g.
using Parameters = Eigen::Matrix<double, 9, 1>;

struct Model {
  double value = 0;
  Parameters jacobian = Parameters::Zero();
};

/// How squares and markers lie about one corner.
struct Print {
  double sign = 1;  ///< +1: the quadrants where u and v have the same sign are white
  bool markers = false;
  double gap_u_px = 0, gap_v_px = 0;
};

Model model(const Parameters& p, const Eigen::Vector2d& pixel, const Print& print) {
  const Eigen::Vector2d d = pixel - p.head<2>();
  const double scale = std::exp(-p[4]) * std::numbers::sqrt2 / 2;  // 1 / (sqrt(2) s)
  const Eigen::Vector2d nu(std::cos(p[2]), std::sin(p[2]));
  const Eigen::Vector2d nv(std::cos(p[3]), std::sin(p[3]));
  const double u = nu.dot(d) * scale, v = nv.dot(d) * scale;
  const double fu = std::erf(u), fv = std::erf(v);
  const double k = 2 * std::numbers::inv_sqrtpi;
  double f = print.sign * fu * fv;
  double f_u = print.sign * k * std::exp(-u * u) * fv;  // d f / d u
  double f_v = print.sign * k * std::exp(-v * v) * fu;
  double f_s = -(f_u * u + f_v * v);  // d f / d ln s
  for (const double side : {1.0, -1.0}) {
    if (!print.markers) break;
    const double x = side * u - print.gap_u_px * scale;
    const double y = side * print.sign * v - print.gap_v_px * scale;
    const double px = 0.5 * (1 + std::erf(x)), py = 0.5 * (1 + std::erf(y));
    const double px_x = 0.5 * k * std::exp(-x * x), py_y = 0.5 * k * std::exp(-y * y);
    f -= 2 * px * py;
    f_u -= 2 * side * px_x * py;
    f_v -= 2 * side * print.sign * px * py_y;
    f_s += 2 * (px_x * x * py + px * py_y * y);
  }
  const double a = p[5];
  Model out;
  out.value = p[6] + p.tail<2>().dot(d) + a * f;
  out.jacobian.head<2>() = -a * scale * (f_u * nu + f_v * nv) - p.tail<2>();
  out.jacobian[2] = a * f_u * scale * (nu.x() * d.y() - nu.y() * d.x());
  out.jacobian[3] = a * f_v * scale * (nv.x() * d.y() - nv.y() * d.x());
  out.jacobian[4] = a * f_s;
  out.jacobian[5] = f;
  out.jacobian[6] = 1;
  out.jacobian.tail<2>() = d;
  return out;
}

struct Pixel {
  Eigen::Vector2d at;
  double level;
};

/// Pixels that show the two edges and nothing else.
std::vector<Pixel> window(const ImageView& image, const Eigen::Vector2d& centre,
                          const LocalGrid& grid, const SquareFill& fill) {
  const Eigen::Matrix2d to_board = grid.axes.inverse();
  const Eigen::Vector2d across = grid.across_px();
  const double half_px = std::min(kWidestWindow_px, kWindowFraction * across.minCoeff());
  // A marker's border is part of the model, its cells are not.
  const double clear = fill.markers ? fill.gap + 0.5 * fill.ring : 1;
  std::vector<Pixel> pixels;
  const int reach = static_cast<int>(std::ceil(1.5 * half_px));
  const int cx = static_cast<int>(std::lround(centre.x()));
  const int cy = static_cast<int>(std::lround(centre.y()));
  for (int y = std::max(0, cy - reach); y <= std::min(image.height - 1, cy + reach); ++y) {
    for (int x = std::max(0, cx - reach); x <= std::min(image.width - 1, cx + reach); ++x) {
      const Eigen::Vector2d d = Eigen::Vector2d(x, y) - centre;
      const Eigen::Vector2d board = to_board * d;
      const Eigen::Vector2d off = board.cwiseAbs();
      if (off.cwiseProduct(across).maxCoeff() > half_px || off.minCoeff() > clear) continue;
      pixels.push_back({{x, y}, static_cast<double>(image.pixels[y * image.stride + x])});
    }
  }
  return pixels;
}

/// Half of a window is white, and less of it where there are markers.
bool white_is_cut_off(const std::vector<Pixel>& pixels) {
  const auto top = std::count_if(pixels.begin(), pixels.end(),
                                 [](const Pixel& pixel) { return pixel.level >= kWhiteTop; });
  return static_cast<double>(top) > 0.1 * static_cast<double>(pixels.size());
}

struct Fit {
  Parameters p;
  double rms = 0;
};

/// From the neighbours' grid.
std::optional<Fit> fit_corner(const std::vector<Pixel>& pixels, const Eigen::Vector2d& centre,
                              const LocalGrid& grid, const Print& print) {
  if (pixels.size() < kMinPixels) return std::nullopt;
  const auto look = [&](const Parameters& at) {
    FitSums<9> sums;
    for (const Pixel& pixel : pixels) {
      const Model m = model(at, pixel.at, print);
      const bool cut_off = m.value >= kWhiteTop && pixel.level >= kWhiteTop;
      if (!cut_off) sums.add(m.jacobian, pixel.level - m.value);
    }
    return sums;
  };
  const Eigen::Matrix2d to_board = grid.axes.inverse();
  Parameters p = Parameters::Zero();
  p.head<2>() = centre;
  p[2] = std::atan2(to_board(0, 1), to_board(0, 0));
  p[3] = std::atan2(to_board(1, 1), to_board(1, 0));
  p += look(p).step(0, 4);  // the linear parameters at once
  const double squares = levenberg_marquardt(p, look, std::plus<Parameters>()).squares;
  if (!p.allFinite()) return std::nullopt;
  return Fit{p, std::sqrt(squares / static_cast<double>(pixels.size()))};
}

bool inside(const ImageView& image, const Eigen::Vector2d& pixel, double margin_px) {
  return pixel.x() >= margin_px && pixel.y() >= margin_px &&
         pixel.x() <= image.width - 1 - margin_px && pixel.y() <= image.height - 1 - margin_px;
}

Print print_at(const BoardCorner& corner, const LocalGrid& grid, const SquareFill& fill) {
  if (!fill.markers) return {};
  const bool black = std::lround(corner.board.x() + corner.board.y()) % 2 == 0;
  const Eigen::Vector2d gap_px = fill.gap * grid.across_px();
  return {black ? -1.0 : 1.0, true, gap_px.x(), gap_px.y()};
}

struct Crossing {
  Eigen::Vector2d pixel;
  double blur_px, contrast;
};

std::optional<Crossing> crossing_near(const ImageView& image, const Eigen::Vector2d& start,
                                      const LocalGrid& grid, const SquareFill& fill,
                                      const Print& print) {
  if ((start - grid.centre).norm() > grid.tolerance_px || !inside(image, start, 2))
    return std::nullopt;
  const std::optional<Fit> fit = fit_corner(window(image, start, grid, fill), start, grid, print);
  if (!fit || (print.markers && fit->p[5] <= 0)) return std::nullopt;
  Crossing out;
  out.pixel = fit->p.head<2>();
  out.blur_px = std::exp(fit->p[4]);
  out.contrast = 2 * std::abs(fit->p[5]);
  const bool plausible = (out.pixel - grid.centre).norm() <= grid.tolerance_px &&
                         inside(image, out.pixel, 3 * out.blur_px) &&
                         out.blur_px < grid.spacing_px() && fit->rms <= kWorstFit * out.contrast;
  return plausible ? std::optional(out) : std::nullopt;
}

}  // namespace

RefinedCorners refine_corners(const ImageView& image, const std::vector<BoardCorner>& rough,
                              const SquareFill& fill) {
  RefinedCorners out;
  std::vector<double> blur, spacing, contrast;
  int looked = 0, clipped = 0;
  for (std::size_t i = 0; i < rough.size(); ++i) {
    const std::optional<LocalGrid> grid = local_grid(rough, i);
    if (!grid) continue;
    // A rough corner may have been caught by a marker; then its neighbours know better.
    const Print print = print_at(rough[i], *grid, fill);
    ++looked;
    if (white_is_cut_off(window(image, grid->centre, *grid, fill))) ++clipped;
    std::optional<Crossing> crossing = crossing_near(image, rough[i].pixel, *grid, fill, print);
    if (!crossing) crossing = crossing_near(image, grid->centre, *grid, fill, print);
    if (!crossing) continue;
    out.corners.push_back({rough[i].board, crossing->pixel});
    blur.push_back(crossing->blur_px);
    spacing.push_back(grid->spacing_px());
    contrast.push_back(crossing->contrast);
  }
  out.look = {median(blur), median(spacing), median(contrast),
              looked == 0 ? 0 : clipped / static_cast<double>(looked)};
  return out;
}

}  // namespace tagwrench

#include "host/tracker/edges.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/core/algebra/decompositions.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Points on one cell's side; about 3 to 5 px apart in the reference geometry, so that neighbours'
/// noise is independent.
constexpr int kPointsPerCell = 4;

/// Kept clear on both sides of a corner or crossing, in cells.
constexpr double kCornerMargin = 0.28;

/// Looks at the pattern, with its white margin as a further ring of cells, in rows or in columns,
/// so that one routine serves both directions of edges.
struct Walk {
  const TagPattern& pattern;
  bool vertical_edges;  ///< edges between left and right neighbours

  /// `across` counts along the edge's normal, `along` along the edge.
  bool white(int across, int along) const {
    const int n = pattern.cells;
    if (across < 0 || along < 0 || across >= n || along >= n) return true;
    return vertical_edges ? pattern.is_white(along, across) : pattern.is_white(across, along);
  }

  /// The edge before cell `across`: does it go straight on past the vertex at the lower end of
  /// `along`?
  bool straight_at(int across, int along) const {
    return white(across - 1, along - 1) == white(across - 1, along) &&
           white(across, along - 1) == white(across, along);
  }

  /// Cells of equal colour from the edge before `across`, in the direction of `step`. Sides that
  /// run into the margin return -1.
  int run(int across, int along, int step) const {
    const int first = step > 0 ? across : across - 1;
    int count = 0;
    for (int i = first; i >= 0 && i < pattern.cells; i += step) {
      if (white(i, along) != white(first, along)) return count;
      ++count;
    }
    return count > 0 && !white(first, along) ? count : -1;
  }
};

void add_points(const Walk& walk, std::vector<EdgePoint>& points) {
  const TagPattern& pattern = walk.pattern;
  const int n = pattern.cells;
  const double cell = pattern.size / n;
  const double half = 0.5 * pattern.size;
  for (int across = 0; across <= n; ++across) {
    for (int along = 0; along < n; ++along) {
      const bool before = walk.white(across - 1, along);
      const bool after = walk.white(across, along);
      if (before == after) continue;
      const double low = walk.straight_at(across, along) ? 0.0 : kCornerMargin;
      const double high = walk.straight_at(across, along + 1) ? 1.0 : 1.0 - kCornerMargin;
      EdgePoint point;
      point.reach = 1e9;
      for (const int step : {-1, 1}) {
        const int run = walk.run(across, along, step);
        point.reach = std::min(point.reach, run < 0 ? pattern.border : run * cell);
      }
      point.normal = walk.vertical_edges ? (after ? EdgeNormal::plus_x : EdgeNormal::minus_x)
                                         : (after ? EdgeNormal::plus_y : EdgeNormal::minus_y);
      const double fixed = across * cell - half;
      for (int i = 0; i < kPointsPerCell; ++i) {
        const double moving =
            (along + low + (high - low) * (i + 0.5) / kPointsPerCell) * cell - half;
        point.x = walk.vertical_edges ? fixed : moving;
        point.y = walk.vertical_edges ? moving : fixed;
        points.push_back(point);
      }
    }
  }
}

double median_of_valid(std::span<const EdgeMeasurement> measured, double EdgeMeasurement::*member) {
  std::vector<double> values;
  for (const EdgeMeasurement& m : measured)
    if (m.valid) values.push_back(m.*member);
  return median(std::move(values));
}

/// Part of the way to the next edge that a profile may take.
constexpr double kReachUsed = 0.85;

/// Less contrast than this is noise, grey levels.
constexpr float kMinContrast = 12.0F;

/// And less than this part of the contrast at rest is not the edge that was learned.
constexpr float kMinContrastFraction = 0.35F;

/// A falling gradient of up to this size is noise as well, grey levels per px.
constexpr float kCoarseNoise = 3.0F;

template <class Pixel>
float sample(const Pixel* pixels, int stride, float x, float y) {
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const Pixel* p = pixels + static_cast<std::ptrdiff_t>(row) * stride + column;
  const Pixel* q = p + stride;
  const float upper =
      static_cast<float>(p[0]) + fx * (static_cast<float>(p[1]) - static_cast<float>(p[0]));
  const float lower =
      static_cast<float>(q[0]) + fx * (static_cast<float>(q[1]) - static_cast<float>(q[0]));
  return upper + fy * (lower - upper);
}

/// Bilinear sampling reads one pixel to the right and below. False for NaN too.
template <class Pixel>
bool inside(const PixelView<Pixel>& image, double x, double y) {
  return x >= 0.0 && y >= 0.0 && x < image.width - 1.001 && y < image.height - 1.001;
}

struct Stage {
  bool coarse;
  double half_px;    ///< of the profiles
  int steps;         ///< at most
  double enough_px;  ///< a smaller step ends the stage; of the fine one what is left is far smaller
  double min_scale_px;  ///< a robust scale below this would throw away inliers
};
constexpr Stage kCoarse{true, 9.0, 4, 1.0, 0.7};
constexpr Stage kFine{false, 6.0, 5, 0.03, 0.04};

constexpr int kMinPoints = 24;
constexpr double kMinInlierFraction = 0.5;  ///< of a tag's points, for the tag to be held
constexpr double kMinCellsInView = 0.6;     ///< of a tag's cells
constexpr double kMinCorrelation = 0.75;    ///< of cell grey levels with those expected

/// RMS residuals beyond these are doubted, px: a target learned at rest fits to noise, a bare
/// pattern to its print.
constexpr double kDoubtLearned_px = 0.4;
constexpr double kDoubtBare_px = 2.0;

/// A pose that is useful at all: in front of the lens and not absurdly far, m.
constexpr double kFarthest = 10.0;

/// Brings metres and radians to like size in the normal equations, m.
constexpr double kLengthScale = 5e-3;

bool sane(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d& t = pose.translation();
  return pose.matrix().allFinite() && t.z() > 0 && t.norm() < kFarthest;
}

/// What printers and paper do to a whole tag beyond what single edges show, as a part of its size:
/// feed, stretch, curl. Of two laser printers that were measured, lines along and across the feed
/// differed by 0.2 % on one and 2.8 % on the other; makers then allowed 2 % (B. Beeton,
/// comp.laser-printers, June 1988), an aspect of 0.1 and 1.4 %. An estimate expects a good
/// one; what is claimed has to cover worse.
constexpr double kUsualAspect = 3e-4;
constexpr double kCoherent = 3e-3;
/// An estimate leaves the size to the scale of all: at rest it looks like distance, and perspective
/// would tell it from what lens and blur do to edges.
constexpr double kUsualSize = 3e-4;
/// And to all tags of a sheet together, the ruler that measured them included.
constexpr double kPrintSize = 3e-3;
constexpr double kSpread = 50e-6;       // m: a dot of 600 dpi is 42 um
constexpr double kSpreadApart = 10e-6;  // m

}  // namespace

PrintModes print_row(const EdgePoint& point) {
  const bool along_x = is_along_x(point.normal);
  const double sign = is_reversed(point.normal) ? -1 : 1;
  const double across = sign * (along_x ? point.x : point.y);
  const double along = sign * (along_x ? point.y : point.x);
  PrintModes row;
  row << 1, along_x ? 1 : -1, across, along_x ? across : -across, along;
  return row;
}

PrintModes print_prior() {
  PrintModes sigma;
  sigma << kSpread, kSpreadApart, kUsualSize, kUsualAspect, kUsualAspect;
  return sigma;
}

PrintModes print_sigma(double scatter, double size) {
  const double coherent = std::hypot(kCoherent, scatter / (0.5 * size));
  PrintModes sigma;
  sigma << kSpread, std::hypot(kSpreadApart, scatter), coherent, coherent, coherent;
  return sigma;
}

double print_size_sigma(double scatter, double spread, double size) {
  return std::hypot(kPrintSize, (std::abs(spread) + scatter) / (0.5 * size));
}

EdgePoint shifted(EdgePoint point, double distance) {
  (is_along_x(point.normal) ? point.x : point.y) +=
      is_reversed(point.normal) ? -distance : distance;
  return point;
}

EdgeTag make_edge_tag(const TagPattern& pattern, const Eigen::Isometry3d& platform_T_tag) {
  EdgeTag tag;
  tag.id = pattern.id;
  tag.platform_T_tag = platform_T_tag;
  for (const bool vertical : {true, false}) add_points({pattern, vertical}, tag.points);
  const double cell = pattern.size / pattern.cells;
  for (int row = 0; row < pattern.cells; ++row) {
    for (int column = 0; column < pattern.cells; ++column) {
      tag.cells.push_back({.x = (column + 0.5) * cell - 0.5 * pattern.size,
                           .y = (row + 0.5) * cell - 0.5 * pattern.size,
                           .grey = pattern.is_white(row, column) ? 255.0F : 0.0F});
    }
  }
  return tag;
}

double median_gain(std::span<const EdgeMeasurement> measured) {
  return std::clamp(median_of_valid(measured, &EdgeMeasurement::gain), 0.3, 1.3);
}

double median_contrast(std::span<const EdgeMeasurement> measured) {
  return median_of_valid(measured, &EdgeMeasurement::contrast);
}

EdgeMeter::EdgeMeter(const CameraModel& camera) : camera_(camera) {
  for (int k = 0; k < kWindows; ++k) {
    const double half = kMinHalf_px + k * kHalfStep_px;
    Window& window = windows_[static_cast<std::size_t>(k)];
    window.reach_px = std::min(kReach_px, static_cast<int>(std::ceil(half)));
    for (int i = 0; i < 2 * window.reach_px; ++i) {
      const double s = i + 0.5 - window.reach_px;
      const double q = s * s / (half * half);
      if (q >= 1.0) continue;
      const auto at = static_cast<std::size_t>(i);
      const double w = (1 - q) * (1 - q);
      const double dw = -4 * s / (half * half) * (1 - q);
      window.weight[at] = static_cast<float>(w);
      window.moment[at] = static_cast<float>(s * w);
      window.slope[at] = static_cast<float>(w + s * dw);
      window.drift[at] = static_cast<float>(dw);
    }
  }
}

template <class Pixel>
void EdgeMeter::take(const PixelView<Pixel>& image, const Eigen::Vector2d& centre,
                     const Eigen::Vector2d& direction, const Window& window, bool coarse,
                     float min_contrast, EdgeMeasurement& out) const noexcept {
  const int reach = window.reach_px;
  double x0 = centre.x() - reach * direction.x();
  double x1 = centre.x() + reach * direction.x();
  double step_x = direction.x();
  if (camera_.mirrored) {
    x0 = image.width - 1 - x0;
    x1 = image.width - 1 - x1;
    step_x = -step_x;
  }
  const double y0 = centre.y() - reach * direction.y();
  const double y1 = centre.y() + reach * direction.y();
  if (!inside(image, x0, y0) || !inside(image, x1, y1)) return;

  const auto fx = static_cast<float>(x0);
  const auto fy = static_cast<float>(y0);
  const auto sx = static_cast<float>(step_x);
  const auto sy = static_cast<float>(direction.y());
  std::array<float, kSteps + 1> levels;
  for (int i = 0; i <= 2 * reach; ++i) {
    const auto t = static_cast<float>(i);
    // Rounding may step past the border by a hair at the far end.
    levels[static_cast<std::size_t>(i)] = sample(
        image.pixels, image.stride, std::max(0.0F, fx + t * sx), std::max(0.0F, fy + t * sy));
  }
  float mass = 0;
  float moment = 0;
  float slope = 0;
  float drift = 0;
  for (int i = 0; i < 2 * reach; ++i) {
    const auto at = static_cast<std::size_t>(i);
    float gradient = levels[at + 1] - levels[at];
    if (coarse) gradient = std::max(0.0F, gradient - kCoarseNoise);
    mass += window.weight[at] * gradient;
    moment += window.moment[at] * gradient;
    slope += window.slope[at] * gradient;
    drift += window.drift[at] * gradient;
  }
  out.contrast = mass;
  if (!(mass > min_contrast)) return;
  out.offset_px = moment / mass;
  out.gain = (slope - out.offset_px * drift) / mass;
  out.valid = true;
}

template <class Pixel>
void EdgeMeter::measure(const PixelView<Pixel>& image, const EdgeTag& tag,
                        const Eigen::Isometry3d& camera_T_platform, double half_width_px,
                        bool coarse, std::span<EdgeMeasurement> out) const noexcept {
  const Eigen::Isometry3d camera_T_tag = camera_T_platform * tag.platform_T_tag;
  const Eigen::Vector3d origin = camera_T_tag.translation();
  const Eigen::Vector3d axis_x = camera_T_tag.linear().col(0);
  const Eigen::Vector3d axis_y = camera_T_tag.linear().col(1);
  const Eigen::Vector3d centre = camera_T_platform.translation();
  const std::size_t count = std::min(out.size(), tag.points.size());
  for (std::size_t i = 0; i < count; ++i) {
    const EdgePoint& point = tag.points[i];
    EdgeMeasurement& m = out[i];
    m.valid = false;
    m.too_near = false;
    m.weight = 0;
    const Eigen::Vector3d p = origin + point.x * axis_x + point.y * axis_y;
    const ProjectedPoint projected = project(camera_, p);
    if (!projected.valid) continue;

    const Eigen::Vector2d along_x = projected.jacobian * axis_x;
    const Eigen::Vector2d along_y = projected.jacobian * axis_y;
    const bool normal_x = is_along_x(point.normal);
    const Eigen::Vector2d& tangent = normal_x ? along_y : along_x;
    Eigen::Vector2d toward_white = normal_x ? along_x : along_y;
    if (is_reversed(point.normal)) toward_white = -toward_white;
    const double length = tangent.norm();
    if (!(length > 0)) continue;
    Eigen::Vector2d direction(-tangent.y() / length, tangent.x() / length);
    m.px_per_m = direction.dot(toward_white);
    if (m.px_per_m < 0) {
      direction = -direction;
      m.px_per_m = -m.px_per_m;
    }
    const double half =
        std::min({half_width_px, kReachUsed * point.reach * m.px_per_m, kWidestHalf_px});
    m.too_near = !(half >= kMinHalf_px);
    if (m.too_near) continue;
    const auto window = static_cast<std::size_t>(std::lround((half - kMinHalf_px) / kHalfStep_px));
    take(image, projected.pixel, direction, windows_[std::min<std::size_t>(window, kWindows - 1)],
         coarse, std::max(kMinContrast, kMinContrastFraction * point.contrast), m);
    if (!m.valid) continue;
    const Eigen::Vector3d pull = projected.jacobian.transpose() * direction;
    m.row.head<3>() = pull;
    m.row.tail<3>() = (p - centre).cross(pull);
  }
}

template <class Pixel>
double EdgeMeter::cell_grey(const PixelView<Pixel>& image, const EdgeTag& tag,
                            const CellPoint& cell,
                            const Eigen::Isometry3d& camera_T_platform) const noexcept {
  const Eigen::Vector3d p =
      camera_T_platform * (tag.platform_T_tag * Eigen::Vector3d(cell.x, cell.y, 0));
  const ProjectedPoint projected = project(camera_, p);
  if (!projected.valid) return -1;
  const double x = camera_.mirrored ? image.width - 1 - projected.pixel.x() : projected.pixel.x();
  if (!inside(image, x, projected.pixel.y())) return -1;
  return sample(image.pixels, image.stride, static_cast<float>(x),
                static_cast<float>(projected.pixel.y()));
}

template void EdgeMeter::measure(const PixelView<std::uint8_t>&, const EdgeTag&,
                                 const Eigen::Isometry3d&, double, bool,
                                 std::span<EdgeMeasurement>) const noexcept;
template void EdgeMeter::measure(const PixelView<float>&, const EdgeTag&, const Eigen::Isometry3d&,
                                 double, bool, std::span<EdgeMeasurement>) const noexcept;
template double EdgeMeter::cell_grey(const PixelView<std::uint8_t>&, const EdgeTag&,
                                     const CellPoint&, const Eigen::Isometry3d&) const noexcept;
template double EdgeMeter::cell_grey(const PixelView<float>&, const EdgeTag&, const CellPoint&,
                                     const Eigen::Isometry3d&) const noexcept;

void Refiner::set_target(EdgeTarget target) {
  target_ = std::move(target);
  first_.assign(1, 0);
  for (const EdgeTag& tag : target_.tags) first_.push_back(first_.back() + tag.points.size());
  measurements_.assign(first_.back(), EdgeMeasurement{});
  scratch_.assign(first_.back(), 0.0F);
  excluded_.assign(target_.tags.size(), false);
}

Refinement Refiner::refine(const ImageView& image, const Eigen::Isometry3d& predicted) noexcept {
  Refinement fit;
  if (image.pixels == nullptr || target_.tags.empty() || !sane(predicted)) return fit;
  fit.camera_T_platform = predicted;
  std::fill(excluded_.begin(), excluded_.end(), false);

  // Where tags are covered, their few stray points pulled at the fit: once more without them.
  int held = 0;
  for (int round = 0; round < 2 && held < static_cast<int>(target_.tags.size()); ++round) {
    if (!converge(image, fit)) return fit;
    held = judge_tags(image, fit);
    if (held == 0) return fit;
  }
  fit.tags_held = static_cast<std::uint8_t>(held);
  renormalise(fit.camera_T_platform);
  const double doubt_px = target_.residual_px > 0 ? kDoubtLearned_px : kDoubtBare_px;
  const bool accepted = fit.residual_px < doubt_px && is_precise(fit.covariance);
  fit.verdict = accepted ? Verdict::held : Verdict::doubtful;
  return fit;
}

bool Refiner::converge(const ImageView& image, Refinement& fit) noexcept {
  for (const Stage& stage : {kCoarse, kFine}) {
    for (int i = 0; i < stage.steps; ++i) {
      for (std::size_t t = 0; t < target_.tags.size(); ++t) {
        if (excluded_[t]) {
          for (EdgeMeasurement& m : of_tag(t)) m.valid = false;
        } else {
          meter_.measure(pixel_view(image), target_.tags[t], fit.camera_T_platform, stage.half_px,
                         stage.coarse, of_tag(t));
        }
      }
      const std::optional<double> moved_px = solve(stage.min_scale_px, fit);
      if (!moved_px) return false;
      if (*moved_px < stage.enough_px) break;
    }
  }
  return true;
}

/// Standard deviation of the valid offsets about zero, from their median: half of the points may be
/// wrong.
double Refiner::robust_scale_px() noexcept {
  std::size_t count = 0;
  for (const EdgeMeasurement& m : measurements_)
    if (m.valid) scratch_[count++] = static_cast<float>(std::abs(m.offset_px));
  if (count == 0) return 0;
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.begin() + static_cast<std::ptrdiff_t>(count));
  return kMadToSigma * static_cast<double>(*middle);
}

std::optional<double> Refiner::solve(double min_scale_px, Refinement& fit) noexcept {
  Vector6 units;
  units << Eigen::Vector3d::Constant(kLengthScale), Eigen::Vector3d::Ones();
  const double cut = kTukey95 * std::max(robust_scale_px(), min_scale_px);
  Matrix6 normal = Matrix6::Zero();
  Vector6 rhs = Vector6::Zero();
  double weights = 0;
  double gains = 0;
  int inliers = 0;
  for (EdgeMeasurement& m : measurements_) {
    m.weight = m.valid ? biweight(m.offset_px / cut) : 0;
    if (m.weight == 0) continue;
    ++inliers;
    weights += m.weight;
    gains += m.weight * m.gain;
    const Vector6 row = m.row.cwiseProduct(units);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, m.weight);
    rhs += m.weight * m.offset_px * row;
  }
  if (inliers < kMinPoints) return {};
  // All points share one gain: a single profile's is noisy.
  const double gain = std::clamp(gains / weights, 0.3, 1.3);
  const Matrix6 full = normal.selfadjointView<Eigen::Lower>();
  const Ldlt<6> ldlt(full);
  if (!ldlt.positive(1e-12)) return {};
  const Vector6 delta = (ldlt.solve(rhs) / gain).cwiseProduct(units);
  if (!delta.allFinite()) return {};

  double moved_px2 = 0;
  double residual_px2 = 0;
  for (const EdgeMeasurement& m : measurements_) {
    if (m.weight <= 0) continue;
    const double change = m.row.dot(delta);
    const double left = m.offset_px / gain - change;
    moved_px2 += m.weight * change * change;
    residual_px2 += m.weight * left * left;
  }
  const Eigen::Isometry3d next = moved(fit.camera_T_platform, delta);
  if (!sane(next)) return {};
  fit.camera_T_platform = next;
  const double variance_px2 = residual_px2 / std::max(1.0, weights - 6.0);
  fit.residual_px = std::sqrt(residual_px2 / weights);
  fit.covariance = variance_px2 * (units.asDiagonal() * ldlt.inverse() * units.asDiagonal());
  return std::sqrt(moved_px2 / weights);
}

/// Excludes the tags that the fit or their looks speak against; the number of those left.
int Refiner::judge_tags(const ImageView& image, const Refinement& fit) noexcept {
  int held = 0;
  for (std::size_t t = 0; t < target_.tags.size(); ++t) {
    if (excluded_[t]) continue;
    int inliers = 0;
    int measurable = 0;
    for (const EdgeMeasurement& m : of_tag(t)) {
      inliers += m.weight > 0.2 ? 1 : 0;
      measurable += m.too_near ? 0 : 1;
    }
    const bool enough = measurable > 0 && inliers >= kMinInlierFraction * measurable;
    excluded_[t] = !enough || !looks_like_tag(image, target_.tags[t], fit.camera_T_platform);
    held += excluded_[t] ? 0 : 1;
  }
  return held;
}

/// Correlation of the cells' grey levels with those expected: indifferent to gain and offset of the
/// light.
bool Refiner::looks_like_tag(const ImageView& image, const EdgeTag& tag,
                             const Eigen::Isometry3d& pose) noexcept {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (const CellPoint& cell : tag.cells) {
    const double a = meter_.cell_grey(pixel_view(image), tag, cell, pose);
    if (a < 0) continue;
    const auto b = static_cast<double>(cell.grey);
    n += 1;
    sa += a;
    sb += b;
    saa += a * a;
    sbb += b * b;
    sab += a * b;
  }
  if (n < kMinCellsInView * static_cast<double>(tag.cells.size())) return false;
  const double var_a = saa - sa * sa / n;
  const double var_b = sbb - sb * sb / n;
  if (!(var_a > n) || !(var_b > n)) return false;
  return (sab - sa * sb / n) > kMinCorrelation * std::sqrt(var_a * var_b);
}

}  // namespace tagwrench

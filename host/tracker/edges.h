// What a printed tag offers to measure, the boundaries between its black and white cells and the
// cells themselves, and where they really are in an image, seen from a pose that is nearly right;
// and from there to the pose: the seam at which another method of refinement can take over.
//
// The method here is model-based edge fitting: every black-white boundary of all tags gives points,
// each measured by a profile across the edge, and one rigid pose is fitted to all of them by
// Gauss-Newton with Tukey weights. Compare Drummond and Cipolla, "Real-time visual tracking of
// complex structures", PAMI 24(7), 2002.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// The direction along which an edge goes from black to white, in the tag's axes.
enum class EdgeNormal : std::uint8_t { plus_x, minus_x, plus_y, minus_y };

constexpr bool is_along_x(EdgeNormal normal) { return normal <= EdgeNormal::minus_x; }
constexpr bool is_reversed(EdgeNormal normal) {
  return normal == EdgeNormal::minus_x || normal == EdgeNormal::minus_y;
}

/// One place on a black-white boundary, in the tag's plane.
struct EdgePoint {
  double x = 0;  ///< m, tag axes, learned offset included
  double y = 0;
  EdgeNormal normal = EdgeNormal::plus_x;
  double reach = 0;    ///< to the nearest other edge along the normal, m: no profile is longer
  float contrast = 0;  ///< grey levels from black to white at rest; 0 when not learned
};

/// The point moved along its normal, toward white, m.
EdgePoint shifted(EdgePoint point, double distance);

/// How a whole tag's print lies off its pattern, in the tag's plane: ink spread (m, toward white)
/// and half of its excess along x over y (m); size, aspect (x longer, y shorter) and shear, each as
/// a part. Paper, printer, cut and the bleeding of light make them; a picture at rest tells aspect
/// and shear from tilt only by perspective, and size from distance not at all.
inline constexpr int kPrintModes = 5;
inline constexpr int kSizeMode = 2;
using PrintModes = Eigen::Matrix<double, kPrintModes, 1>;

/// How far (m, toward white) an edge point of the pattern moves with each of them.
PrintModes print_row(const EdgePoint& point);

/// One standard deviation of each as printers usually are: what an estimate leans on.
PrintModes print_prior();

/// And as bad as this print may be, whose single edges scatter by `scatter` (m, robust standard
/// deviation) about the pattern of a tag of `size` (m), for what scatters from edge to edge may be
/// alike over the whole tag as well: what may be claimed of that estimate.
PrintModes print_sigma(double scatter, double size);

/// Where the middle of a tag is in its plane, one standard deviation, m: paper that stands off a
/// few hundredths of a millimetre is seen beside its place. An estimate. Nothing but the point
/// hangs on it to which displacement belongs.
inline constexpr double kPrintCentre = 5e-6;

/// And of the size of all tags of a target together, whose ink spreads by `spread` (m): a part.
double print_size_sigma(double scatter, double spread, double size);

/// The middle of one cell.
struct CellPoint {
  double x = 0;  ///< m, tag axes
  double y = 0;
  float grey = 0;  ///< level expected there, up to gain and offset
};

struct EdgeTag {
  int id = 0;
  Eigen::Isometry3d platform_T_tag = Eigen::Isometry3d::Identity();
  std::vector<EdgePoint> points;
  std::vector<CellPoint> cells;
};

/// One rigid body made of tags.
struct EdgeTarget {
  std::vector<EdgeTag> tags;
  double residual_px = 0;  ///< RMS of the fit at rest; 0 when not learned
};

/// Points along every boundary of the pattern, away from the places where boundaries meet: blur
/// rounds these off.
EdgeTag make_edge_tag(const TagPattern& pattern, const Eigen::Isometry3d& platform_T_tag);

/// Luminance of any number type, borrowed. Row r starts at pixels + r * stride.
template <class Pixel>
struct PixelView {
  const Pixel* pixels = nullptr;
  int width = 0;
  int height = 0;
  int stride = 0;
};

inline PixelView<std::uint8_t> pixel_view(const ImageView& image) {
  return {image.pixels, image.width, image.height, image.stride};
}

/// One edge point's place in the image.
struct EdgeMeasurement {
  Vector6 row = Vector6::Zero();  ///< d offset_px / d motion of the platform (m, rad, camera axes;
                                  ///< see rotation.h)
  double offset_px = 0;           ///< of the edge from its predicted place, toward the white side
  double gain = 1;      ///< d offset_px / d true offset: below 1, for profiles are cut and blurred
  double contrast = 0;  ///< weighted grey levels across the edge, positive when as printed
  double px_per_m = 0;  ///< image distance per distance along the normal in the tag's plane
  double weight = 0;    ///< for the solver
  bool too_near = false;  ///< another edge is so near that no profile fits between
  bool valid = false;     ///< projected, inside the image, and with contrast
};

/// Medians over the valid ones: of the gain, kept within what is sensible, as a single profile's is
/// noisy; and of the contrast.
double median_gain(std::span<const EdgeMeasurement> measured);
double median_contrast(std::span<const EdgeMeasurement> measured);

/// Takes profiles across edges and finds the edge in each by the centroid of its gradient under a
/// symmetric window. Where the predicted place is right, the centroid of any symmetric edge is
/// zero, whatever its blur: the truncation of the profile slows convergence and leaves no bias. The
/// gain is the exact derivative of the centroid.
class EdgeMeter {
 public:
  static constexpr double kWidestHalf_px = 10.0;

  explicit EdgeMeter(const CameraModel& camera);

  /// Fills `out`, one for each point of the tag. Profiles reach half_width_px to each side or as
  /// far as the pattern allows. `coarse` ignores falling gradients, so that a neighbouring edge in
  /// the window does not pull.
  template <class Pixel>
  void measure(const PixelView<Pixel>& image, const EdgeTag& tag,
               const Eigen::Isometry3d& camera_T_platform, double half_width_px, bool coarse,
               std::span<EdgeMeasurement> out) const noexcept;

  /// Grey level in the middle of a cell; negative outside the image.
  template <class Pixel>
  double cell_grey(const PixelView<Pixel>& image, const EdgeTag& tag, const CellPoint& cell,
                   const Eigen::Isometry3d& camera_T_platform) const noexcept;

  const CameraModel& camera() const noexcept { return camera_; }

 private:
  static constexpr int kReach_px = 10;          // samples to each side at most
  static constexpr int kSteps = 2 * kReach_px;  // gradients lie between samples
  static constexpr double kMinHalf_px = 1.5;
  static constexpr double kHalfStep_px = 0.25;
  static constexpr int kWindows = 35;  // 1.5 .. 10 px

  struct Window {
    int reach_px = 0;                    // samples -reach..reach
    std::array<float, kSteps> weight{};  // w(s) at s = -reach + 1/2 + i
    std::array<float, kSteps> moment{};  // s w(s)
    std::array<float, kSteps> slope{};   // d(s w)/ds
    std::array<float, kSteps> drift{};   // dw/ds
  };

  template <class Pixel>
  void take(const PixelView<Pixel>& image, const Eigen::Vector2d& centre,
            const Eigen::Vector2d& direction, const Window& window, bool coarse, float min_contrast,
            EdgeMeasurement& out) const noexcept;

  CameraModel camera_;
  std::array<Window, kWindows> windows_{};
};

enum class Verdict : std::uint8_t {
  held,      ///< the fit is accepted
  doubtful,  ///< something like the target is there, but the fit is poor
  lost,      ///< no fit
};

struct Refinement {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< of the platform's motion, camera axes: m, rad
  double residual_px = 0;                ///< weighted RMS
  std::uint8_t tags_held = 0;  ///< that carried the fit and whose cells still look like the tag
  Verdict verdict = Verdict::lost;
};

class Refiner {
 public:
  explicit Refiner(const CameraModel& camera) : meter_(camera) {}

  /// Allocates; everything else does not.
  void set_target(EdgeTarget target);
  const EdgeTarget& target() const noexcept { return target_; }

  /// `predicted` must be within about half a cell of the truth in the image. Never throws, never
  /// allocates. A lost verdict leaves the other fields meaningless, but finite.
  Refinement refine(const ImageView& image, const Eigen::Isometry3d& predicted) noexcept;

 private:
  bool converge(const ImageView& image, Refinement& fit) noexcept;
  /// RMS change of the image points, px; nothing where there is no solution.
  std::optional<double> solve(double min_scale_px, Refinement& fit) noexcept;
  double robust_scale_px() noexcept;
  int judge_tags(const ImageView& image, const Refinement& fit) noexcept;
  bool looks_like_tag(const ImageView& image, const EdgeTag& tag,
                      const Eigen::Isometry3d& pose) noexcept;
  std::span<EdgeMeasurement> of_tag(std::size_t tag) noexcept {
    return std::span(measurements_).subspan(first_[tag], first_[tag + 1] - first_[tag]);
  }

  EdgeMeter meter_;
  EdgeTarget target_;
  std::vector<EdgeMeasurement> measurements_;  // all tags, in order
  std::vector<std::size_t> first_;             // of each tag, and the end
  std::vector<float> scratch_;
  std::vector<bool> excluded_;  // tags that are covered in this frame
};

}  // namespace tagwrench

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "host/tools/design/design.h"

namespace tagwrench::study {
namespace {

constexpr int kPieces = 4;  // of a cell's side: perspective changes along it
constexpr double kFullScale = 255;

using Information = Eigen::MatrixXd;
using Jacobian = Eigen::Matrix<double, 2, 6>;

Eigen::Vector2d project(const SeenPicture& picture, const Eigen::Vector3d& p) {
  return {picture.fx_px * p.x() / p.z() + picture.cx_px,
          picture.fy_px * p.y() / p.z() + picture.cy_px};
}

/// px per m and rad of the displacement about `origin`, of a point of the tag (camera frame, where
/// it is and not where it is seen).
Jacobian image_motion(const SeenPicture& picture, const SeenTag& tag, const Eigen::Vector3d& p,
                      const Eigen::Vector3d& origin) {
  const Eigen::Vector3d at = tag.seen(p);
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << picture.fx_px / at.z(), 0, -picture.fx_px * at.x() / (at.z() * at.z()),  //
      0, picture.fy_px / at.z(), -picture.fy_px * at.y() / (at.z() * at.z());
  if (tag.mirror) by_point *= tag.mirror->reflection();
  const Eigen::Vector3d arm = p - origin;
  Eigen::Matrix3d by_rotation;  // d (r x arm) / dr
  by_rotation << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  Jacobian motion;
  motion << by_point, by_point * by_rotation;
  return motion;
}

/// One straight piece of a boundary in tag axes, paper to its left seen along `from` -> `to` with y
/// down (x right).
struct Piece {
  Eigen::Vector2d from, to;
};

class TagEdges {
 public:
  explicit TagEdges(const SeenTag& tag) : tag_(tag), cell_(tag.size / tag.cells) {
    for (int line = 0; line <= tag.cells; ++line) {
      for (int along = 0; along < tag.cells; ++along) {
        upright(line, along);
        level(line, along);
      }
    }
  }
  const std::vector<Piece>& pieces() const { return pieces_; }

 private:
  bool white(int row, int column) const {
    if (row < 0 || column < 0 || row >= tag_.cells || column >= tag_.cells) return true;
    return tag_.white[static_cast<std::size_t>(row * tag_.cells + column)] != 0;
  }
  Eigen::Vector2d corner(int row, int column) const {
    return {column * cell_ - 0.5 * tag_.size, row * cell_ - 0.5 * tag_.size};
  }
  void add(bool before, bool after, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    if (before == after) return;
    for (int i = 0; i < kPieces; ++i) {
      const Eigen::Vector2d a = from + (to - from) * (static_cast<double>(i) / kPieces);
      const Eigen::Vector2d b = from + (to - from) * (static_cast<double>(i + 1) / kPieces);
      pieces_.push_back(before ? Piece{a, b} : Piece{b, a});
    }
  }
  void upright(int line, int row) {
    add(white(row, line - 1), white(row, line), corner(row + 1, line), corner(row, line));
  }
  void level(int line, int column) {
    add(white(line - 1, column), white(line, column), corner(line, column),
        corner(line, column + 1));
  }

  const SeenTag& tag_;
  double cell_;
  std::vector<Piece> pieces_;
};

/// Pixels that a rectangle of the tag's plane covers.
double area_px(const SeenTag& tag, const SeenPicture& picture, double half) {
  Eigen::Vector2d corners[4];
  const double x[] = {-half, half, half, -half};
  const double y[] = {-half, -half, half, half};
  for (int i = 0; i < 4; ++i)
    corners[i] = project(picture, tag.seen(tag.camera_T_tag * Eigen::Vector3d(x[i], y[i], 0)));
  double twice = 0;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % 4];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return 0.5 * std::abs(twice);
}

double white_share(const SeenTag& tag) {
  double count = 0;
  for (const std::uint8_t cell : tag.white) count += cell != 0 ? 1 : 0;
  return count / static_cast<double>(tag.white.size());
}

/// Adds what one tag tells of the six, of its gain (unknown `gain`, per full scale) and of its
/// offset (unknown gain + 1, grey levels), in units of 1 / noise^2.
void add_tag(const SeenTag& tag, const Eigen::Vector3d& origin, const SeenPicture& picture,
             Eigen::Index gain, Information& information) {
  // A pixel averages over its width, which widens the point spread.
  const double spread = std::sqrt(picture.blur_px * picture.blur_px + 1.0 / 12);
  const double contrast = picture.contrast_counts;
  const double per_length = contrast * contrast / (2 * std::sqrt(std::numbers::pi) * spread);
  const double middle = 0.5 * contrast / kFullScale;  // level of the middle of an edge; ink is 0
  const TagEdges edges(tag);
  for (const Piece& piece : edges.pieces()) {
    const auto in_camera = [&](const Eigen::Vector2d& p) -> Eigen::Vector3d {
      return tag.camera_T_tag * Eigen::Vector3d(p.x(), p.y(), 0);
    };
    const Eigen::Vector2d along = project(picture, tag.seen(in_camera(piece.to))) -
                                  project(picture, tag.seen(in_camera(piece.from)));
    const double length = along.norm();
    const double paper_side = tag.mirror ? -1 : 1;  // left is right in a mirror
    const Eigen::RowVector2d normal =
        paper_side / length * Eigen::RowVector2d(along.y(), -along.x());  // towards paper
    const Eigen::Matrix<double, 1, 6> shift =
        normal * image_motion(picture, tag, in_camera(0.5 * (piece.from + piece.to)), origin);
    information.topLeftCorner<6, 6>() += per_length * length * shift.transpose() * shift;
    // Sums of the slope, -contrast per px of shift across the edge, against the level and
    // against 1.
    information.block<6, 1>(0, gain) -= contrast * middle * length * shift.transpose();
    information.block<6, 1>(0, gain + 1) -= contrast * length * shift.transpose();
  }
  const double square = area_px(tag, picture, 0.5 * tag.size);
  const double all = area_px(tag, picture, 0.5 * tag.size + tag.border);
  const double paper = all - square + square * white_share(tag);
  const double level = contrast / kFullScale;
  information(gain, gain) += paper * level * level;
  information(gain, gain + 1) += paper * level;
  information(gain + 1, gain + 1) += all;
}

}  // namespace

Matrix6 displacement_bound(const std::vector<SeenTag>& tags, const Eigen::Vector3d& origin,
                           const SeenPicture& picture) {
  const auto unknowns = static_cast<Eigen::Index>(6 + 2 * tags.size());
  Information information = Information::Zero(unknowns, unknowns);
  for (std::size_t t = 0; t < tags.size(); ++t)
    add_tag(tags[t], origin, picture, static_cast<Eigen::Index>(6 + 2 * t), information);
  const Information whole = Information(information.selfadjointView<Eigen::Upper>()) /
                            (picture.noise_counts * picture.noise_counts);
  // Metres and radians are far apart; scaled, the inverse is well conditioned.
  const Eigen::VectorXd scale = whole.diagonal().cwiseSqrt().cwiseInverse();
  const Information scaled = scale.asDiagonal() * whole * scale.asDiagonal();
  const Information inverse = scale.asDiagonal() * scaled.inverse() * scale.asDiagonal();
  return inverse.topLeftCorner<6, 6>();
}

}  // namespace tagwrench::study

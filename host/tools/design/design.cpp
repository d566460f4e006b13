#include "host/tools/design/design.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/acquire.h"
#include "host/tracker/rotation.h"

namespace tagwrench::study {
namespace {

constexpr double kShear = 79e9;      // of spring steel, Pa
constexpr double kEndCoils = 2;      // closed ends
constexpr double kNearStill = 0.15;  // of the frame rate: an alias that passes for slow motion
constexpr double kFarForce = 1e9;    // N, beyond what any spring's numbers here make
constexpr double kSharedEdges = 4;   // standard deviations of the point spread, in a cell
constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};

/// The motion of all points that is this displacement of `origin`.
Eigen::Isometry3d moved(const Vector6& displacement, const Eigen::Vector3d& origin) {
  const Eigen::Translation3d rest(origin);
  return tagwrench::moved(Eigen::Isometry3d(rest), displacement) * rest.inverse();
}

Eigen::Vector2d project(const SeenPicture& picture, const Eigen::Vector3d& p) {
  return {picture.fx_px * p.x() / p.z() + picture.cx_px,
          picture.fy_px * p.y() / p.z() + picture.cy_px};
}

bool corner_in_view(const SeenPicture& picture, const Eigen::Vector3d& p) {
  if (p.z() <= 0) return false;
  const Eigen::Vector2d at = project(picture, p);
  return at.minCoeff() >= 0 && at.x() <= picture.width_px - 1 && at.y() <= picture.height_px - 1;
}

bool in_view(const Instrument& instrument, const Vector6& displacement) {
  const Eigen::Isometry3d motion = moved(displacement, instrument.origin);
  for (const SeenTag& tag : instrument.tags) {
    for (const Eigen::Vector3d& corner : square_corners(0.5 * tag.size + tag.border)) {
      const Eigen::Vector3d seen = tag.seen(motion * (tag.camera_T_tag * corner));
      if (!corner_in_view(instrument.picture, seen)) return false;
    }
  }
  return true;
}

/// Largest force, N, both ways, under which the papers stay in view.
double force_in_view(const Instrument& instrument, const Vector6& per_newton, double most) {
  const auto seen = [&](double force) {
    return in_view(instrument, force * per_newton) && in_view(instrument, -force * per_newton);
  };
  if (!seen(0)) return 0;
  constexpr double kGrowth = 1.01;
  double force = 1e-3;
  while (force < most && seen(force)) force *= kGrowth;
  return std::min(force, most);
}

/// Largest force, N, at most `most`, under which no spring closes; empty: the springs' numbers do
/// not go together.
std::optional<double> force_to_solid(const Instrument& instrument, const Vector6& per_newton,
                                     double most) {
  std::optional<double> least;
  for (const Spring& spring : instrument.springs) {
    const double room = spring.free_length - solid_length(spring);
    if (room <= 0) return {};
    const Eigen::Vector3d r = per_newton.tail<3>();
    const double closing = std::abs(per_newton.z() + r.cross(spring.top).z());
    const double force = closing > 0 ? room / closing : most;
    least = std::min(least.value_or(most), force);
  }
  return least;
}

DesignRow row(const Instrument& instrument, const Design& design, double range, double scale) {
  const Matrix6 stiffness = scale * instrument.stiffness;
  const Matrix6 compliance = inverse(stiffness);
  const CountedPixels& counted = instrument.counted;
  const Matrix6 covariance =
      displacement_bound(instrument.tags, instrument.origin, instrument.picture);
  return {.range = range,
          .scale = scale,
          .lateral = stiffness(0, 0),
          .axial = stiffness(2, 2),
          .travel_lateral = range * std::max(compliance(0, 0), compliance(1, 1)),
          .travel_axial = range * compliance(2, 2),
          .counted_x = counted_force(range, counted.travel_x_px(), counted.counts_per_px),
          .counted_y = counted_force(range, counted.travel_y_px(), counted.counts_per_px),
          .bound = (stiffness * covariance * stiffness.transpose()).diagonal().cwiseSqrt(),
          .lowest = std::sqrt(scale) * design.modes.front(),
          .highest = std::sqrt(scale) * design.modes.back()};
}

void warn_of_reach(const Instrument& instrument, Design& design) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Reach& reach = design.reach[axis];
    if (reach.in_view < instrument.range) {
      design.warnings.push_back(fmt::format(
          "tags leave the image at {:.2f} N along {}, before the range of {:g} N: the platform "
          "tilts as it moves; take stiffer springs, smaller tags or a longer way to the lens",
          reach.in_view, kAxes[axis], instrument.range));
    }
    if (reach.to_solid && *reach.to_solid < instrument.range) {
      design.warnings.push_back(
          fmt::format("springs bottom out at {:.2f} N along {}, before the range of {:g} N: take "
                      "longer or stiffer springs",
                      *reach.to_solid, kAxes[axis], instrument.range));
    }
  }
}

void warn_of_springs(const Instrument& instrument, Design& design) {
  for (const Spring& spring : instrument.springs) {
    const double solid = solid_length(spring);
    if (solid < spring.free_length) continue;
    const double room = spring.free_length / spring.wire - kEndCoils;
    design.warnings.push_back(
        fmt::format("springs: wire of {:.2f} mm wound to {:.2f} mm takes {:.0f} coils for {:.2f} "
                    "N/mm, {:.1f} mm long when closed, but the spring is {:.1f} mm long: with room "
                    "for {:.0f} at most it has more than {:.2f} N/mm; measure the rate, or give "
                    "--coils. Bottoming out is not predicted",
                    1e3 * spring.wire, 1e3 * spring.outer_diameter, solid / spring.wire,
                    1e-3 * spring.rate, 1e3 * solid, 1e3 * spring.free_length, room,
                    1e-3 * spring.rate * active_coils(spring) / room));
    return;
  }
}

void warn_of_modes(const Instrument& instrument, Design& design) {
  std::string modes, aliases;
  for (const double mode : design.modes) {
    const double seen = alias(mode, instrument.frame_rate);
    if (seen > kNearStill * instrument.frame_rate) continue;
    modes += fmt::format("{:.1f} ", mode);
    aliases += fmt::format("{:.1f} ", seen);
  }
  if (modes.empty()) return;
  design.warnings.push_back(
      fmt::format("the platform rings at {}Hz, which pictures at {:g} Hz show as {}Hz, like loads: "
                  "change mass, springs or frame rate, or damp it",
                  modes, instrument.frame_rate, aliases));
}

void warn_of_cells(const Instrument& instrument, Design& design) {
  for (const SeenTag& tag : instrument.tags) {
    const double cell_px = instrument.picture.fx_px * tag.size / tag.cells /
                           tag.seen(tag.camera_T_tag.translation()).z();
    if (cell_px > kSharedEdges * instrument.picture.blur_px) continue;
    design.warnings.push_back(
        fmt::format("cells of {:.1f} px under a point spread of {:.1f} px: edges run into each "
                    "other, the bound is too good; take larger cells or a sharper lens",
                    cell_px, instrument.picture.blur_px));
    return;
  }
}

constexpr double kTurn = std::numbers::pi / 4;  // the published estimate looks at 45 degrees

/// 0 where there is not one count.
int bits(double counts) {
  return counts < 1 ? 0 : static_cast<int>(std::floor(std::log2(counts))) + 1;
}

constexpr int kPieces = 4;  // of a cell's side: perspective changes along it
constexpr double kFullScale = 255;

using Information = Eigen::MatrixXd;
using Jacobian = Eigen::Matrix<double, 2, 6>;

/// px per m and rad of the displacement about `origin`, of a point of the tag (camera frame, where
/// it is and not where it is seen).
Jacobian image_motion(const SeenPicture& picture, const SeenTag& tag, const Eigen::Vector3d& p,
                      const Eigen::Vector3d& origin) {
  const Eigen::Vector3d at = tag.seen(p);
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << picture.fx_px / at.z(), 0, -picture.fx_px * at.x() / (at.z() * at.z()),  //
      0, picture.fy_px / at.z(), -picture.fy_px * at.y() / (at.z() * at.z());
  if (tag.mirror) by_point *= tag.mirror->reflection();
  Jacobian motion;
  motion << by_point, by_point * cross_matrix(origin - p);  // of r x arm
  return motion;
}

/// One straight piece of a boundary in tag axes, paper to its left seen along `from` -> `to` with y
/// down (x right).
struct Piece {
  Eigen::Vector2d from, to;
};

std::vector<Piece> edges_of(const SeenTag& tag) {
  const double cell = tag.size / tag.cells;
  const auto white = [&](int row, int column) {
    const bool outside = row < 0 || column < 0 || row >= tag.cells || column >= tag.cells;
    return outside || tag.white[row * tag.cells + column] != 0;
  };
  const auto corner = [&](int row, int column) -> Eigen::Vector2d {
    return {column * cell - 0.5 * tag.size, row * cell - 0.5 * tag.size};
  };
  std::vector<Piece> pieces;
  const auto add = [&](bool before, bool after, const Eigen::Vector2d& from,
                       const Eigen::Vector2d& to) {
    for (int i = 0; i < kPieces && before != after; ++i) {
      const Eigen::Vector2d a = from + (to - from) * (static_cast<double>(i) / kPieces);
      const Eigen::Vector2d b = from + (to - from) * (static_cast<double>(i + 1) / kPieces);
      pieces.push_back(before ? Piece{a, b} : Piece{b, a});
    }
  };
  for (int line = 0; line <= tag.cells; ++line) {
    for (int i = 0; i < tag.cells; ++i) {  // an upright one, a level one
      add(white(i, line - 1), white(i, line), corner(i + 1, line), corner(i, line));
      add(white(line - 1, i), white(line, i), corner(line, i), corner(line, i + 1));
    }
  }
  return pieces;
}

/// Pixels that a rectangle of the tag's plane covers.
double area_px(const SeenTag& tag, const SeenPicture& picture, double half) {
  Eigen::Vector2d corners[4];
  for (int i = 0; i < 4; ++i)
    corners[i] = project(picture, tag.seen(tag.camera_T_tag * square_corners(half)[i]));
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
  for (const Piece& piece : edges_of(tag)) {
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

double active_coils(const Spring& spring) {
  return kShear * std::pow(spring.wire, 4) /
         (8 * std::pow(spring.mean_diameter(), 3) * spring.rate);
}

double solid_length(const Spring& spring) {
  const double coils = spring.coils > 0 ? spring.coils : active_coils(spring) + kEndCoils;
  return coils * spring.wire;
}

std::array<double, 6> natural_frequencies(const Matrix6& stiffness, const Platform& platform) {
  const Eigen::Matrix3d cross = cross_matrix(platform.centre_of_mass);
  Matrix6 mass;
  mass << platform.mass * Eigen::Matrix3d::Identity(), -platform.mass * cross,
      platform.mass * cross,
      Eigen::Matrix3d(platform.principal_inertia.asDiagonal()) - platform.mass * cross * cross;
  const Eigen::VectorXd squares = generalized_eigenvalues(stiffness, mass);
  std::array<double, 6> frequencies{};
  for (int i = 0; i < squares.size(); ++i)
    frequencies[i] = std::sqrt(std::max(0.0, squares[i])) / (2 * std::numbers::pi);
  return frequencies;
}

double alias(double frequency, double rate) {
  return std::abs(frequency - rate * std::round(frequency / rate));
}

std::array<Reach, 3> reach(const Instrument& instrument, double most) {
  const Matrix6 compliance = inverse(instrument.stiffness);
  std::array<Reach, 3> result;
  for (int axis = 0; axis < 3; ++axis) {
    result[axis] = {force_in_view(instrument, compliance.col(axis), most),
                    force_to_solid(instrument, compliance.col(axis), most)};
  }
  return result;
}

Design design(const Instrument& instrument, const std::vector<double>& ranges) {
  Design result;
  result.counted = counted_steps(instrument.counted);
  result.bound = displacement_bound(instrument.tags, instrument.origin, instrument.picture)
                     .diagonal()
                     .cwiseSqrt();
  result.modes = natural_frequencies(instrument.stiffness, instrument.platform);
  // The rows of the table scale with it, so it is looked for until it is found.
  result.reach = reach(instrument, kFarForce);
  result.rows.push_back(row(instrument, result, instrument.range, 1));
  double least = kFarForce;
  for (const Reach& axis : result.reach) least = std::min(least, axis.least());
  if (least >= kFarForce) {
    result.warnings.push_back(fmt::format(
        "no force up to {:g} N moves the tags out of view: no table of ranges; check the stiffness",
        kFarForce));
  } else if (least > 0) {
    for (const double range : ranges)
      result.rows.push_back(row(instrument, result, range, range / least));
  }
  warn_of_reach(instrument, result);
  warn_of_springs(instrument, result);
  warn_of_modes(instrument, result);
  warn_of_cells(instrument, result);
  return result;
}

CountedSteps counted_steps(const CountedPixels& d) {
  const double count_px = 1 / d.counts_per_px;
  CountedSteps steps;
  steps.bits_x = bits(d.counts_per_px * d.travel_x_px());
  steps.bits_y = bits(d.counts_per_px * d.travel_y_px());
  steps.bits_z = steps.bits_y;
  steps.step_xy = d.m_per_px() * count_px;
  // The tag's edge seen one count nearer to the middle, by similar triangles.
  steps.step_z = steps.step_xy / (0.5 * d.tag_with_border - steps.step_xy) * d.lens_distance;
  const double radius_px = std::numbers::sqrt2 * 0.5 * d.tag_px;
  steps.chord_px = 2 * radius_px * std::sin(0.5 * kTurn);
  steps.step_rz = kTurn / steps.chord_px * count_px;
  steps.foreshortening_px = 0.5 * d.tag_px * (1 - std::cos(kTurn));
  steps.step_rxy = kTurn / steps.foreshortening_px * count_px;
  return steps;
}

double counted_force(double range, double travel_px, double counts_per_px) {
  return 2 * range / (counts_per_px * travel_px);
}

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

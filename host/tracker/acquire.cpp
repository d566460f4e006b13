#include "host/tracker/acquire.h"

#include <limits>
#include <string>

#include "host/core/algebra/levenberg_marquardt.h"
#include "host/core/config_error.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// While nothing is found, every so many frames the image is tried the other way round.
constexpr unsigned kFlipEvery = 4;

/// Families of so many cells a side are looked for in a sharpened image too.
constexpr int kFineCells = 8;

void check(const TargetDescription& target) {
  const auto refuse = [](const std::string& line) { throw ConfigError("target." + line); };
  const auto text = [](auto number) { return std::to_string(number); };
  const std::size_t count = target.tags.size();
  if (count == 0) refuse("tags: is empty; list at least one tag id");
  if (count > std::size_t{kMaxTags})
    refuse("tags: " + text(count) + " tags; use at most " + text(kMaxTags));
  if (!(target.tag_size > 0)) refuse("tag_size_mm: must be positive");
  if (!(target.border >= 0)) refuse("border_mm: must not be negative");
  const int ids = id_count(target.family);
  for (auto tag = target.tags.begin(); tag != target.tags.end(); ++tag) {
    if (tag->id < 0 || tag->id >= ids) {
      refuse("tags: id " + text(tag->id) + " is not in " + std::string(name(target.family)) +
             "; use 0 to " + text(ids - 1));
    }
    const auto same = [tag](const Tag& other) { return other.id == tag->id; };
    if (std::any_of(target.tags.begin(), tag, same))
      refuse("tags: id " + text(tag->id) + " is listed twice; give each tag its own");
  }
}

Eigen::Vector2d centre(const Square& square) {
  return 0.25 * (square[0] + square[1] + square[2] + square[3]);
}

double perimeter(const Square& square) {
  double sum = 0;
  for (std::size_t c = 0; c < 4; ++c) sum += (square[(c + 1) % 4] - square[c]).norm();
  return sum;
}

/// Where the id is in the detector's list. The thresholded rim of one square has an inside and an
/// outside, and both may be listed: the outside is the square. An id in two places cannot be told
/// apart from its double.
std::optional<std::size_t> only(int id, const SquareList& list, bool& twice) {
  constexpr double kSamePlaceFraction = 0.1;  // of the square's perimeter
  std::optional<std::size_t> best;
  twice = false;
  double longest_px = 0;
  for (std::size_t i = 0; i < list.ids.size(); ++i) {
    if (list.ids[i] != id) continue;
    const double perimeter_px = perimeter(list.tags[i]);
    if (best && (centre(list.tags[i]) - centre(list.tags[*best])).norm() >
                    kSamePlaceFraction * perimeter_px) {
      twice = true;
      return std::nullopt;
    }
    if (perimeter_px <= longest_px) continue;
    longest_px = perimeter_px;
    best = i;
  }
  return best;
}

/// What was found, sorted by what the target has.
Finding sorted(const CameraModel& camera, const TargetDescription& target, SquareList list) {
  Finding finding;
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    bool twice = false;
    const std::optional<std::size_t> seen = only(target.tags[t].id, list, twice);
    if (twice) finding.twice.push_back(target.tags[t].id);
    if (!seen) continue;
    const Square& corners_px = list.tags[*seen];
    auto poses = square_poses(camera, target.tag_size, corners_px);
    if (!poses.empty()) finding.tags.push_back({t, corners_px, std::move(poses)});
  }
  finding.squares = std::move(list.others);
  for (std::size_t i = 0; i < list.ids.size(); ++i) {
    const auto same = [id = list.ids[i]](const Tag& tag) { return tag.id == id; };
    if (std::any_of(target.tags.begin(), target.tags.end(), same)) continue;
    finding.squares.push_back(list.tags[i]);
    auto& others = finding.other_ids;
    if (std::find(others.begin(), others.end(), list.ids[i]) == others.end())
      others.push_back(list.ids[i]);
  }
  return finding;
}

constexpr double kReachRotation = 0.6;  ///< rad
constexpr double kReachDistance = 0.5;  ///< translation, of the distance from the lens at rest
constexpr double kUnfit_px = 8.0;       ///< RMS beyond which corners are not the target's

struct CornerPair {
  Eigen::Vector3d p_platform;
  Eigen::Vector2d pixel;
};

/// Moves `pose` to the least squares near it; their RMS, px, infinite where a point is behind the
/// camera.
double fit_corners(const CameraModel& camera, const std::vector<CornerPair>& pairs,
                   Eigen::Isometry3d& pose) {
  const auto look = [&](const Eigen::Isometry3d& at) {
    FitSums<6> sums;
    for (const CornerPair& pair : pairs) {
      const Eigen::Vector3d arm = at.linear() * pair.p_platform;
      const ProjectedPoint projected = project(camera, arm + at.translation());
      if (!projected.valid) sums.squares = std::numeric_limits<double>::infinity();
      Eigen::Matrix<double, 2, 6> rows;
      rows << projected.jacobian, -projected.jacobian * cross_matrix(arm);
      const Eigen::Vector2d error = pair.pixel - projected.pixel;
      for (int i = 0; i < 2; ++i) sums.add(rows.row(i).transpose(), error[i]);
    }
    return sums;
  };
  const double squares = levenberg_marquardt(pose, look, moved).squares;
  return std::sqrt(squares / (2.0 * static_cast<double>(pairs.size())));
}

}  // namespace

Acquirer::Acquirer(const CameraModel& camera, const TargetDescription& target)
    : camera_(camera), target_((check(target), target)), finder_(target.family) {
  for (const Tag& tag : target.tags)
    patterns_.push_back(tag_pattern(target.family, tag.id, target.tag_size, target.border));
}

/// Blur as wide as a third of a cell hides the bits from the library's thresholds: tags not yet
/// listed are looked for in a sharpened image.
void Acquirer::add_sharpened(const ImageView& image, SquareList& list) {
  const auto listed = [&list](int id) {
    return std::find(list.ids.begin(), list.ids.end(), id) != list.ids.end();
  };
  if (std::all_of(target_.tags.begin(), target_.tags.end(),
                  [&](const Tag& tag) { return listed(tag.id); }))
    return;
  const std::optional<SquareList> more = finder_.find(image, true);
  if (!more) return;
  const std::vector<int> first = list.ids;
  for (std::size_t i = 0; i < more->ids.size(); ++i) {
    if (std::find(first.begin(), first.end(), more->ids[i]) != first.end()) continue;
    list.ids.push_back(more->ids[i]);
    list.tags.push_back(more->tags[i]);
  }
}

Finding Acquirer::detect(const ImageView& image) {
  std::optional<SquareList> list = finder_.find(image, false);
  if (!list) return {.looked = false};
  if (bits_per_side(target_.family) >= kFineCells) add_sharpened(image, *list);
  return sorted(camera_, target_, std::move(*list));
}

Finding Acquirer::find(const ImageView& image) {
  std::optional<FlippedImage> flipped;
  if (camera_.mirrored) flipped.emplace(image);
  Finding finding = detect(flipped ? flipped->view() : image);
  if (!finding.tags.empty()) {
    misses_ = 0;
    return finding;
  }
  if (!finding.looked || misses_++ % kFlipEvery != 0) return finding;
  if (!flipped) flipped.emplace(image);
  finding.other_way_round = !detect(camera_.mirrored ? image : flipped->view()).tags.empty();
  return finding;
}

bool within_reach(const Eigen::Isometry3d& reference, const Eigen::Isometry3d& camera_T_platform) {
  const Vector6 motion = motion_between(reference, camera_T_platform);
  return motion.tail<3>().norm() < kReachRotation &&
         motion.head<3>().norm() < kReachDistance * reference.translation().norm();
}

std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag, const Eigen::Isometry3d& reference) {
  const std::array<Eigen::Vector3d, 4> corners = square_corners(0.5 * tag_size);
  std::vector<CornerPair> pairs;
  std::vector<Eigen::Isometry3d> starts = {reference};
  for (const FoundTag& tag : found) {
    for (std::size_t c = 0; c < 4; ++c)
      pairs.push_back({platform_T_tag[tag.index] * corners[c], tag.corners_px[c]});
    for (const Eigen::Isometry3d& pose : tag.camera_T_tag)
      starts.push_back(pose * platform_T_tag[tag.index].inverse());
  }
  if (pairs.empty()) return std::nullopt;
  std::optional<Eigen::Isometry3d> best;
  double best_px = kUnfit_px;
  for (Eigen::Isometry3d& pose : starts) {
    const double rms_px = fit_corners(camera, pairs, pose);
    if (!(rms_px < best_px) || !within_reach(reference, pose)) continue;
    best = pose;
    best_px = rms_px;
  }
  return best;
}

void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept {
  track.corner_count = 0;
  if (platform_T_tag.size() != target.tags.size() || target.tags.size() > track.corners.size())
    return;
  const std::array<Eigen::Vector3d, 4> corners = square_corners(0.5 * target.tag_size);
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    TagCorners& out = track.corners[t];
    out.id = target.tags[t].id;
    for (std::size_t c = 0; c < 4; ++c) {
      const ProjectedPoint at =
          project(camera, camera_T_platform * (platform_T_tag[t] * corners[c]));
      if (!at.valid) return;
      const double x = at.pixel.x();
      out.px[2 * c] = camera.mirrored ? camera.width_px - 1 - x : x;
      out.px[2 * c + 1] = at.pixel.y();
    }
  }
  track.corner_count = static_cast<std::uint8_t>(target.tags.size());
}

}  // namespace tagwrench

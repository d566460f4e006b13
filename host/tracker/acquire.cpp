#include "host/tracker/acquire.h"

#include <algorithm>
#include <optional>
#include <string>

#include "host/core/config_error.h"
#include "host/tracker/square_pose.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

/// While nothing is found, every so many frames the image is tried the other way round.
constexpr unsigned kFlipEvery = 4;

/// Families of so many cells a side are looked for in a sharpened image too.
constexpr int kFineCells = 8;

void check(const TargetDescription& target) {
  if (target.tags.empty()) throw ConfigError("target.tags: is empty; list at least one tag id");
  if (target.tags.size() > static_cast<std::size_t>(kMaxTags)) {
    throw ConfigError("target.tags: " + std::to_string(target.tags.size()) + " tags; use at most " +
                      std::to_string(kMaxTags));
  }
  if (!(target.tag_size > 0)) throw ConfigError("target.tag_size_mm: must be positive");
  if (!(target.border >= 0)) throw ConfigError("target.border_mm: must not be negative");
  const int ids = id_count(target.family);
  for (auto tag = target.tags.begin(); tag != target.tags.end(); ++tag) {
    if (tag->id < 0 || tag->id >= ids) {
      throw ConfigError("target.tags: id " + std::to_string(tag->id) + " is not in " +
                        std::string(name(target.family)) + "; use 0 to " + std::to_string(ids - 1));
    }
    const auto same = [tag](const Tag& other) { return other.id == tag->id; };
    if (std::any_of(target.tags.begin(), tag, same)) {
      throw ConfigError("target.tags: id " + std::to_string(tag->id) +
                        " is listed twice; give each tag its own");
    }
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
    FoundTag tag;
    tag.index = t;
    tag.corners_px = list.tags[*seen];
    tag.camera_T_tag = square_poses(camera, target.tag_size, tag.corners_px);
    if (!tag.camera_T_tag.empty()) finding.tags.push_back(std::move(tag));
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
                  [&](const Tag& tag) { return listed(tag.id); })) {
    return;
  }
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
  if (!list) {
    Finding nobody;
    nobody.looked = false;
    return nobody;
  }
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

}  // namespace tagwrench

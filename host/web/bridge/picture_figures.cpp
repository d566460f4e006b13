#include "host/web/bridge/picture_figures.h"

#include <algorithm>
#include <cmath>

#include "host/calibration/light/control.h"
#include "host/tracker/edge_width.h"
#include "host/tracker/picture_quality.h"

namespace tagwrench {
namespace {

constexpr Duration kMeasureEvery = std::chrono::milliseconds(450);

SquareCorners square_of(const TagCorners& tag) {
  SquareCorners square;
  for (std::size_t i = 0; i < square.size(); ++i) square[i] = {tag.px[2 * i], tag.px[2 * i + 1]};
  return square;
}

}  // namespace

PictureFigures::PictureFigures(const CameraModel& camera, const TargetDescription& target)
    : patterns_(camera, target), mirrored_(camera.mirrored) {
  for (const Tag& tag : target.tags) edges_.push_back({tag.id, 0});
}

void PictureFigures::look(const ImageView& picture, std::span<const TagCorners> corners) {
  const TimePoint now = std::chrono::steady_clock::now();
  if (now - last_ < kMeasureEvery) return;
  last_ = now;
  measure_edges(picture, corners);
  std::vector<FoundTag> tags;
  for (const TagCorners& tag : corners) {
    FoundTag& found = tags.emplace_back();
    found.corners_px = square_of(tag);
    if (!mirrored_) continue;
    for (Eigen::Vector2d& corner : found.corners_px) corner.x() = picture.width - 1 - corner.x();
  }
  const LightReading light = read_light(picture, mirrored_, tags);
  nlohmann::json widths = nlohmann::json::array();
  for (const Edges& edges : edges_) {
    if (edges.px > 0) widths.push_back({{"id", edges.id}, {"px", edges.px}});
  }
  figures_ = {{"white", light.white_counts},
              {"black", picture_quality(picture).dark_counts},
              {"clipped_part", light.clipped_fraction},
              {"edges_px", std::move(widths)}};
}

/// One tag after the other: a fit takes as long as a frame.
void PictureFigures::measure_edges(const ImageView& picture, std::span<const TagCorners> corners) {
  if (edges_.empty()) return;
  const std::size_t index = next_++ % edges_.size();
  Edges& edges = edges_[index];
  edges.px = 0;
  for (const TagCorners& tag : corners) {
    if (tag.id != edges.id) continue;
    if (const auto width = edge_width(picture, patterns_.patterns()[index], square_of(tag)))
      edges.px = width->blur_px;
  }
}

}  // namespace tagwrench

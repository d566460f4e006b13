#include "host/calibration/camera/collect.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/count_text.h"

namespace tagwrench {
namespace {

constexpr double kAlike = 0.015;  // of the image's width: mean motion of the corners
constexpr double kStill = 0.001;  // of the image's width, between two frames
constexpr int kStillFrames = 2;   // in a row
constexpr std::size_t kMaxUndetected = 5;
constexpr std::size_t kMaxViews = 500;  // held; memory must end
constexpr std::size_t kMinShared = 6;

Fate fate_of(BoardView look) {
  switch (look) {
    case BoardView::board: return Fate::view;
    case BoardView::no_board: return Fate::no_board;
    case BoardView::other_board: return Fate::other_board;
    case BoardView::part: return Fate::part;
    case BoardView::dark: return Fate::dark;
    case BoardView::saturated: return Fate::saturated;
    case BoardView::blurred: return Fate::blurred;
  }
  return Fate::no_board;
}

}  // namespace

double difference_px(const std::vector<BoardCorner>& a, const std::vector<BoardCorner>& b) {
  double sum = 0;
  std::size_t shared = 0;
  for (const BoardCorner& p : a) {
    for (const BoardCorner& q : b) {
      if ((p.board - q.board).squaredNorm() > 0.01) continue;
      sum += (p.pixel - q.pixel).norm();
      ++shared;
    }
  }
  if (shared < std::min({kMinShared, a.size(), b.size()}) || shared == 0)
    return std::numeric_limits<double>::max();
  return sum / static_cast<double>(shared);
}

ViewCollector::ViewCollector(const BoardSpec& board, const CameraModel& camera, bool live)
    : board_(board), camera_(camera), live_(live), finder_(board, camera.mirrored) {}

void ViewCollector::keep(const ImageView& image) {
  if (undetected_.size() >= kMaxUndetected) return;
  std::vector<std::uint8_t>& copy = undetected_.emplace_back();
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride;
    copy.insert(copy.end(), row, row + image.width);
  }
}

ViewResult ViewCollector::look(const ImageView& image, const std::string& name) {
  const bool mirrored_before = finder_.mirrored();
  BoardSighting sighting = finder_.find(image);
  if (finder_.mirrored() != mirrored_before) previous_.clear();
  last_look_ = sighting.look;
  const auto lost = [&](Fate fate, std::string detail) {
    pictures_.add({live_ ? std::string() : name, fate, std::move(detail)});
  };
  if (sighting.look == BoardView::no_board || sighting.look == BoardView::other_board) keep(image);
  if (sighting.look != BoardView::board) {
    lost(fate_of(sighting.look), {});
    return ViewResult::no;
  }
  if (live_) {
    const bool still = difference_px(previous_, sighting.corners) < kStill * camera_.width_px;
    still_frames_ = still ? still_frames_ + 1 : 0;
    previous_ = sighting.corners;
    if (still_frames_ < kStillFrames) {
      lost(Fate::moving, {});
      return ViewResult::moving;
    }
  }
  for (const CameraView& view : views_) {
    if (difference_px(view.corners, sighting.corners) >= kAlike * camera_.width_px) continue;
    lost(Fate::alike, "as " + view.name);
    return ViewResult::alike;
  }
  if (views_.size() >= kMaxViews) {
    lost(Fate::spare, {});
    return ViewResult::yes;
  }
  pictures_.add({name, Fate::view, {}});
  views_.push_back({name, std::move(sighting.corners), sighting.corner_view});
  return ViewResult::yes;
}

Coverage ViewCollector::coverage() const {
  const std::vector<BoardPose> poses =
      rough_poses(views_, camera_.width_px, camera_.height_px, camera_.fx_px);
  Coverage coverage(camera_.width_px, camera_.height_px);
  for (std::size_t i = 0; i < views_.size(); ++i) coverage.add(views_[i].corners, poses[i]);
  return coverage;
}

void ViewCollector::thin_out(int most) {
  const auto count = static_cast<std::size_t>(std::max(1, most));
  if (views_.size() <= count) return;
  // Farthest point first: the next view is the one least like any that is in.
  std::vector<double> to_chosen(views_.size(), std::numeric_limits<double>::max());
  std::vector<bool> chosen(views_.size(), false);
  std::size_t next = 0;
  for (std::size_t n = 0; n < count; ++n) {
    chosen[next] = true;
    for (std::size_t i = 0; i < views_.size(); ++i)
      to_chosen[i] = std::min(to_chosen[i], difference_px(views_[i].corners, views_[next].corners));
    next = 0;
    for (std::size_t i = 0; i < views_.size(); ++i)
      if (!chosen[i] && (chosen[next] || to_chosen[i] > to_chosen[next])) next = i;
  }
  std::vector<CameraView> left;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    if (chosen[i])
      left.push_back(std::move(views_[i]));
    else
      pictures_.became(views_[i].name, Fate::spare, {});
  }
  views_ = std::move(left);
}

void ViewCollector::check() const {
  const std::string asked = describe(board_);
  const int views = pictures_.count(Fate::view), alike = pictures_.count(Fate::alike);
  const int all = pictures_.all();
  // Part of a checkerboard may pass for a smaller one here and there.
  if (views < kMinCameraViews) {
    std::vector<ImageView> images;
    for (const auto& pixels : undetected_)
      images.push_back({pixels.data(), camera_.width_px, camera_.height_px, camera_.width_px});
    if (const std::string guess = guess_board(images, board_); !guess.empty()) {
      throw ConfigError(
          "--board {}: found in {} of {} images; the board in the others looks like {}: correct "
          "--board, or show all of it",
          asked, views + alike, all, guess);
    }
  }
  const std::string loss = pictures_.main_loss();
  if (views == 0) {
    throw ConfigError("--board {}: no usable view of it; {}", asked,
                      all == 0 ? "no image came: give --source or --images that has some" : loss);
  }
  if (views < 3 && alike > 0) {
    throw ConfigError(
        "all {} images with the board show it in the same pose: move it about and tilt it between "
        "views",
        views + alike);
  }
  if (views < kMinCameraViews) {
    throw ConfigError("only {} different usable views, {} are needed and 20 are good; {}", views,
                      kMinCameraViews,
                      loss.empty() ? "show the board at more places, distances and tilts" : loss);
  }
}

}  // namespace tagwrench

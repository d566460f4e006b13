#include "host/tracker/acquire.h"

#include <algorithm>
#include <exception>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "host/config_error.h"
#include "host/tracker/tag_dictionary.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

/// While nothing is found, every so many frames the image is tried the other way round.
constexpr unsigned kFlipEvery = 4;

/// Families of so many cells a side are looked for in a sharpened image too.
constexpr int kFineCells = 8;
constexpr double kUnsharpSigma_px = 1.5;
constexpr double kUnsharpAmount = 2.0;

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

cv::Point2f centre(const std::vector<cv::Point2f>& square) {
  return 0.25F * (square[0] + square[1] + square[2] + square[3]);
}

/// Where the id is in the detector's list. The thresholded rim of one square has an inside and an
/// outside, and both may be listed: the outside is the square. An id in two places cannot be told
/// apart from its double.
std::optional<std::size_t> only(int id, const std::vector<int>& ids,
                                const std::vector<std::vector<cv::Point2f>>& corners, bool& twice) {
  constexpr double kSamePlacePart = 0.1;  // of the square's perimeter
  std::optional<std::size_t> best;
  twice = false;
  double longest_px = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] != id) continue;
    const double perimeter_px = cv::arcLength(corners[i], true);
    if (best &&
        cv::norm(centre(corners[i]) - centre(corners[*best])) > kSamePlacePart * perimeter_px) {
      twice = true;
      return std::nullopt;
    }
    if (perimeter_px <= longest_px) continue;
    longest_px = perimeter_px;
    best = i;
  }
  return best;
}

}  // namespace

struct Acquirer::Detector {
  cv::Ptr<cv::aruco::Dictionary> dictionary;
  cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
  cv::Matx33d matrix;
  cv::Mat distortion;
  std::vector<cv::Point3d>
      square;  // in the order and with the axes (y up, z out of the paper) of IPPE_SQUARE

  Detector(const CameraModel& camera, const TargetDescription& target)
      : dictionary(tag_dictionary(target.family)),
        matrix(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1),
        distortion(1, 5, CV_64F) {
    cv::setNumThreads(1);
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    // The paper's outline lies close around the black square; the default would keep the outline
    // and drop the square.
    parameters->minMarkerDistanceRate = 0.008;
    std::copy(camera.distortion.begin(), camera.distortion.end(), distortion.ptr<double>());
    const double h = 0.5 * target.tag_size;
    square = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  }

  std::vector<Eigen::Isometry3d> poses(const std::vector<cv::Point2f>& corners) const {
    std::vector<cv::Mat> rotations;
    std::vector<cv::Mat> translations;
    cv::solvePnPGeneric(square, corners, matrix, distortion, rotations, translations, false,
                        cv::SOLVEPNP_IPPE_SQUARE);
    std::vector<Eigen::Isometry3d> out;
    for (std::size_t i = 0; i < rotations.size(); ++i) {
      cv::Matx33d r;
      cv::Rodrigues(rotations[i], r);
      const cv::Mat& t = translations[i];
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      // Half a turn about x leads from IPPE's tag axes to ours.
      pose.linear() << r(0, 0), -r(0, 1), -r(0, 2), r(1, 0), -r(1, 1), -r(1, 2), r(2, 0), -r(2, 1),
          -r(2, 2);
      pose.translation() << t.at<double>(0), t.at<double>(1), t.at<double>(2);
      const bool faces_us = pose.linear().col(2).dot(pose.translation()) > 0;
      if (pose.matrix().allFinite() && pose.translation().z() > 0 && faces_us) out.push_back(pose);
    }
    return out;
  }

  /// Blur as wide as a third of a cell hides the bits from OpenCV's thresholds: tags not yet listed
  /// are looked for in a sharpened image (unsharp mask).
  void add_sharpened(const cv::Mat& image, const TargetDescription& target,
                     std::vector<std::vector<cv::Point2f>>& corners, std::vector<int>& ids) const {
    const auto listed = [&ids](int id) {
      return std::find(ids.begin(), ids.end(), id) != ids.end();
    };
    if (std::all_of(target.tags.begin(), target.tags.end(),
                    [&](const Tag& tag) { return listed(tag.id); })) {
      return;
    }
    cv::Mat sharp;
    cv::GaussianBlur(image, sharp, {}, kUnsharpSigma_px);
    cv::addWeighted(image, 1 + kUnsharpAmount, sharp, -kUnsharpAmount, 0, sharp);
    std::vector<std::vector<cv::Point2f>> more_corners;
    std::vector<int> more_ids;
    cv::aruco::detectMarkers(sharp, dictionary, more_corners, more_ids, parameters);
    const std::vector<int> first = ids;
    for (std::size_t i = 0; i < more_ids.size(); ++i) {
      if (std::find(first.begin(), first.end(), more_ids[i]) != first.end()) continue;
      ids.push_back(more_ids[i]);
      corners.push_back(more_corners[i]);
    }
  }

  Finding detect(const cv::Mat& image, const TargetDescription& target) const {
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<std::vector<cv::Point2f>> rejected;
    std::vector<int> ids;
    cv::aruco::detectMarkers(image, dictionary, corners, ids, parameters, rejected);
    if (dictionary->markerSize >= kFineCells) add_sharpened(image, target, corners, ids);
    Finding finding;
    for (std::size_t t = 0; t < target.tags.size(); ++t) {
      bool twice = false;
      const std::optional<std::size_t> seen = only(target.tags[t].id, ids, corners, twice);
      if (twice) finding.twice.push_back(target.tags[t].id);
      if (!seen) continue;
      const std::size_t at = *seen;
      FoundTag tag;
      tag.index = t;
      for (std::size_t c = 0; c < 4; ++c) tag.corners_px[c] = {corners[at][c].x, corners[at][c].y};
      tag.camera_T_tag = poses(corners[at]);
      if (!tag.camera_T_tag.empty()) finding.tags.push_back(std::move(tag));
    }
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const auto same = [id = ids[i]](const Tag& tag) { return tag.id == id; };
      if (std::any_of(target.tags.begin(), target.tags.end(), same)) continue;
      rejected.push_back(corners[i]);
      const auto& others = finding.other_ids;
      if (std::find(others.begin(), others.end(), ids[i]) == others.end())
        finding.other_ids.push_back(ids[i]);
    }
    for (const std::vector<cv::Point2f>& shape : rejected) {
      auto& out = finding.squares.emplace_back();
      for (std::size_t c = 0; c < 4; ++c) out[c] = {shape[c].x, shape[c].y};
    }
    return finding;
  }
};

Acquirer::Acquirer(const CameraModel& camera, const TargetDescription& target)
    : camera_(camera), target_(target) {
  check(target);
  detector_ = std::make_unique<Detector>(camera, target);
  for (const Tag& tag : target.tags)
    patterns_.push_back(tag_pattern(target.family, tag.id, target.tag_size, target.border));
}

Acquirer::~Acquirer() = default;

Finding Acquirer::search(const ImageView& image) {
  // OpenCV wants a mutable pointer but does not write to its input.
  const cv::Mat as_delivered(image.height, image.width, CV_8UC1,
                             const_cast<std::uint8_t*>(image.pixels),
                             static_cast<std::size_t>(image.stride));
  cv::Mat flipped;
  if (camera_.mirrored) cv::flip(as_delivered, flipped, 1);
  Finding finding = detector_->detect(camera_.mirrored ? flipped : as_delivered, target_);
  if (!finding.tags.empty()) {
    misses_ = 0;
    return finding;
  }
  if (misses_++ % kFlipEvery != 0) return finding;
  if (!camera_.mirrored) cv::flip(as_delivered, flipped, 1);
  finding.other_way_round =
      !detector_->detect(camera_.mirrored ? as_delivered : flipped, target_).tags.empty();
  return finding;
}

Finding Acquirer::find(const ImageView& image) noexcept {
  try {
    return search(image);
  } catch (const std::exception&) {
    // OpenCV throws for images that it finds too small or degenerate: nothing to be found there.
    return {};
  }
}

}  // namespace tagwrench

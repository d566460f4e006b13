#include "tests/bench/tracker_methods.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>

#include "host/tracker/tracker.h"
#include "tests/bench/tracker_tag_poses.h"

namespace tagwrench::bench {
namespace {

cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary_of(TagFamily family) {
  switch (family) {
    case TagFamily::aruco_original: return cv::aruco::DICT_ARUCO_ORIGINAL;
    case TagFamily::apriltag_36h11: return cv::aruco::DICT_APRILTAG_36h11;
    default: throw std::invalid_argument("tracker benchmark: no OpenCV dictionary for this family");
  }
}

class OpenCvDetector {
 public:
  OpenCvDetector(const SensorConfig& sensor, Corners corners)
      : sensor_(sensor),
        dictionary_(cv::aruco::getPredefinedDictionary(dictionary_of(sensor.target.family))),
        parameters_(cv::aruco::DetectorParameters::create()) {
    parameters_->cornerRefinementMethod =
        corners == Corners::subpixel   ? cv::aruco::CORNER_REFINE_SUBPIX
        : corners == Corners::apriltag ? cv::aruco::CORNER_REFINE_APRILTAG
                                       : cv::aruco::CORNER_REFINE_NONE;
  }

  /// Corners of the sensor's tags in its order; empty for a tag that was not found.
  std::vector<TagCorners> find(const Shot& shot) {
    const cv::Mat grey(shot.height, shot.width, CV_8UC1,
                       const_cast<std::uint8_t*>(shot.pixels.data()));
    cv::aruco::detectMarkers(grey, dictionary_, corners_, ids_, parameters_);
    std::vector<TagCorners> found(sensor_.target.tags.size());
    for (std::size_t t = 0; t < found.size(); ++t) {
      const auto at = std::find(ids_.begin(), ids_.end(), sensor_.target.tags[t].id);
      if (at == ids_.end()) continue;
      for (const cv::Point2f& c : corners_[static_cast<std::size_t>(at - ids_.begin())])
        found[t].emplace_back(c.x, c.y);
    }
    return found;
  }

 private:
  SensorConfig sensor_;
  cv::Ptr<cv::aruco::Dictionary> dictionary_;
  cv::Ptr<cv::aruco::DetectorParameters> parameters_;
  std::vector<std::vector<cv::Point2f>> corners_;
  std::vector<int> ids_;
};

class OneTag final : public Method {
 public:
  OneTag(std::string name, const SensorConfig& sensor, Corners corners)
      : Method(std::move(name)), lens_(sensor), detector_(sensor, corners), rest_(lens_) {}

  Reading track(const Shot& shot) override {
    const std::vector<TagCorners> found = detector_.find(shot);
    if (shot.phase == Phase::rest) {
      rest_.add(found);
      return {};
    }
    Reading reading;
    if (found.front().empty() || !rest_.learned(0)) return reading;
    reading.ok = true;
    reading.displacement =
        rest_.displacement(ippe_pose(lens_, found.front()) * rest_.camera_T_tag(0).inverse());
    return reading;
  }

 private:
  Lens lens_;
  OpenCvDetector detector_;
  RestCorners rest_;
};

/// R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) {
  return {std::atan2(R(2, 1), R(2, 2)), -std::asin(std::clamp(R(2, 0), -1.0, 1.0)),
          std::atan2(R(1, 0), R(0, 0))};
}

class MeanOfTags final : public Method {
 public:
  MeanOfTags(std::string name, const SensorConfig& sensor, Corners corners)
      : Method(std::move(name)), lens_(sensor), detector_(sensor, corners), rest_(lens_) {}

  Reading track(const Shot& shot) override {
    const std::vector<TagCorners> found = detector_.find(shot);
    if (shot.phase == Phase::rest) {
      rest_.add(found);
      return {};
    }
    Reading reading;
    Vector6 sum = Vector6::Zero();
    for (std::size_t t = 0; t < found.size(); ++t) {
      if (found[t].empty() || !rest_.learned(t)) return reading;
      sum += numbers(ippe_pose(lens_, found[t])) - numbers(rest_.camera_T_tag(t));
    }
    reading.ok = true;
    reading.displacement = sum / static_cast<double>(found.size());
    return reading;
  }

 private:
  static Vector6 numbers(const Eigen::Isometry3d& pose) {
    Vector6 result;
    result << pose.translation(), roll_pitch_yaw(pose.linear());
    return result;
  }

  Lens lens_;
  OpenCvDetector detector_;
  RestCorners rest_;
};

class AllTags final : public Method {
 public:
  AllTags(std::string name, const SensorConfig& sensor, Corners corners)
      : Method(std::move(name)), lens_(sensor), detector_(sensor, corners), rest_(lens_) {}

  Reading track(const Shot& shot) override {
    const std::vector<TagCorners> found = detector_.find(shot);
    if (shot.phase == Phase::rest) {
      rest_.add(found);
      return {};
    }
    if (body_.empty()) start();
    Reading reading;
    image_points_.clear();
    for (const TagCorners& corners : found) {
      if (corners.empty()) return reading;
      image_points_.insert(image_points_.end(), corners.begin(), corners.end());
    }
    if (body_.size() != image_points_.size()) return reading;
    reading.ok = cv::solvePnP(body_, image_points_, lens_.matrix, lens_.distortion, rotation_,
                              translation_, /*useExtrinsicGuess=*/true, cv::SOLVEPNP_ITERATIVE);
    reading.displacement = rest_.displacement(isometry(rotation_, translation_) *
                                              Eigen::Translation3d(-rest_.origin()));
    return reading;
  }

 private:
  /// Platform coordinates: the camera's axes at rest, about the midpoint of the tags' centres.
  void start() {
    for (std::size_t t = 0; t < rest_.tags(); ++t) {
      if (!rest_.learned(t)) return;
      for (const Eigen::Vector3d& corner : square_corners(lens_.tag_size)) {
        const Eigen::Vector3d p = rest_.camera_T_tag(t) * corner - rest_.origin();
        body_.emplace_back(p.x(), p.y(), p.z());
      }
    }
    rotation_ = {0, 0, 0};
    translation_ = {rest_.origin().x(), rest_.origin().y(), rest_.origin().z()};
  }

  Lens lens_;
  OpenCvDetector detector_;
  RestCorners rest_;
  std::vector<cv::Point3d> body_;
  std::vector<cv::Point2d> image_points_;
  cv::Vec3d rotation_, translation_;
};

class Tagwrench final : public Method {
 public:
  Tagwrench(std::string name, const SensorConfig& sensor)
      : Method(std::move(name)), tracker_(sensor.camera, sensor.target, sensor.rest) {}

  Reading track(const Shot& shot) override {
    Frame frame;
    frame.image = shot.image();
    frame.sequence = shot.sequence;
    frame.capture_time = frame.latency_origin = shot.time;
    const Track track = tracker_.track(frame);
    return {track.status == Status::ok, track.displacement, track.covariance};
  }

 private:
  Tracker tracker_;
};

}  // namespace

std::unique_ptr<Method> opencv_one_tag(std::string name, const SensorConfig& sensor,
                                       Corners corners) {
  return std::make_unique<OneTag>(std::move(name), sensor, corners);
}

std::unique_ptr<Method> opencv_mean_of_tags(std::string name, const SensorConfig& sensor,
                                            Corners corners) {
  return std::make_unique<MeanOfTags>(std::move(name), sensor, corners);
}

std::unique_ptr<Method> opencv_all_tags(std::string name, const SensorConfig& sensor,
                                        Corners corners) {
  return std::make_unique<AllTags>(std::move(name), sensor, corners);
}

std::unique_ptr<Method> tagwrench_tracker(std::string name, const SensorConfig& sensor) {
  return std::make_unique<Tagwrench>(std::move(name), sensor);
}

}  // namespace tagwrench::bench

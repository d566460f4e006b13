#include <apriltag/apriltag.h>
#include <apriltag/apriltag_pose.h>
#include <apriltag/tag36h11.h>

#include <cstdlib>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "tests/bench/tracker_methods.h"
#include "tests/bench/tracker_tag_poses.h"

namespace tagwrench::bench {
namespace {

class LibAprilTag final : public Method {
 public:
  LibAprilTag(std::string name, const SensorConfig& sensor)
      : Method(std::move(name)),
        sensor_(sensor),
        lens_(sensor),
        family_(tag36h11_create(), tag36h11_destroy),
        detector_(apriltag_detector_create(), apriltag_detector_destroy) {
    if (sensor.target.family != TagFamily::apriltag_36h11)
      throw std::invalid_argument("tracker benchmark: libapriltag is set up for apriltag_36h11");
    detector_->nthreads = 1;
    detector_->quad_decimate = 1;
    apriltag_detector_add_family(detector_.get(), family_.get());
  }

  Reading track(const Shot& shot) override {
    const std::vector<std::optional<Eigen::Isometry3d>> poses = detect(shot);
    if (shot.phase == Phase::rest) {
      rest_.push_back(poses);
      return {};
    }
    if (references_.empty()) learn();
    Reading reading;
    reading.ok = true;
    for (std::size_t t = 0; t < poses.size(); ++t) {
      if (!poses[t] || !references_[t]) return {};
      const Eigen::Isometry3d motion = *poses[t] * references_[t]->inverse();
      const Eigen::AngleAxisd turn(motion.linear());
      Vector6 d;
      d << motion * origin_ - origin_, turn.angle() * turn.axis();
      reading.displacement += d / static_cast<double>(poses.size());
    }
    return reading;
  }

 private:
  using Poses = std::vector<std::optional<Eigen::Isometry3d>>;

  Poses detect(const Shot& shot) {
    image_u8_t image{shot.width, shot.height, shot.width,
                     const_cast<std::uint8_t*>(shot.pixels.data())};
    Poses poses(sensor_.target.tags.size());
    zarray_t* found = apriltag_detector_detect(detector_.get(), &image);
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(found, i, &detection);
      for (std::size_t t = 0; t < poses.size(); ++t) {
        if (sensor_.target.tags[t].id == detection->id) poses[t] = pose_of(*detection);
      }
    }
    apriltag_detections_destroy(found);
    return poses;
  }

  Eigen::Isometry3d pose_of(apriltag_detection_t& detection) const {
    // Its pixels have their corners at integers, and its pose knows no distortion.
    std::vector<cv::Point2d> corners, undistorted;
    for (const auto& p : detection.p) corners.emplace_back(p[0] - 0.5, p[1] - 0.5);
    cv::undistortPoints(corners, undistorted, lens_.matrix, lens_.distortion, cv::noArray(),
                        lens_.matrix);
    for (std::size_t c = 0; c < 4; ++c) {
      detection.p[c][0] = undistorted[c].x;
      detection.p[c][1] = undistorted[c].y;
    }
    apriltag_detection_info_t info{&detection,         lens_.tag_size,     lens_.matrix(0, 0),
                                   lens_.matrix(1, 1), lens_.matrix(0, 2), lens_.matrix(1, 2)};
    apriltag_pose_t pose{};
    estimate_tag_pose(&info, &pose);
    Eigen::Isometry3d camera_T_tag = Eigen::Isometry3d::Identity();
    for (unsigned row = 0; row < 3; ++row) {
      for (unsigned column = 0; column < 3; ++column)
        camera_T_tag.linear()(row, column) = pose.R->data[3 * row + column];
      camera_T_tag.translation()[row] = pose.t->data[row];
    }
    // Debian's library does not export matd_destroy(), which is this.
    std::free(pose.R);
    std::free(pose.t);
    return camera_T_tag;
  }

  /// Mean poses at rest; rotations are near enough to be averaged as matrices.
  void learn() {
    references_.resize(sensor_.target.tags.size());
    origin_.setZero();
    for (std::size_t t = 0; t < references_.size(); ++t) {
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
      Eigen::Vector3d position = Eigen::Vector3d::Zero();
      int count = 0;
      for (const Poses& poses : rest_) {
        if (!poses[t]) continue;
        rotation += poses[t]->linear();
        position += poses[t]->translation();
        ++count;
      }
      if (count == 0) continue;
      const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation,
                                                  Eigen::ComputeFullU | Eigen::ComputeFullV);
      references_[t] = Eigen::Isometry3d::Identity();
      references_[t]->linear() = svd.matrixU() * svd.matrixV().transpose();
      references_[t]->translation() = position / count;
      origin_ += references_[t]->translation() / static_cast<double>(references_.size());
    }
  }

  SensorConfig sensor_;
  Lens lens_;
  std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family_;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector_;
  std::vector<Poses> rest_;
  Poses references_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

}  // namespace

std::unique_ptr<Method> libapriltag(std::string name, const SensorConfig& sensor) {
  return std::make_unique<LibAprilTag>(std::move(name), sensor);
}

}  // namespace tagwrench::bench

// What a calibration recorded, step by step: enough to fit anew, to show, and to go on from; and
// whether the platform stands still, and where.
#pragma once

#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// What the tracker saw at a time.
struct TrackedFrame {
  double time = 0;                         ///< s
  Vector6 displacement = Vector6::Zero();  ///< m, rad
  Matrix6 covariance = Matrix6::Zero();    ///< of it, of this frame alone
};

struct HoldOptions {
  double seconds = 1.0;   ///< that are looked at
  double steady = 0.004;  ///< standard deviation and change within, share of the range
  Matrix6 stiffness = Matrix6::Identity();  ///< of the spring model: puts all axes in newtons
  Vector6 range = Vector6::Ones();          ///< full load per axis, N and N m
};

struct Hold {
  bool full = false;  ///< as many seconds as are needed have been seen without a gap
  bool steady = false;
  double unrest = 0;        ///< worst axis over what counts as steady: 1 is just steady
  int worst = 0;            ///< that axis
  double from = 0, to = 0;  ///< s
  int frames = 0;
  Vector6 mean = Vector6::Zero();        ///< m, rad
  Matrix6 covariance = Matrix6::Zero();  ///< of the mean: what the frames scatter, a slow part of
                                         ///< the tracker's own noise included
};

/// The last second of frames. Steady is what neither scatters nor creeps by more than the given
/// share of the range, or four times the tracker's noise where that is more.
class HoldDetector {
 public:
  explicit HoldDetector(const HoldOptions& options);

  /// Times grow; a gap of more than half of what is looked at starts anew.
  void add(const TrackedFrame& frame);
  void clear() { frames_.clear(); }
  Hold look() const;
  const std::vector<TrackedFrame>& frames() const { return frames_; }

  /// A displacement as load, share of the range.
  Vector6 scaled(const Vector6& displacement) const { return to_load_ * displacement; }

 private:
  HoldOptions options_;
  Matrix6 to_load_;
  std::vector<TrackedFrame> frames_;
};

/// What the reference said at a time of its own.
struct ReferenceSample {
  double time = 0;                  ///< s, on the frames' clock
  Vector6 value = Vector6::Zero();  ///< N and N m, as read; of a load cell the first alone, N
  Vector6 sigma = Vector6::Zero();  ///< one standard deviation
  bool saturated = false;
};

struct StepRecord {
  int step = 0;  ///< of the plan
  int zero = 0;  ///< records with one number count from one rest
  std::vector<TrackedFrame> frames;
  std::vector<ReferenceSample> readings;
};

/// Mean of a record's frames, by the hold detector's rules.
struct RecordMean {
  double time = 0;  ///< s
  Vector6 displacement = Vector6::Zero();
  Matrix6 covariance = Matrix6::Zero();
};
RecordMean mean_of(const StepRecord& record);

/// Of its frames, and of its readings, s.
Eigen::VectorXd frame_times(const StepRecord& record);
Eigen::VectorXd reading_times(const StepRecord& record);

/// Mean of what the reference said, axis by axis; zero if it said nothing.
Vector6 mean_reading(const StepRecord& record);

}  // namespace tagwrench

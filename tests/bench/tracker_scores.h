// From readings and truth to figures.
#pragma once

#include <vector>

#include "tests/bench/tracker_methods.h"

namespace tagwrench::bench {

/// One frame as one method saw it.
struct Record {
  Phase phase = Phase::rest;
  int pose = 0;
  Vector6 truth = Vector6::Zero();
  Reading reading;
  double us = 0;  ///< processor time of the thread
  TimePoint time{};
};

struct MotionScore {
  int frames = 0;
  int lost = 0;                         ///< not ok
  int wrong = 0;                        ///< ok, and farther off than is_wrong() allows
  Vector6 raw = Vector6::Zero();        ///< RMS error over all ok frames, m, rad
  Vector6 after_fit = Vector6::Zero();  ///< RMS error on the second half, m, rad
  double nees = 0;  ///< mean of error' covariance^-1 error, 6 when the covariance is true; 0: none
  double median_us = 0, p99_us = 0;
};

/// An ok that nobody should have been given: off by more than 50 um across, 150 um in depth or 10
/// mrad.
bool is_wrong(const Vector6& error);

/// Over the frames of phase `moving`. After fit: an affine map (6 x 6 and offset) from readings to
/// truth by least squares on the first half, and the error it leaves on the second. Times are those
/// of frames that followed an ok one and are ok, so that acquisition is not among them.
MotionScore score_motion(const std::vector<Record>& records);

/// Standard deviation of the readings at each fixed pose, RMS over the poses, m, rad; NaN if fewer
/// than half of the frames are ok.
Vector6 std_at_fixed_poses(const std::vector<Record>& records);

/// Processor time of the first frame, in which the target is found, us.
double first_frame_us(const std::vector<Record>& records);

}  // namespace tagwrench::bench

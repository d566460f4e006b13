// What a calibration recorded, step by step: enough to fit anew, to show, and to go on from;
// whether the platform stands still, and where; the instrument that tells the load, and whether it
// can be believed; and what the fit is given of all that (observations.cpp).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/calibration/analysis/lag.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/calibration/wrench/plan.h"
#include "host/core/types.h"
#include "host/wrench/fit.h"

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

/// Of frames or of readings, s.
template <class Item>
Eigen::VectorXd times_of(const std::vector<Item>& items) {
  Eigen::VectorXd times(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) times[i] = items[i].time;
  return times;
}

/// Mean of what the reference said, axis by axis; zero if it said nothing.
Vector6 mean_reading(const StepRecord& record);

// The instrument that tells the load during a calibration: a load cell, a six-axis sensor, or the
// simulated ones.

struct ReferenceReading {
  TimePoint time{};
  Duration time_sigma{};
  std::array<double, 6> value{};  ///< N of one axis; or N and N m of six, the reference's own axes
  std::array<double, 6> sigma{};  ///< one standard deviation of the noise, steps included
  std::uint8_t axes = 0;          ///< 1 or 6
  bool saturated = false;
};

class Reference {
 public:
  virtual ~Reference() = default;

  /// Readable when service() has something to do; -1: call it with every frame.
  virtual int poll_fd() const noexcept = 0;
  virtual void service() noexcept = 0;
  /// Takes the next reading; false if there is none yet.
  virtual bool next(ReferenceReading& reading) noexcept = 0;
  /// Relative standard deviation of its calibration, common to all readings.
  virtual double gain_sigma() const noexcept { return 0; }
  /// One line for people: what it is.
  virtual std::string description() const = 0;
  /// One line about what has gone wrong since the last call (silent, unplugged); empty if nothing.
  virtual std::string trouble() = 0;
};

// Whether what a reference said while the platform was pushed or moved can be used.

struct ReferenceFinding {
  enum class Verdict : std::uint8_t {
    fine,
    again,     ///< this step cannot be used; another try may be better
    hopeless,  ///< every step will be like this until something is put right
  };
  Verdict verdict = Verdict::fine;
  std::string text;  ///< what is wrong and what to do, one line
};

/// `rest`: the record of the rest before. `stiffness`: of the spring model; `range`: full load.
ReferenceFinding check_reference(const WrenchPlan& plan, const StepRecord& record,
                                 const StepRecord& rest, const Matrix6& stiffness,
                                 const Vector6& range);

/// Readings of a record as wrenches on the platform, counted from the rest before: m x 6. A push
/// takes hold of its point where that is at rest.
Eigen::MatrixXd reference_wrenches(const WrenchPlan& plan, const StepRecord& record,
                                   const StepRecord& rest);

// What was recorded -> observations for the fit, and the same as a trial for analysis and
// certificate.

struct WrenchData {
  std::vector<Observation> observations;
  std::vector<PathPoint> path;  ///< of the platform, where it was looked at
  study::Trial trial;
  study::Lag lag;  ///< of the camera behind the reference; not known of masses, which have none
  int zero_in_use = 0;  ///< of the first mounting, in which the sensor is used
};

/// Rests and masses give one observation each, the mean over the hold; pushes one a second, frames
/// and what the reference said `lag` before them averaged alike; movements one for each frame (of
/// long ones, for as many as are useful).
/// What displacement and reference drift between two rests is taken out, linearly in time.
/// `cell_gain_sigma`: relative, of the load cell's calibration. Throws ConfigError if nothing was
/// recorded but rests, or a reference and the platform have nothing to do with each other at any
/// lag.
WrenchData collect(const WrenchPlan& plan, const std::vector<StepRecord>& records,
                   double cell_gain_sigma);

/// Fills `predicted` of the data's trial: what the fit, without the step in question, says of each
/// reading. The readings of a hold share its prediction and differ by their own displacement; of a
/// push or a movement those frames have one that were observations or in the middle of one.
void add_predictions(const WrenchPlan& plan, const WrenchFit& fit, WrenchData& data);

}  // namespace tagwrench

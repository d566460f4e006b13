// The sensor standing still for some seconds, for `check` and `zero`: what all its tags say
// together and each alone, and in words what was found.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/calibration/check/in_situ.h"
#include "host/commands/measuring.h"
#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/sensor/sensor_config.h"
#include "host/source/frame_source.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {

/// Whether `calibrate target` has written rest pose, tags' places and the picture at rest.
bool rest_is_calibrated(const SensorConfig& sensor);

/// Throws ConfigError, naming `verb`, unless rest pose, tags' places and the picture at rest are
/// known: without them there is nothing to compare with.
void check_calibrated_rest(const SensorConfig& sensor, const std::string& verb);

/// Feed it frames until it has seen the sensor stand still for long enough, or has lost patience.
/// Motion starts it anew. Times are the frames' own.
class StaticMeasurement {
 public:
  enum class Progress : std::uint8_t { waiting, done, gave_up };

  /// The sensor's rest must be calibrated.
  explicit StaticMeasurement(const SensorConfig& sensor, Duration wanted = std::chrono::seconds(2),
                             Duration patience = std::chrono::seconds(20));

  /// Allocates now and then.
  Progress add(const Frame& frame);

  /// Begins again, with hands on: stillness counts once the wrench is this far (part of the range,
  /// of the axis that changed most) from what it was.
  void wait_for_change(double least);

  /// Given up because it never stood still, though tags were held.
  bool moves() const { return moved_; }
  AtRest result() const;
  /// Standard deviations of one frame's wrench, mean, N and N m.
  Vector6 wrench_sigma() const { return (sum_.variance / std::max(1, sum_.held)).cwiseSqrt(); }
  /// Mean, of all tags together, m and rad.
  Vector6 displacement() const { return sum_.displacement / std::max(1, sum_.held); }
  /// How much of the stillness that it wants is there, 0..1.
  double part() const {
    return std::min(1.0, seconds() / std::chrono::duration<double>(wanted_).count());
  }
  /// Where the tags are in the last frame.
  const Track& last_track() const { return last_; }
  double seconds() const { return std::chrono::duration<double>(counted_).count(); }

 private:
  struct Alone {
    int id = 0;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    std::unique_ptr<Tracker> tracker;
    StationarityDetector meter;
    Track last{};
    struct {
      int held = 0;
      Vector6 displacement = Vector6::Zero();
      Matrix6 covariance = Matrix6::Zero();
      double residual_fraction = 0, blur_px2 = 0;
    } sum = {};
  };
  /// Of all tags together, over frames that stood still.
  struct Sums {
    int frames = 0, held = 0;
    Vector6 wrench = Vector6::Zero(), variance = Vector6::Zero(), displacement = Vector6::Zero();
    double residual_fraction = 0;
  };

  void restart() {
    since_.reset();
    counted_ = {};
    sum_ = {};
    for (Alone& tag : alone_) tag.sum = {};
  }
  bool changed(const Sample& sample) const;
  void note_picture(const Frame& frame);

  SensorConfig sensor_;
  Duration wanted_, patience_;
  Tracker all_;
  WrenchEstimator wrench_;
  std::vector<Alone> alone_;
  std::optional<TimePoint> begin_;  ///< of the patience
  std::optional<TimePoint> since_;  ///< of the stillness
  Duration counted_{};
  bool moved_ = false;
  Track last_{};
  double least_change_ = 0;
  Vector6 before_ = Vector6::Zero();

  Sums sum_;
  TagPicture now_, then_;
};

enum class Seen : std::uint8_t { enough, too_little, stopped };

/// Until the sensor has stood still for long enough, patience is lost, the source ends or a signal
/// comes. `board`, borrowed, is served meanwhile: its light goes out otherwise.
Seen watch(FrameSource& source, const UniqueFd& stop, StaticMeasurement& static_measurement,
           Events& events, Output* board = nullptr);

/// Why watch() saw too little, in words; empty if there is something to judge.
std::string why_nothing(Seen seen, const StaticMeasurement& static_measurement);

/// In one line, with what to do: "fine   light     white at 190 of 255, as at rest".
std::string text(const InSituFinding& finding);

}  // namespace tagwrench

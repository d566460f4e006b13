// The instrument that tells the load during a calibration: a load cell, a six-axis sensor, or the
// simulated ones.
#pragma once

#include <array>
#include <string>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/core/types.h"

namespace tagwrench {

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

}  // namespace tagwrench

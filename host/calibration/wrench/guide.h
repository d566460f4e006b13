// Room calibration/wrench: known loads, step by step -> a calibrated wrench model.
// In:  a plan (masses in kg, points in m of the platform frame), tracks, readings of references.
// Out: observations (displacement m and rad, wrench N and N m, covariances) for wrench/fit.h, and
//      what people are asked to do.
// Then: plan.h (and what a step applies), record.h (when it is steady, what is made of it).
//
// Leads through a plan: asks for step after step, looks at frames and readings, accepts what is
// steady and as it should be, and says what is not. Pure: it has no clock, no descriptor and no
// terminal of its own, and never waits.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/core/types.h"

namespace tagwrench {

/// Readings of a push or a movement are kept from so long before its first frame, s.
inline constexpr double kReadingsBeforeTaking = 0.5;

/// After so long without a reading there is no reference, s.
inline constexpr double kMaxSilence = 1.0;

struct GuideOptions {
  Matrix6 stiffness = Matrix6::Identity();  ///< of the spring model
  Vector6 range = Vector6::Ones();          ///< full load per axis, N and N m
  double hold = 1.0;                        ///< s that a rest or a mass is looked at
  double patience = 30;  ///< s without success, then it is said what is waited for
  int attempts = 0;      ///< a step that failed so often is left out; 0: never, a person decides
};

struct GuideLine {
  enum class Kind : std::uint8_t { task, note, warning };
  Kind kind = Kind::note;
  std::string text;
};

class WrenchGuide {
 public:
  WrenchGuide(const WrenchPlan& plan, const GuideOptions& options);

  /// Goes on where an earlier run was stopped. Must come before the first frame.
  void resume(std::vector<StepRecord> records, const std::vector<int>& skipped);

  void frame(double time, const Track& track);
  /// Readings of one instrument, in the order of their times.
  void reading(const ReferenceSample& sample);
  /// Leaves the present step out.
  void skip();
  /// Does the latest accepted step again.
  void redo();

  bool done() const { return todo_.empty() || failed(); }
  /// The calibration cannot go on: one line that says why.
  const std::string& failure() const { return failure_; }
  bool failed() const { return !failure_.empty(); }

  /// The step that is asked for; a new number of asks() is a new task for whoever does it.
  int asked() const { return todo_.front(); }
  int asks() const { return asks_; }
  /// The next line for people; false if there is none.
  bool next(GuideLine& line) {
    if (lines_.empty()) return false;
    line = std::move(lines_.front());
    lines_.pop_front();
    return true;
  }
  /// One line about this moment: what is waited for, and what is covered so far.
  std::string live() const;

  const std::vector<StepRecord>& records() const { return records_; }
  const std::vector<int>& skipped() const { return skipped_; }
  const WrenchCoverage& coverage() const { return coverage_; }

 private:
  enum class Phase : std::uint8_t { waiting, taking };

  const PlanStep& step() const { return plan_.step(todo_.front()); }
  const PlanStep& step_of(const StepRecord& record) const { return plan_.step(record.step); }
  void say(GuideLine::Kind kind, std::string text) { lines_.push_back({kind, std::move(text)}); }
  void ask();
  void again(const std::string& why);
  void complain(const std::string& why, bool counts);
  void watch_hold();
  void watch_rest(const Hold& hold);
  void watch_mass(const Hold& hold);
  const StepRecord* rest_of_reference(double time);
  void watch_push(double time);
  void watch_movement(double time);
  void put_before(double time);
  void begin_taking(double time);
  void finish_taking();
  void watch_patience(double time);
  void accept_hold();
  void accept(StepRecord record);
  void take_again_from_rest(const Vector6& by);
  void recount();
  void leave_out(const std::string& why);
  const StepRecord* last_rest() const;
  std::string most_useful() const;
  bool check_mounting(const Hold& hold);
  std::string waiting_for() const;

  const WrenchPlan& plan_;
  GuideOptions options_;
  HoldDetector hold_;
  WrenchCoverage coverage_;
  std::deque<int> todo_;
  std::deque<GuideLine> lines_;
  std::vector<StepRecord> records_;
  std::vector<int> skipped_;
  std::string failure_;

  bool resumed_ = false;  ///< and no frame since
  int asks_ = 0;
  int attempts_ = 0;   ///< of the present step
  int mounting_ = -1;  ///< asked for last
  int zeros_ = 0;      ///< numbers given out
  int bumps_ = 0;
  Phase phase_ = Phase::waiting;
  bool new_zero_ = false;  ///< the rest just taken is one that the loads before do not share
  bool moved_ = false;     ///< since the step was asked for
  bool repeated_ = false;  ///< it was done before, and may stay as it is
  std::optional<Vector6> asked_at_;   ///< displacement then
  std::optional<double> asked_time_;  ///< s
  double reminded_ = 0;               ///< s
  bool let_go_ = false;               ///< the cell was free since the step was asked for
  double begun_ = 0;                  ///< s, of what is being taken
  StepRecord taking_;
  std::string complaint_;  ///< said last
  std::optional<ReferenceSample> last_reading_;
  std::deque<ReferenceSample> readings_;  ///< of the last seconds
  std::optional<double> first_frame_;     ///< s
  double now_ = 0;                        ///< s, of the latest frame
  std::optional<double> steady_since_;    ///< s, of the hold that is watched
};

/// "Fx ##### Fy ##... ...": five marks per axis, # for the share of covered() that is reached.
std::string coverage_bar(const WrenchCoverage& coverage);

}  // namespace tagwrench

#include "host/calibration/wrench/guide.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/calibration/wrench/load.h"
#include "host/calibration/wrench/reference.h"

namespace tagwrench {
namespace {

using Line = GuideLine::Kind;

constexpr double kOtherClock = 1.0;  // s between what a reading says and when it came
constexpr double kKeep = 3.0;        // s of readings
constexpr double kWellCovered = 0.95;
constexpr double kTouch = 0.1;    // of a push's force: it has begun
constexpr double kFree = 0.05;    // of it: nobody pushes
constexpr double kBegun = 0.05;   // of the range: a movement has begun
constexpr double kExcited = 0.1;  // of the range, standard deviation over a movement
constexpr double kMax = 1.5;      // times its seconds: a movement ends, whatever it has shown

}  // namespace

WrenchGuide::WrenchGuide(const WrenchPlan& plan, const GuideOptions& options)
    : plan_(plan),
      options_(options),
      hold_({.seconds = options.hold, .stiffness = options.stiffness, .range = options.range}),
      coverage_(options.range) {
  for (std::size_t i = 0; i < plan.steps.size(); ++i) todo_.push_back(static_cast<int>(i));
  ask();
}

void WrenchGuide::say(GuideLine::Kind kind, std::string text) {
  lines_.push_back({kind, std::move(text)});
}

bool WrenchGuide::next(GuideLine& line) {
  if (lines_.empty()) return false;
  line = std::move(lines_.front());
  lines_.pop_front();
  return true;
}

/// Says what is to be done now, to the person and to whoever watches asks().
void WrenchGuide::ask() {
  phase_ = Phase::waiting;
  moved_ = let_go_ = repeated_ = false;
  asked_at_.reset();
  asked_time_.reset();
  complaint_.clear();
  steady_since_.reset();
  taking_ = {};
  reminded_ = now_;
  if (todo_.empty()) return;
  ++asks_;
  const bool turn = step().mounting != mounting_;
  mounting_ = step().mounting;
  say(Line::task, instruction(plan_, todo_.front(), turn));
}

/// The present step once more, from the beginning.
void WrenchGuide::again(const std::string& why) {
  ++attempts_;
  if (options_.attempts > 0 && attempts_ >= options_.attempts) {
    leave_out(why);
    return;
  }
  say(Line::warning, fmt::format("{}: {}; once more", describe(plan_, todo_.front()), why));
  ask();
  repeated_ = true;
}

void WrenchGuide::leave_out(const std::string& why) {
  say(Line::warning, fmt::format("{} is left out: {}", describe(plan_, todo_.front()), why));
  skip();
}

/// Said once; an unattended run that `counts` it tries again.
void WrenchGuide::complain(const std::string& why, bool counts) {
  if (why == complaint_) return;
  if (counts && options_.attempts > 0) {
    again(why);
    return;
  }
  complaint_ = why;
  say(Line::warning, fmt::format("{}: {}", describe(plan_, todo_.front()), why));
}

/// Another run's clock may have been another one: what it recorded comes before all of this one.
void WrenchGuide::put_before(double time) {
  constexpr double kBetween = 60;
  double latest = 0;
  for (const StepRecord& record : records_) latest = std::max(latest, record.frames.back().time);
  const double shift = std::min(0.0, time - kBetween - latest);
  for (StepRecord& record : records_) {
    for (TrackedFrame& frame : record.frames) frame.time += shift;
    for (ReferenceSample& sample : record.readings) sample.time += shift;
  }
}

void WrenchGuide::complain_of_silence() {
  complain("nothing comes from the reference; look at its plug and its power", false);
}

void WrenchGuide::frame(double time, const Track& track) {
  if (resumed_) put_before(time);
  resumed_ = false;
  now_ = time;
  if (!first_frame_) first_frame_ = time;
  if (done()) return;
  if (!asked_time_) asked_time_ = reminded_ = time;
  while (!readings_.empty() && readings_.front().time < time - kKeep - options_.hold)
    readings_.pop_front();
  if (track.status != Status::ok) {
    hold_.clear();
    moved_ = true;  // what is not seen may have moved
    watch_patience(time);
    return;
  }
  hold_.add({time, track.displacement, track.covariance});
  if (!asked_at_) asked_at_ = track.displacement;
  switch (step().kind) {
    case StepKind::rest:
    case StepKind::mass:
      watch_hold();
      break;
    case StepKind::push:
      watch_push(time);
      break;
    case StepKind::six_axis:
      watch_movement(time);
      break;
  }
  if (!done()) watch_patience(time);
}

void WrenchGuide::reading(const ReferenceSample& sample) {
  if (failed() || !first_frame_) return;
  if (std::abs(sample.time - now_) > kOtherClock) {
    // They may have waited while the camera started.
    if (now_ - *first_frame_ < 2 * kOtherClock && sample.time < *first_frame_) return;
    failure_ = fmt::format(
        "the reference's times are {:.1f} s away from the frames': it is on another clock; give "
        "both the same, or restart the reference",
        sample.time - now_);
    return;
  }
  last_reading_ = sample;
  readings_.push_back(sample);
  if (phase_ == Phase::taking) taking_.readings.push_back(sample);
}

// ---- Pushes and movements ----

/// What a push or a movement counts from; nullptr, and said, where there is nothing to count from
/// or to be counted.
const StepRecord* WrenchGuide::rest_of_reference(double time) {
  const StepRecord* rest = last_rest();
  if (rest == nullptr) {
    leave_out("there is no rest to count it from");
    return nullptr;
  }
  if (last_reading_ && time - last_reading_->time <= kMaxSilence) return rest;
  phase_ = Phase::waiting;
  complain_of_silence();
  return nullptr;
}

void WrenchGuide::watch_push(double time) {
  const StepRecord* rest = rest_of_reference(time);
  if (rest == nullptr) return;
  const double force = std::abs(last_reading_->value[0] - mean_reading(*rest)[0]);
  if (phase_ == Phase::waiting) {
    let_go_ = let_go_ || force < kFree * step().force;
    if (!let_go_ || force < kTouch * step().force) return;
    begin_taking(time);
  }
  taking_.frames.push_back(hold_.frames().back());
  if (time - begun_ >= step().seconds) finish_taking();
}

void WrenchGuide::watch_movement(double time) {
  const StepRecord* rest = rest_of_reference(time);
  if (rest == nullptr) return;
  const Vector6 zero = mean_of(*rest).displacement;
  const TrackedFrame& frame = hold_.frames().back();
  if (phase_ == Phase::waiting) {
    if (hold_.scaled(frame.displacement - zero).cwiseAbs().maxCoeff() < kBegun) return;
    begin_taking(time);
  }
  taking_.frames.push_back(frame);
  const double length = time - begun_;
  if (length < step().seconds) return;
  Vector6 squares = Vector6::Zero();
  for (const TrackedFrame& f : taking_.frames)
    squares += hold_.scaled(f.displacement - zero).cwiseAbs2();
  const Vector6 deviation = (squares / static_cast<double>(taking_.frames.size())).cwiseSqrt();
  int weakest = 0;
  if (deviation.minCoeff(&weakest) > kExcited || length > kMax * step().seconds) {
    finish_taking();
    return;
  }
  complain(fmt::format("go on, and more of {}: it was hardly moved",
                       kWrenchAxes[static_cast<std::size_t>(weakest)]),
           false);
}

void WrenchGuide::begin_taking(double time) {
  phase_ = Phase::taking;
  begun_ = time;
  taking_ = {todo_.front(), 0, {}, {}};
  for (const ReferenceSample& sample : readings_) {
    if (sample.time > time - kReadingsBeforeTaking) taking_.readings.push_back(sample);
  }
}

void WrenchGuide::finish_taking() {
  const ReferenceFinding found =
      check_reference(plan_, taking_, *last_rest(), options_.stiffness, options_.range);
  switch (found.verdict) {
    case ReferenceFinding::Verdict::fine:
      accept(std::move(taking_));
      break;
    case ReferenceFinding::Verdict::again:
      again(found.text);
      break;
    case ReferenceFinding::Verdict::hopeless:
      failure_ = found.text;
      break;
  }
}

// ---- Going on ----

/// Of this visit of the mounting; a stopped and resumed one too.
const StepRecord* WrenchGuide::last_rest() const {
  for (auto r = records_.rbegin(); r != records_.rend(); ++r) {
    if (step_of(*r).visit != step().visit) return nullptr;
    if (step_of(*r).kind == StepKind::rest) return &*r;
  }
  return nullptr;
}

void WrenchGuide::accept(StepRecord record) {
  const StepRecord* rest = last_rest();
  const bool new_zero = rest == nullptr || new_zero_;
  record.zero = new_zero ? zeros_++ : rest->zero;
  new_zero_ = false;
  attempts_ = 0;
  records_.push_back(std::move(record));
  todo_.pop_front();
  recount();
  const StepRecord& latest = records_.back();
  say(Line::note, "accepted: " + describe(plan_, latest.step));
  if (step_of(latest).kind != StepKind::rest) {
    const bool open = coverage_.covered().minCoeff() < kWellCovered;
    say(Line::note, "covered:  " + coverage_bar(coverage_) + (open ? most_useful() : ""));
  }
  ask();
}

void WrenchGuide::recount() {
  coverage_ = WrenchCoverage(options_.range);
  const StepRecord* rest = nullptr;
  for (const StepRecord& record : records_) {
    if (step_of(record).kind == StepKind::rest) rest = &record;
    if (step_of(record).kind != StepKind::six_axis) {
      coverage_.add(expected_load(plan_, record.step));
    } else if (rest != nullptr) {
      const Eigen::MatrixXd w = reference_wrenches(plan_, record, *rest);
      const Eigen::MatrixXd off = w.rowwise() - w.colwise().mean();
      coverage_.add_movement(off.transpose() * off / static_cast<double>(w.rows()));
    }
  }
}

void WrenchGuide::skip() {
  if (done()) return;
  const bool first_rest = step().kind == StepKind::rest && last_rest() == nullptr;
  const int visit = step().visit;
  const std::string name = describe(plan_, todo_.front());
  do {  // without a rest, the loads that follow count from nothing
    skipped_.push_back(todo_.front());
    todo_.pop_front();
  } while (first_rest && !todo_.empty() && step().visit == visit && step().kind != StepKind::rest);
  attempts_ = 0;
  const std::string missing = still_missing();
  say(missing.empty() ? Line::note : Line::warning,
      fmt::format("skipped: {}{}", name, missing.empty() ? "" : "; then " + missing));
  ask();
}

void WrenchGuide::redo() {
  if (failed()) return;
  if (records_.empty()) {
    ask();
    return;
  }
  todo_.push_front(records_.back().step);
  records_.pop_back();
  attempts_ = 0;
  recount();
  ask();
  repeated_ = true;
}

void WrenchGuide::resume(std::vector<StepRecord> records, const std::vector<int>& skipped) {
  records_ = std::move(records);
  std::erase_if(records_, [](const StepRecord& record) { return record.frames.empty(); });
  skipped_ = skipped;
  resumed_ = true;
  std::deque<int> left;
  for (const int s : todo_) {
    const bool recorded = std::any_of(records_.begin(), records_.end(),
                                      [s](const StepRecord& r) { return r.step == s; });
    if (!recorded && std::find(skipped.begin(), skipped.end(), s) == skipped.end())
      left.push_back(s);
  }
  todo_ = left;
  for (const StepRecord& record : records_) zeros_ = std::max(zeros_, record.zero + 1);
  // The sensor may have been moved meanwhile: a rest shows it before anything else is loaded.
  const bool rest_again = !todo_.empty() && !records_.empty() && step().kind != StepKind::rest &&
                          step_of(records_.back()).visit == step().visit;
  if (rest_again) todo_.push_front(last_rest()->step);
  recount();
  lines_.clear();
  if (rest_again)
    say(Line::note, "the rest of this position is taken again: the sensor may have been moved");
  asks_ = 0;
  ask();
}

void WrenchGuide::watch_patience(double time) {
  if (phase_ == Phase::taking || time - reminded_ < options_.patience) return;
  reminded_ = time;
  if (options_.attempts > 0)
    again("nothing came of it: " + waiting_for());
  else
    say(Line::note,
        fmt::format("waiting: {} ({})", waiting_for(), instruction(plan_, todo_.front(), false)));
}

}  // namespace tagwrench

#include "host/commands/calibrate_wrench/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/calibration/wrench/guide.h"
#include "host/commands/calibrate_wrench/result.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

constexpr const char* kGainSigma = "reference_gain_sigma";
constexpr std::pair<const char*, std::string RecordedCalibration::*> kTexts[] = {
    {"plan", &RecordedCalibration::plan},
    {"plan_yaml", &RecordedCalibration::plan_yaml},
    {"reference", &RecordedCalibration::reference},
    {"notes", &RecordedCalibration::notes}};

/// Exact but for the rounding of the seconds, far less than the time between frames.
TimePoint time_point(double seconds) {
  return TimePoint(Duration(static_cast<Duration::rep>(std::llround(seconds * 1e9))));
}

constexpr Duration kRounding = std::chrono::microseconds(1);  // of marks
constexpr int kMaxZeros = 100'000;
constexpr double kMaxNumber = 1e12;

double seconds(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

[[noreturn]] void damaged(const record::RecordingReader& recording, const std::string& what) {
  throw ConfigError("recording:{}: {}; calibrate anew", recording.path().string(), what);
}

/// A reading with the number that orders it among the marks.
struct NumberedReading {
  std::int64_t id = 0;
  ReferenceSample sample;
};

std::vector<NumberedReading> read_readings(record::RecordingReader& recording,
                                           const WrenchPlan& plan) {
  const int axes = plan.reference == ReferenceKind::six_axis ? 6 : 1;
  std::vector<NumberedReading> out;
  if (plan.reference == ReferenceKind::masses) return out;
  for (record::ReferenceRecord row; recording.next(row);) {
    if (row.axes != axes || (axes == 1 && row.channel != plan.cell_channel)) continue;
    NumberedReading reading{row.id, {seconds(row.time), {}, {}, row.saturated}};
    reading.sample.value.setZero();
    reading.sample.sigma.setZero();
    bool numbers = true;
    for (int i = 0; i < axes; ++i) {
      const auto at = static_cast<std::size_t>(i);
      reading.sample.value[i] = row.value[at];
      reading.sample.sigma[i] = row.sigma[at];
      numbers = numbers && std::abs(row.value[at]) < kMaxNumber && row.sigma[at] >= 0 &&
                row.sigma[at] < kMaxNumber;
    }
    if (!numbers) damaged(recording, "a reading of the reference is not in newtons");
    out.push_back(reading);
  }
  return out;
}

/// As the guide takes them.
void add_readings(const std::vector<NumberedReading>& readings, bool hold, std::int64_t id,
                  StepRecord& record) {
  const double from = record.frames.front().time;
  const double to = record.frames.back().time;
  for (const NumberedReading& reading : readings) {
    const double time = reading.sample.time;
    const bool within = hold ? time >= from && time <= to : time > from - kReadingsBeforeTaking;
    if (within && reading.id < id) record.readings.push_back(reading.sample);
  }
}

void track_frames(Input& input, const std::vector<AcceptedStep>& steps,
                  std::vector<StepRecord>& records) {
  FrameSource& source = *input.source;
  Tracker tracker = make_tracker(input.sensor);
  Frame frame;
  for (ReadStatus status; (status = source.read(frame)) != ReadStatus::end;) {
    if (status != ReadStatus::frame) continue;
    Track track = tracker.track(frame);
    if (track.needs_whole_frame && source.complete(frame)) track = tracker.track(frame);
    source.want(track.wanted);
    if (track.status != Status::ok) continue;
    const TimePoint time = frame.capture_time;
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (time >= steps[i].from - kRounding && time <= steps[i].to + kRounding)
        records[i].frames.push_back({seconds(time), track.displacement, track.covariance});
  }
  if (const std::string bad = source.unusable(); !bad.empty()) log_info(bad);
}

}  // namespace

void put_into(record::Head& head, const RecordedCalibration& calibration) {
  for (const auto& [key, text] : kTexts) head.more.emplace_back(key, calibration.*text);
  head.more.emplace_back(kGainSigma, fmt::format("{}", calibration.gain_sigma));
}

RecordedCalibration calibration_in(const record::Head& head) {
  RecordedCalibration out;
  for (const auto& [key, value] : head.more) {
    for (const auto& [name, text] : kTexts)
      if (key == name) out.*text = value;
    if (key != kGainSigma) continue;
    const double number = command_line::to_number(value).value_or(0);
    out.gain_sigma = number >= 0 && number < 1 ? number : 0;
  }
  return out;
}

void CalibrationRecorder::frame(const Frame& frame, const Region& decoded, const RawFrame& raw,
                                const Track& track) noexcept {
  latest_ = frame.capture_time;
  writer_.frame(frame, decoded, raw);
  writer_.track(track);
}

void CalibrationRecorder::reading(const ReferenceReading& reading, int channel) noexcept {
  record::ReferenceRecord row;
  row.time = reading.time;
  row.time_sigma = reading.time_sigma;
  row.channel = channel;
  row.axes = reading.axes;
  for (std::size_t i = 0; i < std::min<std::size_t>(reading.axes, 6); ++i) {
    row.value[i] = reading.value[i];
    row.sigma[i] = reading.sigma[i];
  }
  row.saturated = reading.saturated;
  writer_.reference(row);
}

void CalibrationRecorder::follow(const std::vector<StepRecord>& records) {
  std::vector<Marked> now;
  for (const StepRecord& record : records)
    now.push_back(
        {record.step, record.zero, record.frames.front().time, record.frames.back().time});
  const auto [lost, fresh] = std::mismatch(marked_.begin(), marked_.end(), now.begin(), now.end());
  for (auto old = marked_.end(); old != lost;) {
    --old;
    writer_.withdraw(old->step, time_point(old->from));
  }
  for (auto m = fresh; m != now.end(); ++m) {
    writer_.mark(m->step, true, time_point(m->from), m->zero);
    writer_.mark(m->step, false, time_point(m->to));
  }
  marked_ = std::move(now);
}

std::string CalibrationRecorder::trouble() {
  if (told_ || !writer_.state().failed) return {};
  told_ = true;
  return writer_.failure();
}

std::vector<AcceptedStep> accepted_steps(record::RecordingReader& recording,
                                         const WrenchPlan& plan) {
  std::vector<AcceptedStep> steps;
  for (const record::Mark& mark : recording.marks()) {
    if (static_cast<std::size_t>(mark.step) >= plan.steps.size())
      damaged(recording, fmt::format("its step {} is not in the plan", mark.step + 1));
    if (mark.begin) {
      if (mark.zero < 0 || mark.zero > kMaxZeros) damaged(recording, "its marks are damaged");
      steps.push_back({mark.step, mark.zero, mark.time, mark.time, 0});
      continue;
    }
    if (steps.empty() || steps.back().step != mark.step || steps.back().id != 0 ||
        mark.time < steps.back().from)
      damaged(recording, "its marks are damaged");
    steps.back().to = mark.time;
    steps.back().id = mark.id;
  }
  if (!steps.empty() && steps.back().id == 0) steps.pop_back();  // cut off there
  if (steps.empty()) {
    throw ConfigError(
        "recording:{}: holds no step of a calibration; record one with `tagwrench calibrate wrench "
        "--record FILE`",
        recording.path().string());
  }
  if (!zeros_fit(steps, plan)) damaged(recording, "its loads have no rest to count from");
  return steps;
}

std::vector<StepRecord> replay_steps(Input& input, record::RecordingReader& readings,
                                     const std::vector<AcceptedStep>& steps,
                                     const WrenchPlan& plan) {
  std::vector<StepRecord> records;
  for (const AcceptedStep& step : steps) records.push_back({step.step, step.zero, {}, {}});
  const std::vector<NumberedReading> all = read_readings(readings, plan);
  track_frames(input, steps, records);
  for (std::size_t i = 0; i < records.size(); ++i) {
    StepRecord& record = records[i];
    if (record.frames.size() < 2) {
      damaged(readings, fmt::format("{} has no frames in which --sensor's tags can be tracked",
                                    describe(plan, record.step)));
    }
    const StepKind kind = plan.steps[static_cast<std::size_t>(record.step)].kind;
    add_readings(all, kind == StepKind::rest || kind == StepKind::mass, steps[i].id, record);
    if (plan.reference != ReferenceKind::masses && record.readings.empty())
      damaged(readings,
              fmt::format("{} has no readings of the reference", describe(plan, record.step)));
  }
  return records;
}

std::string not_recorded(const std::vector<AcceptedStep>& steps, const WrenchPlan& plan) {
  std::string out;
  for (int s = 0; s < static_cast<int>(plan.steps.size()); ++s) {
    const bool there =
        std::any_of(steps.begin(), steps.end(), [s](const AcceptedStep& a) { return a.step == s; });
    if (!there) out += (out.empty() ? "" : ", ") + describe(plan, s);
  }
  return out;
}

}  // namespace tagwrench

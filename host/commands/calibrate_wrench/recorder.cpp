#include "host/commands/calibrate_wrench/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace tagwrench {
namespace {

using record::EventKind;

constexpr const char* kPlan = "plan";
constexpr const char* kPlanYaml = "plan_yaml";
constexpr const char* kReference = "reference";
constexpr const char* kGainSigma = "reference_gain_sigma";
constexpr const char* kNotes = "notes";

/// Exact but for the rounding of the seconds, far less than the time between frames.
TimePoint time_point(double seconds) {
  return TimePoint(Duration(static_cast<Duration::rep>(std::llround(seconds * 1e9))));
}

}  // namespace

void put_into(record::Head& head, const RecordedCalibration& calibration) {
  head.more.emplace_back(kPlan, calibration.plan);
  head.more.emplace_back(kPlanYaml, calibration.plan_yaml);
  head.more.emplace_back(kReference, calibration.reference);
  head.more.emplace_back(kGainSigma, fmt::format("{}", calibration.gain_sigma));
  head.more.emplace_back(kNotes, calibration.notes);
}

RecordedCalibration calibration_in(const record::Head& head) {
  RecordedCalibration out;
  for (const auto& [key, value] : head.more) {
    if (key == kPlan) out.plan = value;
    if (key == kPlanYaml) out.plan_yaml = value;
    if (key == kReference) out.reference = value;
    if (key == kNotes) out.notes = value;
    if (key == kGainSigma) {
      double number = 0;
      std::from_chars(value.data(), value.data() + value.size(), number);
      out.gain_sigma = number >= 0 && number < 1 ? number : 0;
    }
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

void CalibrationRecorder::disconnected(std::string_view detail) noexcept {
  writer_.event(EventKind::disconnected, latest_, detail);
}

void CalibrationRecorder::reconnected(std::string_view detail) noexcept {
  writer_.event(EventKind::reconnected, latest_, detail);
}

void CalibrationRecorder::note(std::string_view text) noexcept {
  writer_.event(EventKind::note, latest_, text);
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

}  // namespace tagwrench

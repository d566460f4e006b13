// The steps of a calibration. Live: frames, readings, keys and signals to the guide; what it says
// to the terminal; what it has accepted to the disk, and all of it to a recording. Or once more:
// the frames of such a recording through the tracker, the same stretches of them.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/app/input.h"
#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/commands/calibrate_wrench/result.h"
#include "host/commands/measuring.h"
#include "host/recording/reader.h"
#include "host/recording/writer.h"

namespace tagwrench {

/// What a calibration adds to the head of its recording.
struct RecordedCalibration {
  std::string plan;       ///< name
  std::string plan_yaml;  ///< its text
  std::string reference;  ///< one line for people
  double gain_sigma = 0;  ///< relative, of the load cell's calibration
  std::string notes;
};
void put_into(record::Head& head, const RecordedCalibration& calibration);
/// As put_into() left it; plan_yaml is empty if the recording is of something else.
RecordedCalibration calibration_in(const record::Head& head);

class CalibrationRecorder {
 public:
  /// Starts a thread. Throws ConfigError.
  CalibrationRecorder(const record::WriterOptions& options, const record::Head& head)
      : writer_(options, head) {}

  /// `decoded`: what the source had decoded before the tracker asked for more.
  void frame(const Frame& frame, const Region& decoded, const RawFrame& raw,
             const Track& track) noexcept;
  void reading(const ReferenceReading& reading, int channel) noexcept;
  void event(record::EventKind kind, std::string_view detail) noexcept {
    writer_.event(kind, latest_, detail);
  }
  /// Marks what was accepted since the last call, and what no longer counts. Must come before the
  /// next frame and the next reading.
  void follow(const std::vector<StepRecord>& records);

  /// One line once nothing more is written, and once only; empty until then.
  std::string trouble();
  /// Ends it. One line about what went wrong; empty if nothing did.
  std::string finish() noexcept { return writer_.finish(); }
  record::WriterState state() const noexcept { return writer_.state(); }

 private:
  struct Marked {
    int step = 0;
    int zero = 0;
    double from = 0, to = 0;  ///< s
    bool operator==(const Marked&) const = default;
  };

  record::RecordingWriter writer_;
  std::vector<Marked> marked_;
  TimePoint latest_{};  ///< frame
  bool told_ = false;
};

/// Of a step that was accepted and still counted in the end.
struct AcceptedStep {
  int step = 0;            ///< of the plan
  int zero = 0;            ///< steps with one number count from one rest
  TimePoint from{}, to{};  ///< first and last frame
  std::int64_t id = 0;     ///< of the acceptance: later readings were not known by then
};

/// In the order of acceptance. Throws ConfigError: there are none, or they do not fit the plan.
std::vector<AcceptedStep> accepted_steps(record::RecordingReader& recording,
                                         const WrenchPlan& plan);

/// Tracks all frames of `input` and gives each step what it had in the calibration itself.
/// `readings` is at its beginning. Throws ConfigError: a step has nothing to go by.
std::vector<StepRecord> replay_steps(Input& input, record::RecordingReader& readings,
                                     const std::vector<AcceptedStep>& steps,
                                     const WrenchPlan& plan);

/// Steps of the plan that are not there, for people: "step 3 (...), step 4 (...)"; empty: none.
std::string not_recorded(const std::vector<AcceptedStep>& steps, const WrenchPlan& plan);

struct GuideRun {
  BenchInput* at = nullptr;
  Reference* reference = nullptr;           ///< null: masses
  CalibrationRecorder* recorder = nullptr;  ///< null: nothing is recorded
  const UniqueFd* stop = nullptr;           ///< of termination_fd()
  const WrenchPlan* plan = nullptr;
  std::filesystem::path progress;
  ProgressOf of;
  std::optional<double> seconds;
  Events* events = nullptr;
};

enum class GuideEnd : std::uint8_t {
  done,
  stopped,  ///< by a key, a signal or the time limit
  ended,    ///< the source has no more frames
  failed,   ///< the guide says why
};

/// Runs until the guide is done or something ends it. What was accepted is in `progress` by then.
/// Throws std::runtime_error if that cannot be written.
GuideEnd run_guide(const GuideRun& run, WrenchGuide& guide);

}  // namespace tagwrench

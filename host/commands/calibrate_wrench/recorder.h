// A calibration that is recorded: its frames, tracks and readings, and the stretch of them in which
// each step was accepted.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/wrench/record.h"
#include "host/calibration/wrench/reference.h"
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
  void disconnected(std::string_view detail) noexcept;
  void reconnected(std::string_view detail) noexcept;
  void note(std::string_view text) noexcept;
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

}  // namespace tagwrench

// A run that is recorded: what the pipeline tells of each frame, what people are told, its course.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "host/app/input.h"
#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/recording/schema.h"
#include "host/recording/writer.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

struct RecordOptions {
  std::string file;
  record::Keep keep = record::Keep::raw;
};

/// Throws ConfigError if the file, named by `option`, exists, or its folder cannot be written.
void check_recording(const RecordOptions& options, std::string_view option = "--out");

/// What a recording says of itself, for this input.
record::Head recording_head(const Input& input, record::Keep keep);

class Recording final : public Output, public record::FrameRecorder {
 public:
  /// `lossless`: see record::WriterOptions. `frames` and `time` are when the run will end, for the
  /// progress that it tells. Throws ConfigError.
  Recording(const RecordOptions& options, const record::Head& head, bool lossless,
            std::optional<std::uint64_t> frames, std::optional<Duration> time);

  // Output: fails when nothing more can be written.
  SendStatus send(const Sample& sample) noexcept override {
    dropped_ += sample.dropped;
    return writer().state().failed ? SendStatus::failed : SendStatus::ok;
  }
  std::string failure() const override { return writer().failure(); }
  int poll_fd() const noexcept override { return timer_.get(); }
  std::string_view service() noexcept override;
  /// What people are told is kept too, but for its own progress.
  bool notice(std::string_view line) noexcept override {
    if (line.data() != line_.data()) note(line);
    return false;
  }

  /// Ends it. One line about what went wrong; empty if nothing did.
  std::string finish() noexcept { return writer().finish(); }
  /// One line about what there is now.
  std::string summary() const;

 private:
  std::string file_;
  UniqueFd timer_;
  std::optional<std::uint64_t> frames_;
  std::optional<Duration> time_;
  TimePoint start_;
  TimePoint last_line_;
  std::uint64_t last_frames_ = 0;
  std::uint64_t dropped_ = 0;
  std::string line_;
};

// The sensor of a recording: its files go in when it begins, and come out to replay it.

/// Puts text, measured files, and rest picture and calibration that the text names into the head.
/// `text` is that of `name`, a path that the others are relative to, or of a sensor that has no
/// file. A file that cannot be read is left out.
void take_sensor(const std::string& name, const std::string& text, record::Head& head);

/// The sensor as it was. Throws ConfigError, naming the recording, if it cannot be used.
SensorConfig recorded_sensor(const record::Head& head, const std::string& recording,
                             WrenchCalibration use = WrenchCalibration::use);

/// sensor.yaml and its measured/ into a folder, which may be one of frames; for a text that names a
/// picture or a calibration beside it sensor.yaml.rest and calibration.json, and a text that names
/// these, without the comments.
/// Throws ConfigError or std::runtime_error.
void write_recorded_sensor(const record::Head& head, const std::filesystem::path& folder);

}  // namespace tagwrench

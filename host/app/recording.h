// A run that is recorded: what the pipeline tells of each frame, what people are told, and how it
// goes.
#pragma once

#include <optional>
#include <string>

#include "host/app/input.h"
#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/recording/writer.h"

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
  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return writer().failure(); }
  int poll_fd() const noexcept override { return timer_.get(); }
  std::string_view service() noexcept override;
  bool notice(std::string_view line) noexcept override;

  /// Ends it. One line about what went wrong; empty if nothing did.
  std::string finish() noexcept { return writer().finish(); }
  /// One line about what there is now.
  std::string summary() const;

 private:
  std::string progress();

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

}  // namespace tagwrench

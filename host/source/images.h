// A folder of pictures as a camera: PNG, PGM and JPEG in the order of their names.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/source/decode.h"
#include "host/source/frame_source.h"

namespace tagwrench {

// frames.csv of a recorded folder: one line a picture, `file,t_ns`. Pure.

/// The times of `files` (names without folder, in the order of playing) from the text of a
/// frames.csv. The first line may be the header. Throws ConfigError that names `source` and the
/// line: a line that is not `file,t_ns`, a file that does not exist or is named twice, a file
/// without a time, times that do not increase in the order of playing.
std::vector<Duration> parse_frame_times(std::string_view text, const std::string& source,
                                        std::span<const std::string> files);

class ImagesSource final : public FrameSource {
 public:
  /// Times come from DIR/frames.csv where there is one, else 25 frames a second. `fast`: every
  /// frame is delivered, as fast as read() is called; else the recorded times pace it, beginning at
  /// the first read(), and a loop that is late loses frames. Throws ConfigError: no folder, no
  /// pictures, an unreadable header, sizes that differ, a bad frames.csv.
  ImagesSource(const std::string& dir, bool fast);

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_ ? timer_.get() : -1; }
  ReadStatus read(Frame& frame) noexcept override;
  /// Saves work where the picture is a JPEG; PNG and PGM are always decoded whole.
  void want(const Region& region) noexcept override { wanted_ = region; }
  bool complete(Frame& frame) noexcept override;
  RawFrame raw() const noexcept override { return raw_; }

  std::size_t count() const noexcept { return paths_.size(); }
  /// The file that a Frame came from, by its sequence.
  const std::string& path_of(std::uint64_t sequence) const { return paths_.at(sequence); }

  /// Corrupt files; each is also in Frame::dropped of the next good one.
  std::string unusable() const override;
  std::uint64_t corrupt_frames() const noexcept { return corrupt_; }

 private:
  TimePoint due(std::size_t index) const noexcept { return start_ + (times_[index] - times_[0]); }
  void arm() const noexcept;
  bool load(const std::string& path, Frame& frame) noexcept;

  std::vector<std::string> paths_;
  std::vector<Duration> times_;
  SourceFormat format_;
  UniqueFd timer_;
  std::vector<std::uint8_t> bytes_;  ///< of the last file; grows to the largest and stays there
  RawFrame raw_;                     ///< points there
  std::unique_ptr<RawDecoder> decoder_;
  Region wanted_;
  TimePoint start_{};
  std::size_t next_ = 0;
  std::size_t delivered_ = 0;  ///< index after the last frame that was handed on
  std::uint64_t corrupt_ = 0;
  std::size_t first_corrupt_ = 0;
};

}  // namespace tagwrench

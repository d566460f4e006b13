// What was recorded, as a camera: a folder of pictures (PNG, PGM and JPEG in the order of their
// names), and a recording, whose frames are decoded as they were, and where none came, none comes.
//
// `fast`: everything is delivered, as fast as read() is called; else the recorded times pace it,
// beginning at the first read(), and a loop that is late loses frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/recording/reader.h"
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

/// What a folder does with a picture whose header cannot be read, or of another size.
enum class OddPictures : std::uint8_t {
  refuse,
  set_aside,  ///< the size is that of most of them
};

struct OddPicture {
  std::string path;
  std::optional<ImageSize> size;  ///< none: its header cannot be read
};

class ImagesSource final : public FrameSource {
 public:
  /// Times come from DIR/frames.csv where there is one, else 25 frames a second. Throws
  /// ConfigError: no folder, no pictures, odd ones that are refused, a bad frames.csv.
  ImagesSource(const std::string& dir, bool fast, OddPictures odd = OddPictures::refuse);

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_ ? timer_.get() : -1; }
  ReadStatus read(Frame& frame) noexcept override;
  /// Saves work where the picture is a JPEG; PNG and PGM are always decoded whole.
  void want(const Region& region) noexcept override { wanted_ = region; }
  bool complete(Frame& frame) noexcept override;
  RawFrame raw() const noexcept override { return raw_; }

  std::size_t count() const noexcept { return paths_.size(); }
  const std::vector<OddPicture>& set_aside() const noexcept { return odd_; }
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
  std::vector<OddPicture> odd_;
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

class RecordingSource final : public FrameSource {
 public:
  /// Throws ConfigError: the recording holds no frames, or their pixels were not kept.
  RecordingSource(std::unique_ptr<record::RecordingReader> recording, bool fast);

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_ ? timer_.get() : -1; }
  ReadStatus read(Frame& frame) noexcept override;
  void want(const Region& region) noexcept override { wanted_ = region; }
  /// Of a recording that kept regions: false, unless the frame was completed when it was recorded.
  bool complete(Frame& frame) noexcept override;
  RawFrame raw() const noexcept override;
  std::string detail() const override { return detail_; }
  std::string unusable() const override;
  bool damaged() const override { return !damage_.empty() || damaged_frames_ > 0; }

  const record::RecordingReader& recording() const noexcept { return *recording_; }

 private:
  bool advance() noexcept;
  TimePoint due() const noexcept { return start_ + (entry_.time - first_); }
  void arm() const noexcept;
  void pass_late(TimePoint now) noexcept;
  bool decode(Frame& frame) noexcept;

  std::unique_ptr<record::RecordingReader> recording_;
  SourceFormat format_;
  UniqueFd timer_;
  RawDecoder decoder_;
  std::vector<std::uint8_t> picture_;  ///< that crops are placed in
  record::Entry entry_;                ///< the next, or the one just delivered
  bool waiting_ = false;               ///< entry_ was not delivered yet
  std::size_t frame_ = 0;              ///< number, from 0, of the next that will be delivered
  bool started_ = false;
  TimePoint start_{};
  TimePoint first_{};
  Region wanted_;
  std::uint32_t passed_ = 0;  ///< frames that were skipped since the last one
  std::uint64_t without_pixels_ = 0;
  std::uint64_t damaged_frames_ = 0;
  std::string damage_;
  std::string detail_;
};

}  // namespace tagwrench

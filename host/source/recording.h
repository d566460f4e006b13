// A recording as a camera: the frames that were recorded, decoded as they were, and where none
// came, none comes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/recording/reader.h"
#include "host/source/decode.h"
#include "host/source/frame_source.h"

namespace tagwrench {

class RecordingSource final : public FrameSource {
 public:
  /// `fast`: everything is delivered, as fast as read() is called; else the recorded times pace it,
  /// beginning at the first read(), and a loop that is late loses frames. Throws ConfigError: the
  /// recording holds no frames, or their pixels were not kept.
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
  std::uint64_t unusable_ = 0;
  std::string damage_;
  std::string detail_;
};

}  // namespace tagwrench

// What a pipeline tells about each frame, besides the samples that its outputs get: a recording
// listens.
#pragma once

#include <string_view>

#include "host/core/types.h"

namespace tagwrench {

/// One frame and what became of it. Valid during the call only.
struct LoggedFrame {
  const Frame& frame;  ///< with what was decoded in the end
  Region decoded;      ///< what was decoded when the source delivered it
  RawFrame raw;
  const Track& track;
  const Sample& sample;  ///< as the outputs got it
};

/// Is called in the order of events, by the loop's thread; must not wait.
class FrameLog {
 public:
  FrameLog() = default;
  FrameLog(const FrameLog&) = delete;
  FrameLog& operator=(const FrameLog&) = delete;
  virtual ~FrameLog() = default;

  virtual void frame(const LoggedFrame& all) noexcept = 0;
  /// The outputs got this neutral sample because no frame came.
  virtual void missing(const Sample& sample) noexcept = 0;
  virtual void disconnected(std::string_view detail) noexcept = 0;
  virtual void reconnected(std::string_view detail) noexcept = 0;
};

}  // namespace tagwrench

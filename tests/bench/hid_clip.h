// Rendered pictures, played at a camera's pace out of memory.
#pragma once

#include <cstdint>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/sensor/sensor_config.h"
#include "host/source/frame_source.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::bench {

struct HidClip {
  double fps = 30;
  SensorConfig sensor;
  std::vector<std::vector<std::uint8_t>> pictures;  ///< 640 x 480 GREY

  HidClip(const sim::Scenario& scenario, double seconds);
};

/// Pictures as a camera's mapped buffers: read() hands out a pointer. It counts latency from the
/// instant at which the picture was due, and loses pictures that nobody took in time. From picture
/// `warm` on it notes the reading thread's processor time.
class ClipSource final : public FrameSource {
 public:
  /// `script`: which picture comes when; after its end the source ends. Borrows the clip.
  ClipSource(const HidClip& clip, std::vector<int> script, std::size_t warm);

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_.get(); }
  ReadStatus read(Frame& frame) noexcept override;

  double cpu_share() const;  ///< of one core, of the reading thread, since `warm`

 private:
  TimePoint due(std::size_t index) const noexcept;
  void arm() const noexcept;

  const HidClip& clip_;
  std::vector<int> script_;
  std::size_t warm_;
  SourceFormat format_;
  UniqueFd timer_;
  TimePoint start_{};
  std::size_t next_ = 0;
  std::size_t delivered_ = 0;
  double warm_cpu_ = 0, end_cpu_ = 0;  // s
  TimePoint warm_time_{}, end_time_{};
};

}  // namespace tagwrench::bench

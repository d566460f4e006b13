// What is asked of a camera: its mode, chosen among those that it lists (pure, no device), and its
// controls. A camera that adjusts itself moves the picture under the tracker: everything automatic
// is stopped, and put back at the end. The controls are behind a small interface so that the order
// of doing can be tested without a camera.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/source/decode.h"

namespace tagwrench {

/// One line of a camera's list: a size in a pixel format, at one rate or a range of rates.
struct V4l2Mode {
  PixelFormat pixels = PixelFormat::grey;
  std::uint32_t fourcc = 0;  ///< the driver's own code for `pixels`
  int width = 0;
  int height = 0;
  double fps_min = 0;  ///< equal to fps_max for a fixed rate; both 0 where the driver does not say
  double fps_max = 0;
};

/// Zero and nullopt mean "you choose".
struct V4l2Options {
  std::string path;  ///< /dev/videoN or a stable link to one
  int width = 0;     ///< both or neither
  int height = 0;
  double fps = 0;
  std::optional<PixelFormat> pixels;
  int preferred_width = 640;  ///< the sensor's size, taken when none is asked and the camera has it
  int preferred_height = 480;
  int exposure_us = 0;  ///< 0 keeps what automatic exposure settled on
};

/// Reads PATH[,WIDTHxHEIGHT[@FPS][,FOURCC]]; throws ConfigError that quotes the part that is wrong.
V4l2Options parse_v4l2_spec(std::string_view spec);

struct V4l2Choice {
  V4l2Mode mode;
  double fps = 0;  ///< to ask of the driver; 0 where it does not say
};

/// The best mode that fits what was asked: the size asked, or the one nearest to the preferred;
/// then the highest rate (or the rate asked, within 1 %); then uncompressed over MJPG, and of those
/// the cheapest to decode.
std::optional<V4l2Choice> choose_mode(std::span<const V4l2Mode> modes, const V4l2Options& options);

/// "640x480 YUYV 30 fps".
std::string describe(const V4l2Mode& mode);
/// A short list, best first: at most `limit` modes, then "and N more".
std::string describe(std::span<const V4l2Mode> modes, std::size_t limit);

struct ControlRange {
  std::int32_t minimum = 0;
  std::int32_t maximum = 0;
  std::int32_t step = 1;
  bool writable = true;
};

class ControlPort {
 public:
  ControlPort() = default;
  ControlPort(const ControlPort&) = delete;
  ControlPort& operator=(const ControlPort&) = delete;
  virtual ~ControlPort() = default;
  /// Nothing where the camera does not have control `id` (a V4L2_CID_ number).
  virtual std::optional<ControlRange> range(std::uint32_t id) = 0;
  virtual std::optional<std::int32_t> get(std::uint32_t id) = 0;
  virtual bool set(std::uint32_t id, std::int32_t value) = 0;
};

/// The controls of an open V4L2 device; does not own the descriptor.
class V4l2ControlPort final : public ControlPort {
 public:
  explicit V4l2ControlPort(int fd) : fd_(fd) {}
  std::optional<ControlRange> range(std::uint32_t id) override;
  std::optional<std::int32_t> get(std::uint32_t id) override;
  bool set(std::uint32_t id, std::int32_t value) override;

 private:
  int fd_;
};

/// Remembers, locks, restores. Never throws on what a camera refuses: it is listed instead.
class ControlLock {
 public:
  /// Remembers what every control is now, then stops the camera from trading frame rate for light,
  /// which would spoil what automatic exposure settles on next.
  void remember(ControlPort& port);
  /// Whether anything is automatic, so that waiting for it to settle is worth it.
  bool needs_settling() const noexcept { return needs_settling_; }
  /// Stops every automatism and fixes its value where it stands, or the exposure at `exposure_us`
  /// if that is not 0.
  void lock(ControlPort& port, int exposure_us);
  /// Another value for a control that lock() fixed, the nearest that the camera has. False: it
  /// was not fixed, or the camera refuses.
  bool change(ControlPort& port, std::uint32_t id, std::int64_t value);
  /// What a control was fixed at; nothing if it was not.
  std::optional<std::int32_t> locked(std::uint32_t id) const noexcept;
  /// Writes the locked values again, into a camera that was away.
  void relock(ControlPort& port);
  /// Puts everything back as remembered: values first, then the automatisms.
  void restore(ControlPort& port);

  /// Names of the controls that lock() would take, for people.
  static std::string available(ControlPort& port);
  /// "locked exposure, gain; refused sharpness; without focus".
  std::string description() const;

 private:
  void apply(ControlPort& port, std::size_t index, std::int32_t value);

  struct Setting {
    std::size_t index = 0;  ///< in the table of controls
    std::int32_t value = 0;
  };
  std::vector<Setting> original_;
  std::vector<Setting> locked_;
  std::vector<std::size_t> absent_;
  std::vector<std::size_t> refused_;
  bool needs_settling_ = false;
};

}  // namespace tagwrench

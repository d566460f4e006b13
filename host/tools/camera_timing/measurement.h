// Room tools/camera_timing: what a camera really does.
// In:  pictures of a light that flashes a known pattern, or of a screen that flips; their stamps.
// Out: frame rate (Hz), latency, jitter, read-out, exposure (s), stale and missing pictures, each
//      with its standard deviation. Formulas: docs/theory.md.
// Then: camera_timing.h (the model), flip_patches.h (screens).
//
// `tagwrench camera-timing` without its options: a camera, a lamp, and what is done with them.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/board/board_session.h"
#include "host/core/types.h"
#include "host/source/frame_source.h"
#include "host/source/simulator/mechanics.h"
#include "host/tools/camera_timing/camera_timing.h"

namespace tagwrench {

// A lamp that flashes a known pattern by a clock that the host knows: the LED of a board, or the
// simulator's.

/// When a pattern's bits begin: bit k at start + k * period.
struct PatternTiming {
  TimePoint start{};       ///< host clock
  double period = 0;       ///< of a bit, on the host's clock, s
  double start_sigma = 0;  ///< of all bits together, s
  double rate_sigma = 0;   ///< of the period, relative
  std::uint16_t seed = 1;  ///< protocol/pattern.h
};

/// Orders are carried out soon, not at once. Nothing throws but setup.
class PatternLamp {
 public:
  virtual ~PatternLamp() = default;

  virtual void off() = 0;
  virtual void steady(int level_permille) = 0;
  /// Pseudo-random bits; the light is off until the first.
  virtual void pattern(Duration bit, std::uint16_t seed) = 0;

  /// Of the running pattern, as well as it is known by now. Nothing: it did not start, or the clock
  /// is not known.
  virtual std::optional<PatternTiming> timing() const = 0;

  /// Readable when service() has something to do; -1: never.
  virtual int poll_fd() const noexcept { return -1; }
  /// Keeps clock and lamp alive; to be called after each frame and when poll_fd() is readable.
  virtual void service() noexcept {}
  /// One line once the lamp can no longer be trusted (unplugged, limited by the board); else empty.
  virtual std::string trouble() const { return {}; }
  /// The pattern cannot flash faster.
  virtual Duration shortest_bit() const noexcept { return std::chrono::microseconds(200); }
};

// The measurement.

struct CameraTimingOptions {
  double seconds = 10;             ///< of pattern
  int reference_permille = 1000;   ///< level of the LED that a pattern's bits have
  double reference_seconds = 2.5;  ///< of steady light; the frames are handed to `process`
  /// Does with a frame what a run does, up to the last output.
  std::function<void(Frame&)> process;
  std::function<bool()> stopped;                ///< whether to end early; may be empty
  int stop_fd = -1;                             ///< readable when that may have changed
  std::function<void(const std::string&)> say;  ///< what is being done; may be empty
};

struct CameraTimingMeasurement {
  std::string refusal;  ///< one line: why there is no result
  bool failed =
      false;  ///< the refusal is a fault of the run (stopped, unplugged), not of the scene
  CameraTimingResult result;
  std::vector<double> processing;  ///< stamp to output of each processed frame, s, ascending
  double used_fraction = 0, saturated_fraction = 0,
         ambient_fraction = 0;  ///< of the picture; see RowProfiler
  double exposure_set_us = 0;   ///< that the camera was set to for it; 0: left alone
  double bit = 0;               ///< s
  double edge_sigma = 0;        ///< s, of the pattern on the host's clock
};

/// Takes reference pictures with the LED steady and off, then pictures of the pattern. On a virtual
/// clock as fast as it goes. The exposure is shortened if the LED alone makes the picture white,
/// and put back.
CameraTimingMeasurement measure_camera_timing(FrameSource& source, PatternLamp& lamp,
                                              const CameraTimingOptions& options);

// What `tagwrench camera-timing` says: for people, and as JSON.

struct CameraTimingSetting {
  std::string camera;           ///< one line about the source
  std::string lamp;             ///< one line about the lamp
  std::string output;           ///< where processed frames went: "wrench sensor"
  double announced_period = 0;  ///< s
};

/// Some twenty lines.
std::string report_text(const CameraTimingMeasurement& measurement,
                        const CameraTimingSetting& setting);

/// One object; figures that the pictures cannot tell are null.
std::string report_json(const CameraTimingMeasurement& measurement,
                        const CameraTimingSetting& setting);

// The measurement without a board, as in the published design: a patch on a screen, in view of the
// camera, that flips between black and white. It tells less than an LED: the screen's own latency
// is in every number.

class FlipPatch {
 public:
  virtual ~FlipPatch() = default;

  /// Begins to show it so from `when` on, or from as soon as it can.
  virtual void show(bool white, TimePoint when) = 0;
  /// From when it has shown what was ordered last, host clock; nothing: not known yet.
  virtual std::optional<TimePoint> shown() = 0;
  /// By how much shown() may be wrong.
  virtual Duration clock_error() const { return {}; }
  /// One line: why it shows nothing any more; empty: it does.
  virtual std::string ended() { return {}; }
};

struct ScreenOptions {
  double seconds = 20;
  std::function<bool()> stopped;  ///< whether to end early; may be empty
  int stop_fd = -1;               ///< readable when that may have changed
};

struct ScreenMeasurement {
  std::string refusal;    ///< one line: why there is no result
  Figure frame_rate;      ///< by the time stamps, Hz
  Figure latency;         ///< of screen and camera, from the flip to the stamp of a picture whose
                          ///< exposure's middle is then, s
  double round_trip = 0;  ///< mean time from a flip to the arrival of the picture that shows it, s
  int flips = 0;          ///< that were seen
  int missed = 0;         ///< not seen within 1.5 s
  double contrast = 0;    ///< grey levels between black and white, mean of the picture
};

/// Flips at a random time after the picture that showed the flip before. The first picture to show
/// a flip comes latency to latency + one period later, evenly: latency is the mean less half a
/// period. A screen that flips with its refresh alone does so less evenly where that keeps step
/// with the camera; the widest gap that is left counts into the deviation.
ScreenMeasurement measure_screen(FrameSource& source, FlipPatch& patch,
                                 const ScreenOptions& options);

std::string report_text(const ScreenMeasurement& measurement, const std::string& camera,
                        const std::string& screen, double announced_period);
std::string report_json(const ScreenMeasurement& measurement, const std::string& camera,
                        const std::string& screen, double announced_period);

// A board's LED as the lamp of a measurement.

class BoardPatternLamp final : public PatternLamp {
 public:
  /// `session`, borrowed, is ready and its clock known. `pump` carries bytes between it and the
  /// board whenever it is called; `poll_fd` is readable when that is worth it.
  BoardPatternLamp(link::BoardSession& session, std::function<void()> pump, int poll_fd);

  void off() override { order({}); }
  void steady(int level_permille) override;
  void pattern(Duration bit, std::uint16_t seed) override;
  std::optional<PatternTiming> timing() const override;
  int poll_fd() const noexcept override { return poll_fd_; }
  void service() noexcept override;
  std::string trouble() const override { return trouble_; }
  Duration shortest_bit() const noexcept override;

 private:
  void order(const link::Led& led);

  link::BoardSession& session_;
  std::function<void()> pump_;
  int poll_fd_;
  std::uint32_t restarts_;
  link::Led led_{};
  std::string trouble_;
};

// The lamp of a simulated sensor: no board, no cable, and a clock that is the camera's own.

class SimulatedLamp final : public PatternLamp, public FlipPatch, public sim::LedLight {
 public:
  /// `live`: orders are carried out now, by the steady clock; else after the last instant that a
  /// picture has seen.
  explicit SimulatedLamp(bool live) : live_(live) {}

  /// Where the host's clock is at simulation time 0.
  void set_time_zero(TimePoint zero) noexcept { zero_ = zero; }

  void off() override { begin({.kind = Kind::steady, .level = 0}); }
  /// As a patch on a screen without latency.
  void show(bool white, TimePoint when) override;
  std::optional<TimePoint> shown() override { return time_of(orders_.back()); }
  void steady(int level_permille) override {
    begin({.kind = Kind::steady, .level = 1e-3 * level_permille});
  }
  void pattern(Duration bit, std::uint16_t seed) override;
  std::optional<PatternTiming> timing() const override;

  double mean(double from, double to) noexcept override;

 private:
  enum class Kind : std::uint8_t { steady, pattern };
  struct Order {
    double since = 0;  ///< simulation time, s
    Kind kind = Kind::steady;
    double level = 0;  ///< of steady, 0..1
    double bit = 0;    ///< of pattern, s
    std::uint16_t seed = 1;
  };
  double now() const noexcept;
  void begin(Order order);
  TimePoint time_of(const Order& order) const {
    return zero_ + Duration(std::llround(1e9 * order.since));
  }
  double on_time(const Order& order, double from, double to) const noexcept;

  bool live_;
  TimePoint zero_{};
  double seen_ = 0;            ///< newest instant that a picture has seen, simulation time, s
  std::vector<Order> orders_;  ///< oldest first
  std::vector<bool> bits_;     ///< of the pattern ordered last
};

}  // namespace tagwrench

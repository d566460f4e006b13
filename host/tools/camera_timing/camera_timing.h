// What a camera's pictures of a light that flashes in a known way tell about the camera: when each
// picture was really taken, and with that true frame rate, latency, jitter, read-out time,
// exposure, and frames that are stale or missing.
//
// Model: brightness of band b of picture i = dark_b + gain_b * mean of the light over the exposure
// of the band's rows (row_profile.h). Dark and gain of each band, read-out and exposure of the
// camera and the middle t_i of each exposure are fitted by least squares; a camera is taken to
// answer in proportion to light.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/tools/camera_timing/row_profile.h"

namespace tagwrench {

struct Figure {
  double value = 0;
  double sigma = 0;    ///< one standard deviation
  bool known = false;  ///< or the pictures cannot tell
};

struct ObservedFrame {
  double stamp = 0;           ///< capture time as the kernel says, host clock, s
  std::uint32_t dropped = 0;  ///< frames lost since the one before, as the driver says
  RowProfile rows;
};

struct CameraTimingInput {
  std::vector<ObservedFrame> frames;  ///< in order of arrival
  std::vector<RowBand> bands;         ///< of ObservedFrame::rows
  RowProfile dark, lit;               ///< without light, and with the light steadily on
  std::vector<double> edges;          ///< of the light, on first, host clock, s
  double bit = 0;                     ///< shortest time between edges, s
  double edge_sigma = 0;              ///< of all edges together: offset of the clocks, s
  double clock_rate_sigma = 0;        ///< of the clocks' rate against each other, relative
  double period = 0;                  ///< between frames, as announced, s
};

enum class Freshness : std::uint8_t {
  fresh,
  stale,      ///< shows what its predecessor showed
  undecided,  ///< the light was the same at both times
  strange,    ///< shows the light of no time near
};

struct TimedFrame {
  double exposed = 0;       ///< middle of the exposure of the middle row, host clock, s
  double sigma = 0;         ///< s; of its own picture alone
  std::int64_t number = 0;  ///< of the exposure since the first frame's
  Freshness freshness = Freshness::fresh;
  bool timed = false;  ///< the picture itself tells `exposed`, else it is the stamp that does
};

struct CameraTimingResult {
  std::string refusal;  ///< one line: why these pictures tell nothing. Then nothing else is filled

  Figure frame_rate;  ///< of the camera's exposures, Hz
  Figure latency;     ///< mean, from the middle of the exposure of the middle row to the stamp, s
  Figure jitter;      ///< standard deviation of latency, less that of its measurement, s
  double latency_least = 0, latency_median = 0, latency_95 = 0, latency_most = 0;  ///< s
  Figure readout;   ///< s; see ExposureTimes
  Figure exposure;  ///< s

  int frames = 0;  ///< delivered
  int timed = 0;   ///< whose picture tells when it was taken
  int stale = 0;
  int undecided = 0;  ///< stale or not cannot be told
  int strange = 0;
  int missing = 0;  ///< exposures whose picture never came, by the light
  int dropped_by_driver = 0;
  double elapsed = 0;  ///< s, between the first and the last frame
  std::vector<TimedFrame> times;

  /// Pictures per second that were new.
  double new_pictures_rate() const noexcept;
};

constexpr int kMinBandwidthFrames = 60;
constexpr double kMaxLatency = 0.5;  ///< s, that is looked for

CameraTimingResult measure_camera_timing(const CameraTimingInput& input);

/// Bit period for a camera of this frame period, both s. Some bits fall into a rolling read-out, so
/// that each picture alone tells its time; two bits are longer than most cameras' jitter, so that
/// the pattern is found at all; and frame period and bit period have no common multiple, so that
/// edges fall everywhere even in the short exposures of a global shutter.
double bit_period_for(double frame_period);

}  // namespace tagwrench

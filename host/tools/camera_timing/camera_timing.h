// What a camera's pictures of a light that flashes in a known way tell about the camera: when each
// picture was really taken, and with that true frame rate, latency, jitter, read-out time,
// exposure, and frames that are stale or missing.
//
// Model: brightness of band b of picture i = dark_b + gain_b * mean of the light over the exposure
// of the band's rows (LightSignal). Dark and gain of each band, read-out and exposure of the
// camera and the middle t_i of each exposure are fitted by least squares; a camera is taken to
// answer in proportion to light.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

// What bands of rows see of a flashing light (row_profile.cpp): in theory, of a light that is on or
// off, as a function of time, seen through exposures; and in pictures, of the pixels that the LED
// reaches and that stay within the sensor's range.

/// The part of a picture's exposure that a band of rows has: rows from the share `first` to the
/// share `last` of the picture's height (0 to 1, from the top).
struct RowBand {
  double first = 0, last = 1;
};

/// When a camera exposes one picture. Row at the share f of the height: from
/// middle + (f - 1/2) readout - exposure/2 to middle + (f - 1/2) readout + exposure/2.
struct ExposureTimes {
  double middle = 0;    ///< of the exposure of the middle row, s
  double readout = 0;   ///< from the first row to the last, s; negative: from the last to the first
  double exposure = 0;  ///< of each row, s
};

/// Mean light that a band sees, 0 to 1, and its derivatives by the three times, 1/s.
struct SeenLight {
  double mean = 0, by_middle = 0, by_readout = 0, by_exposure = 0;
};

class LightSignal {
 public:
  /// Off before the first edge, on after it, off after the second, and so on. Ascending, s.
  explicit LightSignal(std::vector<double> edges);

  SeenLight seen(const RowBand& band, const ExposureTimes& times) const noexcept;

 private:
  struct Integrals {
    double light, once, twice;  ///< signal less 1/2, its integral, and the integral of that
  };
  Integrals at(double time) const noexcept;

  std::size_t edges_until(double time) const noexcept;

  std::vector<double> edges_;
  std::vector<std::size_t> buckets_;  ///< number of the first edge in each of as many equal times
  double buckets_per_second_ = 0;
  std::vector<double> once_, twice_;  ///< at the edges
};

/// Mean grey level of each band that has pixels, top to bottom.
using RowProfile = std::vector<double>;

/// Learns which pixels to use from pictures of one scene, lit and dark; then measures.
class RowProfiler {
 public:
  static constexpr int kMaxBands = 48;

  RowProfiler(int width, int height);

  void learn_lit(const ImageView& image) { learn(image, lit_); }
  void learn_dark(const ImageView& image) { learn(image, dark_); }

  /// To be called when both are learned. Empty, or one line that says why this scene tells nothing:
  /// no LED in it, white all over, too much light from elsewhere.
  std::string choose();

  const std::vector<RowBand>& bands() const noexcept { return bands_; }
  const RowProfile& lit() const noexcept { return lit_profile_; }
  const RowProfile& dark() const noexcept { return dark_profile_; }
  double used_fraction() const noexcept { return fraction(used_count_); }  ///< of the pixels
  /// Of the pixels, when lit.
  double saturated_fraction() const noexcept { return fraction(saturated_count_); }
  /// Light that is not the LED's, over all light, of the pixels in use, 0..1.
  double ambient_fraction() const noexcept { return ambient_part_; }

  RowProfile measure(const ImageView& image) const;

 private:
  struct Sum {
    std::vector<std::uint32_t> counts;  ///< per pixel
    std::uint32_t pictures = 0;
    double mean(std::size_t pixel) const { return counts[pixel] / static_cast<double>(pictures); }
  };
  double fraction(std::size_t count) const noexcept {
    return static_cast<double>(count) / static_cast<double>(used_.size());
  }
  void learn(const ImageView& image, Sum& sum) const;
  void make_bands();

  int width_, height_;
  Sum lit_, dark_;
  std::vector<std::uint8_t> used_;  ///< per pixel, 1 or 0
  std::vector<RowBand> bands_;
  std::vector<int> first_rows_, last_rows_;  ///< of the bands; the last exclusive
  RowProfile lit_profile_, dark_profile_;
  std::size_t used_count_ = 0, saturated_count_ = 0;
  double ambient_part_ = 0;
};

// What is made of them.

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
  double new_pictures_rate() const noexcept {
    return elapsed > 0 ? (frames - 1 - stale) / elapsed : 0;
  }
};

/// 0 without any.
double quantile(const std::vector<double>& ascending, double share);

constexpr int kMinBandwidthFrames = 60;
constexpr double kMaxLatency = 0.5;  ///< s, that is looked for

CameraTimingResult measure_camera_timing(const CameraTimingInput& input);

/// Bit period for a camera of this frame period, both s. Some bits fall into a rolling read-out, so
/// that each picture alone tells its time; two bits are longer than most cameras' jitter, so that
/// the pattern is found at all; and frame period and bit period have no common multiple, so that
/// edges fall everywhere even in the short exposures of a global shutter.
double bit_period_for(double frame_period);

// The least-squares fit behind measure_camera_timing() (camera_timing_fit.cpp).

/// Of a straight line through points, each with its weight.
struct LineSums {
  double n = 0, w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void add(double at, double value, double weight = 1) noexcept {
    n += 1;
    w += weight;
    x += weight * at;
    y += weight * value;
    xx += weight * at * at;
    xy += weight * at * value;
    yy += weight * value * value;
  }
  double spread() const noexcept { return w * xx - x * x; }
  double slope() const noexcept { return (w * xy - x * y) / spread(); }
  double offset() const noexcept { return (y - slope() * x) / w; }
};

/// What is alike in all pictures. Times in s.
struct CameraTimes {
  double latency = 0;
  double jitter = 0;  ///< standard deviation
  double readout = 0, exposure = 0;
};

class CameraTimingFit {
 public:
  struct Picture {
    double time = 0;    ///< middle of its exposure, host clock, s
    double sigma = 0;   ///< s
    double cost = 0;    ///< weighted squares of its residuals, without the prior
    double margin = 0;  ///< by how much the next best time is worse
    bool good = true;   ///< shows the light of `time`
    bool alone = true;  ///< not the same picture as its predecessor's
  };

  /// Borrows the input.
  explicit CameraTimingFit(const CameraTimingInput& input);

  /// Finds latency and read-out to about a bit by correlation. False: the light is not that of the
  /// pattern.
  bool find();
  /// From there to the best fit.
  void refine();
  /// Whether rows are exposed one after the other, so that pictures tell their times.
  bool rolls() const noexcept;
  /// Takes what is alike in all pictures from elsewhere, and their times from that.
  void set_camera(const CameraTimes& camera);

  const LightSignal& light() const noexcept { return light_; }

  const CameraTimes& camera() const noexcept { return camera_; }
  const std::vector<Picture>& pictures() const noexcept { return pictures_; }
  /// Of read-out and exposure, s^2.
  const Eigen::Matrix2d& covariance() const noexcept { return covariance_; }
  /// By how much the mean of all times follows an error of read-out and of exposure.
  const Eigen::Vector2d& time_by_camera() const noexcept { return time_by_camera_; }

  /// Weighted squares of what is left of a picture if it was taken at `time`.
  double cost(std::size_t picture, double time) const noexcept;
  /// The same of its own time, and what that is off from its stamp.
  double own_cost(std::size_t picture) const noexcept {
    return pictures_[picture].cost + prior(picture, pictures_[picture].time);
  }
  /// Where the stamp says that it was taken.
  double expected(std::size_t picture) const noexcept {
    return input_.frames[picture].stamp - camera_.latency;
  }

 private:
  double prior(std::size_t picture, double time) const noexcept;
  double prior_weight(std::size_t picture, double time) const noexcept;
  ExposureTimes times(double middle) const noexcept {
    return {middle, camera_.readout, camera_.exposure};
  }
  void guess_exposure();  ///< and jitter
  void search(std::size_t picture) noexcept;
  void settle(std::size_t picture) noexcept;
  void judge() noexcept;
  void find_repeats() noexcept;
  void fit_bands() noexcept;
  void fit_delay() noexcept;
  double step() noexcept;

  const CameraTimingInput& input_;
  LightSignal light_;
  std::size_t bands_;
  CameraTimes camera_;
  std::vector<Picture> pictures_;
  std::vector<double> dark_, gain_, weight_;  ///< per band; weight is 1 / variance
  double least_noise_;                        ///< of a band's gain
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d time_by_camera_ = Eigen::Vector2d::Zero();
};

}  // namespace tagwrench

// Every stage of the data path, timed side by side in one run: medians in microseconds, and the
// ratio to the usual way, in which OpenCV detects the tags anew in every frame (default parameters,
// corners unrefined, one pose per tag, as in the paper). No assertions: numbers for people.
#include <fcntl.h>
#include <fmt/format.h>
#include <turbojpeg.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <opencv2/aruco.hpp>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/motion/shaping.h"
#include "host/output/hid_report.h"
#include "host/sensor/sensor_config.h"
#include "host/source/decode.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/acquire.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "tests/support/heap_count.h"

namespace tagwrench {
namespace {

using Clock = std::chrono::steady_clock;

double median_us(std::vector<Duration> times) {
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return static_cast<double>(middle->count()) / 1e3;
}

/// The median and the 99th percentile tell whether a stage is quick, and whether it stays quick.
double percentile99_us(std::vector<Duration> times) {
  std::sort(times.begin(), times.end());
  return static_cast<double>(times[times.size() * 99 / 100].count()) / 1e3;
}

/// The tags fill the same part of the picture whatever its size, or have the same size in pixels.
enum class Tags : std::uint8_t { scaled, same_pixels };

sim::Scenario scenario_of(int width, int height, Tags tags) {
  sim::Scenario scenario;
  const double scale =
      tags == Tags::scaled ? static_cast<double>(height) / scenario.camera.height_px : 1.0;
  scenario.camera.width_px = width;
  scenario.camera.height_px = height;
  scenario.camera.fx_px *= scale;
  scenario.camera.fy_px *= scale;
  scenario.camera.cx_px = (width - 1) / 2.0;
  scenario.camera.cy_px = (height - 1) / 2.0;
  return scenario;
}

/// Both tags at rest and 10 px around them, at the focal length of the paper's camera; in
/// proportion at another.
Region around_the_tags(const sim::Scenario& scenario) {
  constexpr double kFocal_px = 805, kWidth_px = 170, kHeight_px = 260;
  const sim::Camera& camera = scenario.camera;
  const Eigen::Vector3d& rest = scenario.target.rest_position;
  const double scale = camera.fx_px / kFocal_px;
  const double x = camera.cx_px + camera.fx_px * rest.x() / rest.z();
  const double y = camera.cy_px + camera.fy_px * rest.y() / rest.z();
  return {static_cast<int>(x - scale * kWidth_px / 2), static_cast<int>(y - scale * kHeight_px / 2),
          static_cast<int>(scale * kWidth_px), static_cast<int>(scale * kHeight_px)};
}

using Bytes = std::vector<std::uint8_t>;

/// Whether a JPEG has markers at which its parsing can begin; many webcams send them.
enum class Restarts : std::uint8_t { none, every_row };

/// A grey picture as a camera would send it.
Bytes encoded(const ImageView& grey, PixelFormat format, Restarts restarts) {
  Bytes out;
  if (format == PixelFormat::mjpg) {
    // The library takes it from the environment alone: a marker after every row of blocks.
    ::setenv("TJ_RESTART", restarts == Restarts::every_row ? "1" : "", 1);
    const std::unique_ptr<void, int (*)(tjhandle)> jpeg(tjInitCompress(), tjDestroy);
    Bytes yuv(static_cast<std::size_t>(grey.width) * grey.height * 2,
              128);  // 4:2:2, as webcams send it
    std::copy_n(grey.pixels, static_cast<std::size_t>(grey.width) * grey.height, yuv.begin());
    unsigned char* buffer = nullptr;
    unsigned long size = 0;
    tjCompressFromYUV(jpeg.get(), yuv.data(), grey.width, 1, grey.height, TJSAMP_422, &buffer,
                      &size, 85, 0);
    out.assign(buffer, buffer + size);
    tjFree(buffer);
    return out;
  }
  const std::size_t pixels = static_cast<std::size_t>(grey.width) * grey.height;
  if (format == PixelFormat::grey) return Bytes(grey.pixels, grey.pixels + pixels);
  out.resize(pixels * 2, 128);
  for (std::size_t i = 0; i < pixels; ++i) out[2 * i] = grey.pixels[i];
  return out;
}

struct Clip {
  SensorConfig sensor;
  std::vector<Bytes> frames;
  std::vector<TimePoint> times;
  Region tags;
  double render_us = 0;
};

Clip render(const sim::Scenario& scenario, PixelFormat format, Restarts restarts, int count) {
  Clip clip;
  clip.tags = around_the_tags(scenario);
  clip.sensor = parse_sensor(sim::sensor_yaml(scenario), "bench");
  SimulatorSource source(scenario, /*live=*/false);
  std::vector<Duration> times;
  for (int i = 0; i < count; ++i) {
    Frame frame;
    const TimePoint begin = Clock::now();
    source.read(frame);
    times.push_back(Clock::now() - begin);
    clip.frames.push_back(encoded(frame.image, format, restarts));
    clip.times.push_back(frame.capture_time);
  }
  clip.render_us = median_us(times);
  return clip;
}

/// One frame the usual way.
class UsualWay {
 public:
  explicit UsualWay(const SensorConfig& sensor)
      : size_(static_cast<float>(sensor.target.tag_size)),
        matrix_({sensor.camera.fx_px, 0, sensor.camera.cx_px, 0, sensor.camera.fy_px,
                 sensor.camera.cy_px, 0, 0, 1}),
        distortion_(sensor.camera.distortion.begin(), sensor.camera.distortion.end()) {}

  void track(const ImageView& image) {
    const cv::Mat grey(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
                       static_cast<std::size_t>(image.stride));
    cv::aruco::detectMarkers(grey, dictionary_, corners_, ids_);
    if (!ids_.empty()) {
      cv::aruco::estimatePoseSingleMarkers(corners_, size_, matrix_, distortion_, rotations_,
                                           translations_);
    }
  }

 private:
  cv::Ptr<cv::aruco::Dictionary> dictionary_ =
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_ARUCO_ORIGINAL);
  float size_;
  cv::Matx33d matrix_;
  std::vector<double> distortion_;
  std::vector<std::vector<cv::Point2f>> corners_;
  std::vector<int> ids_;
  std::vector<cv::Vec3d> rotations_, translations_;
};

struct DecodeCost {
  double median_us = 0;
  double allocations = 0;  ///< per frame
};

DecodeCost decode_cost(const Clip& clip, PixelFormat format, const Region& region) {
  Decoder decoder(format, clip.sensor.camera.width_px, clip.sensor.camera.height_px, 0);
  std::vector<Duration> times;
  long allocations = 0;
  for (const Bytes& bytes : clip.frames) {
    ImageView image;
    Region decoded;
    test::start_counting_allocations();
    const TimePoint begin = Clock::now();
    decoder.decode(bytes, bytes.size(), region, image, decoded);
    const TimePoint end = Clock::now();
    allocations += test::stop_counting_allocations();
    times.push_back(end - begin);
  }
  return {median_us(times), static_cast<double>(allocations) / static_cast<double>(times.size())};
}

/// A row of the second table.
std::string decode_row(const char* title, const Clip& clip, PixelFormat format) {
  const DecodeCost whole = decode_cost(clip, format, {});
  const DecodeCost part = decode_cost(clip, format, clip.tags);
  return fmt::format("{:<22} {:>4}x{:<4} {:>8.1f} {:>8.1f} {:>8.1f}x {:>9.1f} {:>9.1f}\n", title,
                     clip.tags.width, clip.tags.height, whole.median_us, part.median_us,
                     whole.median_us / part.median_us, whole.allocations, part.allocations);
}

/// Prints a row of the first table, returns one of the second.
std::string bench(const char* title, const sim::Scenario& scenario, PixelFormat format,
                  Restarts restarts, int count) {
  const Clip clip = render(scenario, format, restarts, count);
  Decoder decoder(format, scenario.camera.width_px, scenario.camera.height_px, 0);
  Decoder whole_decoder(format, scenario.camera.width_px, scenario.camera.height_px, 0);
  Acquirer acquirer(clip.sensor.camera, clip.sensor.target);
  UsualWay usual_way(clip.sensor);
  Tracker tracker(clip.sensor.camera, clip.sensor.target, clip.sensor.rest);
  WrenchEstimator estimator(clip.sensor.wrench);
  Shaping shaping(clip.sensor.shaping);
  const UniqueFd device(::open("/dev/null", O_WRONLY | O_CLOEXEC));

  std::vector<Duration> decode, acquire, usual, track, wrench, report, write, total;
  long allocations = 0;
  int held = 0;
  Counts6 last{};
  Region wanted;
  for (std::size_t i = 0; i < clip.frames.size(); ++i) {
    Frame frame;
    frame.capture_time = frame.latency_origin = clip.times[i];
    frame.sequence = i;
    test::start_counting_allocations();
    const TimePoint t0 = Clock::now();
    const Bytes& bytes = clip.frames[i];
    if (!decoder.decode(bytes, bytes.size(), wanted, frame.image, frame.decoded)) continue;
    const TimePoint t1 = Clock::now();
    Track tracked = tracker.track(frame);
    if (tracked.needs_whole_frame &&
        decoder.decode(bytes, bytes.size(), {}, frame.image, frame.decoded)) {
      tracked = tracker.track(frame);
    }
    wanted = tracked.wanted;
    const TimePoint t2 = Clock::now();
    Sample sample{
        .sequence = i, .capture_time = frame.capture_time, .latency_origin = frame.latency_origin};
    estimator.estimate(tracked, sample);
    shaping.shape(sample);
    const TimePoint t3 = Clock::now();
    const Counts6 counts = dithered(to_counts(sample.deflection, kSpacemouseLimit_counts), last);
    last = counts;
    const SpacemouseReport motion = spacemouse_report(counts);
    const WrenchReport reading = wrench_report(sample);
    const TimePoint t4 = Clock::now();
    const ssize_t written = ::write(device.get(), motion.data(), motion.size()) +
                            ::write(device.get(), reading.data(), reading.size());
    const TimePoint t5 = Clock::now();
    const long allocated = test::stop_counting_allocations();
    if (tracked.status != Status::ok || written <= 0) continue;
    ++held;
    allocations += allocated;
    decode.push_back(t1 - t0);
    track.push_back(t2 - t1);
    wrench.push_back(t3 - t2);
    report.push_back(t4 - t3);
    write.push_back(t5 - t4);
    total.push_back(t5 - t0);
    ImageView whole;
    whole_decoder.decode(bytes, bytes.size(), whole);
    const TimePoint a = Clock::now();
    acquirer.find(whole);
    const TimePoint b = Clock::now();
    usual_way.track(whole);
    usual.push_back(Clock::now() - b);
    acquire.push_back(b - a);
  }
  if (held == 0) {
    fmt::print("{:<22} the target was never held\n", title);
    return decode_row(title, clip, format);
  }
  fmt::print(
      "{:<22} {:>7.1f} {:>8.1f} {:>8.1f} {:>7.1f} {:>7.2f} {:>7.2f} {:>7.2f} {:>8.1f} {:>8.1f} "
      "{:>8.1f}x {:>7.2f} "
      "{:>8.0f}\n",
      title, median_us(decode), median_us(usual), median_us(acquire), median_us(track),
      median_us(wrench), median_us(report), median_us(write), median_us(total),
      percentile99_us(total), median_us(usual) / median_us(track),
      static_cast<double>(allocations) / held, 1e6 / clip.render_us);
  return decode_row(title, clip, format);
}

}  // namespace
}  // namespace tagwrench

int main() {
  using tagwrench::PixelFormat;
  using tagwrench::Restarts;
  using tagwrench::scenario_of;
  using tagwrench::Tags;
  cv::setNumThreads(1);
  fmt::print(
      "Medians over moving frames, us; one run, one core.\n"
      "usual = OpenCV detects the tags in every frame, unrefined, one pose each; ratio = usual / "
      "track.\n"
      "acquire = our detection, once at the start and after a loss; all to the right of it happens "
      "in every frame.\n"
      "decode = of the part that the tracker asks for; total = decode to device write.\n"
      "far = the camera sees more around tags of the same size in pixels as at 640x480; RST = "
      "with restart markers.\n\n"
      "{:<22} {:>7} {:>8} {:>8} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8} {:>9} {:>7} {:>8}\n",
      "frame", "decode", "usual", "acquire", "track", "wrench", "report", "write", "total", "p99",
      "ratio", "allocs", "sim fps");
  const struct {
    const char* title;
    int width, height;
    Tags tags;
    PixelFormat format;
    int frames;
    Restarts restarts = Restarts::none;
  } rows[] = {
      {"640x480 GREY", 640, 480, Tags::scaled, PixelFormat::grey, 300},
      {"640x480 YUYV", 640, 480, Tags::scaled, PixelFormat::yuyv, 300},
      {"640x480 MJPG", 640, 480, Tags::scaled, PixelFormat::mjpg, 300},
      {"640x480 MJPG RST", 640, 480, Tags::scaled, PixelFormat::mjpg, 300, Restarts::every_row},
      {"1920x1080 GREY", 1920, 1080, Tags::scaled, PixelFormat::grey, 100},
      {"1920x1080 YUYV", 1920, 1080, Tags::scaled, PixelFormat::yuyv, 100},
      {"1920x1080 MJPG", 1920, 1080, Tags::scaled, PixelFormat::mjpg, 100},
      {"1920x1080 GREY far", 1920, 1080, Tags::same_pixels, PixelFormat::grey, 100},
      {"1920x1080 YUYV far", 1920, 1080, Tags::same_pixels, PixelFormat::yuyv, 100},
      {"1920x1080 MJPG far", 1920, 1080, Tags::same_pixels, PixelFormat::mjpg, 100},
      {"1920x1080 MJPG RST far", 1920, 1080, Tags::same_pixels, PixelFormat::mjpg, 100,
       Restarts::every_row},
  };
  std::string decoding;
  for (const auto& row : rows) {
    decoding += tagwrench::bench(row.title, scenario_of(row.width, row.height, row.tags),
                                 row.format, row.restarts, row.frames);
  }
  fmt::print(
      "\nDecoding the whole frame, and only a region around the tags.\n\n"
      "{:<22} {:>9} {:>8} {:>8} {:>9} {:>9} {:>9}\n{}",
      "frame", "region", "whole", "region", "ratio", "allocs", "in region", decoding);
  fmt::print("\nallocs = heap allocations per frame; those of MJPG are libjpeg's own.\n");
}

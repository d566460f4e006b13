#include "tests/bench/wrench_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/recording/writer.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "tests/bench/tracker_run.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::bench {
namespace {

constexpr int kPictures = 60;
constexpr int kFrames = 300;
constexpr int kJpegQuality = 85;

constexpr std::uint32_t fourcc(const char (&name)[5]) {
  return static_cast<std::uint32_t>(name[0]) | static_cast<std::uint32_t>(name[1]) << 8 |
         static_cast<std::uint32_t>(name[2]) << 16 | static_cast<std::uint32_t>(name[3]) << 24;
}

/// A frame as the loop has it when it is through with it.
struct Done {
  std::vector<std::uint8_t> pixels;
  std::vector<std::uint8_t> jpeg;
  Frame frame;  ///< its image is not set
  Track track;
};

struct Clip {
  SourceFormat format;
  std::string sensor_yaml;
  std::vector<Done> frames;
  double track_us = 0;
};

Clip make_clip() {
  const sim::Scenario scenario = load_scenario(TAGWRENCH_SCENARIOS "/paper.yaml");
  Clip clip;
  clip.sensor_yaml = sim::sensor_yaml(scenario);
  const SensorConfig sensor = parse_sensor(clip.sensor_yaml, "the benchmark's sensor");
  SimulatorSource source(scenario, /*live=*/false);
  clip.format = source.format();
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  std::vector<double> times_us;
  for (int i = 0; i < kPictures; ++i) {
    Done done;
    source.read(done.frame);
    const double begin = thread_time_us();
    done.track = tracker.track(done.frame);
    if (i >= sensor.rest.frames) times_us.push_back(thread_time_us() - begin);
    const ImageView& image = done.frame.image;
    done.pixels.assign(image.pixels,
                       image.pixels + static_cast<std::size_t>(image.height) * image.stride);
    const cv::Mat grey(image.height, image.width, CV_8UC1, done.pixels.data());
    cv::imencode(".jpg", grey, done.jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
    clip.frames.push_back(std::move(done));
  }
  std::sort(times_us.begin(), times_us.end());
  clip.track_us = times_us.at(times_us.size() / 2);
  return clip;
}

struct Kind {
  const char* name;
  record::Keep keep;
  bool mjpg;
};

struct Cost {
  double median_us = 0, p99_us = 0;  ///< processor time of the loop's thread
  double bytes = 0;                  ///< of the file, per frame
  double per_second = 0;             ///< frames, as fast as they go
  std::uint64_t lost = 0;
  std::string trouble;
};

Cost record_clip(const Clip& clip, const Kind& kind, const std::filesystem::path& path) {
  const auto begin = std::chrono::steady_clock::now();
  record::Head head;
  head.source = clip.format.description;
  head.width = clip.format.width;
  head.height = clip.format.height;
  head.period = clip.format.period;
  head.keep = kind.keep;
  head.sensor_yaml = clip.sensor_yaml;
  record::RecordingWriter writer({.path = path, .lossless = true}, head);
  std::vector<double> times_us;
  for (int i = 0; i < kFrames; ++i) {
    const Done& done = clip.frames[static_cast<std::size_t>(i % kPictures)];
    Frame frame = done.frame;
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.capture_time = TimePoint(clip.format.period * i);
    frame.image = {done.pixels.data(), head.width, head.height, head.width};
    frame.decoded = clip.frames.back().track.wanted;
    Sample sample{.sequence = frame.sequence, .capture_time = frame.capture_time};
    sample.status = done.track.status;
    sample.displacement = done.track.displacement;
    const RawFrame raw = kind.mjpg ? RawFrame{fourcc("MJPG"), done.jpeg, 0}
                                   : RawFrame{fourcc("GREY"), done.pixels, head.width};
    const double from = thread_time_us();
    writer.frame(frame, frame.decoded, raw);
    writer.track(done.track);
    writer.sample(sample);
    times_us.push_back(thread_time_us() - from);
  }
  Cost cost;
  cost.trouble = writer.finish();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  cost.per_second = kFrames / took.count();
  cost.lost = writer.state().lost_frames + writer.state().lost_others;
  std::error_code none;
  cost.bytes = static_cast<double>(std::filesystem::file_size(path, none)) / kFrames;
  std::sort(times_us.begin(), times_us.end());
  cost.median_us = times_us[times_us.size() / 2];
  cost.p99_us = times_us[times_us.size() * 99 / 100];
  return cost;
}

}  // namespace

void bench_recording(Table& table) {
  const Clip clip = make_clip();
  const test::TemporaryFolder folder;
  table.open("recording",
             {fmt::format("{} frames with track and sample, 640x480; what the loop's thread spends "
                          "to hand a frame over,",
                          kFrames),
              fmt::format("beside tracking it ({:.0f} us); and as many as the writer's thread and "
                          "this disk take",
                          clip.track_us)});
  table.line(fmt::format("{:<30}{:>11}{:>9}{:>15}{:>12}{:>12}{:>7}", "kept", "us median", "us p99",
                         "of tracking, %", "kB a frame", "frames/s", "lost"));
  constexpr Kind kKinds[] = {{"GREY as it came", record::Keep::raw, false},
                             {"MJPG as it came", record::Keep::raw, true},
                             {"the region of the tags", record::Keep::region, false},
                             {"no pixels", record::Keep::none, false}};
  for (const Kind& kind : kKinds) {
    const Cost cost = record_clip(clip, kind, folder / fmt::format("{}.tagwrench", &kind - kKinds));
    table.line(fmt::format("{:<30}{:>11.1f}{:>9.1f}{:>15.1f}{:>12.1f}{:>12.0f}{:>7}", kind.name,
                           cost.median_us, cost.p99_us, 100 * cost.median_us / clip.track_us,
                           1e-3 * cost.bytes, cost.per_second, cost.lost));
    if (!cost.trouble.empty()) table.line(cost.trouble);
  }
}

}  // namespace tagwrench::bench

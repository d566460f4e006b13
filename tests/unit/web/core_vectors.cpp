// What the program makes of pictures and of sensor files, for tests and benchmarks that compare the
// core of web pages with it.
//
//   core_vectors sequence SCENARIO.yaml FRAMES OUT [SENSOR.yaml]    pictures of the simulated
//   sensor; described by this file
//                                                                   instead of by its own
//   core_vectors semi_real FRAMES OUT                 of the real picture, set in motion; exit
//   status 77 without it core_vectors messages DIR                         of each *.yaml in DIR
//   the line that refuses it, as JSON; "" if none does
//
// Into OUT: frames.luma, 8-bit grey, one picture after the other; vectors.json, what the tracker
// and the estimate say.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/core/os/text_file.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "tests/support/semi_real.h"

namespace tagwrench::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kSkipped = 77;

/// The next picture; false at the end.
using NextFrame = std::function<bool(Frame& frame, Vector6& truth)>;

json numbers(const Vector6& v) { return std::vector<double>(v.data(), v.data() + 6); }

json as_json(const Sample& sample, const Track& track, const Vector6& truth, double track_us) {
  return {{"t_ns", sample.capture_time.time_since_epoch().count()},
          {"status", name(sample.status)},
          {"d", numbers(sample.displacement)},
          {"d_sigma", numbers(sample.displacement_sigma)},
          {"w", numbers(sample.wrench)},
          {"w_sigma", numbers(sample.wrench_sigma)},
          {"zero", numbers(sample.zero)},
          {"tags_held", track.tags_held},
          {"hint", diagnostic_text(track.diagnostic, track.details)},
          {"truth", numbers(truth)},
          {"track_us", track_us}};
}

void write_vectors(const std::string& sensor_yaml, const SensorConfig& sensor,
                   const NextFrame& next, const fs::path& out) {
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  WrenchEstimator wrench(sensor.wrench);
  ZeroTracking zero(zero_options(sensor, wrench.tool(), true));
  fs::create_directories(out);
  std::ofstream pixels(out / "frames.luma", std::ios::binary);
  json frames = json::array();
  Frame frame;
  Vector6 truth = Vector6::Zero();
  while (next(frame, truth)) {
    for (int row = 0; row < frame.image.height; ++row) {
      pixels.write(reinterpret_cast<const char*>(frame.image.pixels + row * frame.image.stride),
                   frame.image.width);
    }
    const auto begun = std::chrono::steady_clock::now();
    const Track track = tracker.track(frame);
    Sample sample;
    sample.capture_time = frame.capture_time;
    wrench.estimate(track, sample);
    zero.follow(sample, wrench.noise(track));
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begun;
    frames.push_back(as_json(sample, track, truth, took.count()));
  }
  const json all = {{"sensor", sensor_yaml},
                    {"width", sensor.camera.width_px},
                    {"height", sensor.camera.height_px},
                    {"frames", frames}};
  std::ofstream(out / "vectors.json") << all.dump();
  if (!pixels.flush()) throw std::runtime_error("frames.luma: cannot be written");
}

int simulate(const std::string& scenario_file, int count, const fs::path& out,
             const std::string& sensor_file) {
  const sim::Scenario scenario = load_scenario(scenario_file);
  SimulatorSource source(scenario, /*live=*/false);
  int left = count;
  const NextFrame next = [&](Frame& frame, Vector6& truth) {
    if (left-- == 0 || source.read(frame) != ReadStatus::frame) return false;
    truth = source.truth().displacement;
    return true;
  };
  const std::string text =
      sensor_file.empty() ? sim::sensor_yaml(scenario) : read_text(sensor_file);
  write_vectors(text,
                sensor_file.empty() ? parse_sensor(text, "sensor.yaml") : load_sensor(sensor_file),
                next, out);
  return 0;
}

int semi_real(int count, const fs::path& out) {
  const auto file = real_picture();
  if (!file) return kSkipped;
  const SemiRealOptions options;
  const SemiReal renderer(*file, options);
  cv::Mat picture;
  int at = 0;
  const NextFrame next = [&](Frame& frame, Vector6& truth) {
    if (at == count) return false;
    truth = renderer.displacement(at);
    picture = renderer.picture(truth, static_cast<std::uint64_t>(at));
    frame.image = {picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)};
    frame.capture_time = frame.latency_origin =
        TimePoint(Duration(std::llround(1e9 * at / options.frame_rate)));
    frame.sequence = static_cast<std::uint64_t>(at++);
    return true;
  };
  const std::string text = renderer.sensor_yaml(false);
  write_vectors(text, parse_sensor(text, "sensor.yaml"), next, out);
  return 0;
}

int messages(const fs::path& folder) {
  fs::current_path(folder);
  json lines = json::object();
  for (const fs::directory_entry& entry : fs::directory_iterator(".")) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = entry.path().filename().string();
    lines[name] = "";
    try {
      parse_sensor(read_text(name), name);
    } catch (const std::exception& e) {
      lines[name] = e.what();
    }
  }
  std::cout << lines.dump() << '\n';
  return 0;
}

int program(const std::vector<std::string>& words) {
  if ((words.size() == 4 || words.size() == 5) && words[0] == "sequence")
    return simulate(words[1], std::stoi(words[2]), words[3], words.size() == 5 ? words[4] : "");
  if (words.size() == 3 && words[0] == "semi_real") return semi_real(std::stoi(words[1]), words[2]);
  if (words.size() == 2 && words[0] == "messages") return messages(words[1]);
  std::cerr
      << "usage: core_vectors sequence SCENARIO FRAMES OUT | semi_real FRAMES OUT | messages DIR\n";
  return 2;
}

}  // namespace
}  // namespace tagwrench::test

int main(int argc, char** argv) {
  try {
    return tagwrench::test::program({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    std::cerr << "core_vectors: " << e.what() << '\n';
    return 1;
  }
}

// Any text as each of the YAML files that people and the program write. It is refused in a line, or
// what was read holds.
#include <cmath>

#include "host/app/scenario_config.h"
#include "host/calibration/wrench/plan.h"
#include "host/motion/profile_config.h"
#include "host/sensor/measured_files.h"
#include "host/sensor/sensor_config.h"
#include "host/tools/design/parameters.h"
#include "tests/fuzz/memory_file.h"

namespace {

using namespace tagwrench;

SensorConfig usual_sensor() {
  return parse_sensor(
      "camera: {width: 640, height: 480, fx: 805, fy: 805, cx: 319.5, cy: 239.5}\n"
      "target: {family: aruco_original, tag_size_mm: 6, tags: [{id: 5}, {id: 2}]}\n"
      "wrench:\n  springs:\n    centres_mm: [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]\n"
      "    axial_n_per_mm: 1\n    lateral_n_per_mm: 1\n    bending_nm_per_rad: 1\n"
      "    torsion_nm_per_rad: 1\n  range_n: [1, 1, 1]\n  range_nm: [1, 1, 1]\n",
      "sensor.yaml");
}

void sensor(const std::string& text) {
  const SensorConfig read = parse_sensor(text, "sensor.yaml");
  expect(read.camera.width_px > 0 && read.camera.height_px > 0, "a camera has a size");
  expect(std::isfinite(read.camera.fx_px) && read.camera.fx_px > 0, "a focal length is a length");
  expect(!read.target.tags.empty(), "a target has tags");
  expect(read.wrench.K.allFinite(), "stiffness is finite");
  in_force(read);
}

void profile(const std::string& text) {
  static const Profile defaults = default_profile(usual_sensor());
  const Profile read = parse_profile(text, "mine.yaml", defaults);
  const Profile again = parse_profile(profile_text(read), "mine.yaml", defaults);
  expect(profile_text(again) == profile_text(read), "a profile reads back to the same");
}

void plan(const std::string& text) {
  const WrenchPlan read = parse_plan(text, "plan.yaml");
  expect(!read.steps.empty(), "a plan has steps");
  for (int step = 0; step < static_cast<int>(read.steps.size()); ++step)
    expect(!describe(read, step).empty(), "a step can be described");
}

void scenario(const std::string& text) { parse_scenario(text, "scenario.yaml"); }
void hardware(const std::string& text) { load_hardware(fuzz::MemoryFile(text).path()); }

void camera(const std::string& text) {
  const CameraFile read = read_camera_file(fuzz::MemoryFile(text).path());
  expect(read.camera.width_px > 0 && read.camera.fx_px > 0, "a camera has a size and a lens");
  camera_yaml(read, "camera");
}

void target(const std::string& text) {
  const TargetFile read = read_target_file(fuzz::MemoryFile(text).path());
  expect(read.rest.matrix().allFinite(), "a rest is a pose");
  read_target_file(fuzz::MemoryFile(target_yaml(read)).path());
}

void zero(const std::string& text) {
  expect(read_zero_file(fuzz::MemoryFile(text).path()).zero.allFinite(), "a zero is finite");
}

constexpr void (*kReaders[])(const std::string& text) = {sensor,   profile, plan,   scenario,
                                                         hardware, camera,  target, zero};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  const fuzz::Choice choice(bytes, count);
  try {
    kReaders[choice.kind % std::size(kReaders)](choice.text);
  } catch (const ConfigError& e) {
    fuzz::check_refusal(e);
  }
  return 0;
}

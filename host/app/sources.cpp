#include "host/app/sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <utility>

#include "host/app/recording_sensor.h"
#include "host/app/scenario_config.h"
#include "host/core/config_error.h"
#include "host/core/os/termination.h"
#include "host/recording/reader.h"
#include "host/source/images.h"
#include "host/source/recording.h"
#include "host/source/simulator/folder_export.h"
#include "host/source/simulator/simulator_source.h"
#include "host/source/v4l2_source.h"

namespace tagwrench {
namespace {

/// The sensor that was asked for.
bool given_sensor(const InputOptions& options, Input& input) {
  if (options.sensor.empty()) return false;
  input.sensor_name = options.sensor;
  input.sensor = load_sensor(options.sensor, options.calibration);
  return true;
}

/// One that has no file.
void built_in_sensor(std::string text, const char* name, Input& input) {
  input.sensor = parse_sensor(text, name);
  input.sensor_name = name;
  input.sensor_text = std::move(text);
}

void paper_sensor(Input& input) {
  built_in_sensor(paper_sensor_yaml(), "the built-in sensor", input);
}

Input open_simulator(const InputOptions& options, const std::string& scenario_file) {
  const sim::Scenario scenario =
      scenario_file.empty() ? sim::Scenario{} : load_scenario(scenario_file);
  Input input;
  if (!given_sensor(options, input))
    built_in_sensor(sim::sensor_yaml(scenario), "the simulated sensor", input);
  input.source = std::make_unique<SimulatorSource>(scenario, !options.fast);
  return input;
}

Input open_images(const InputOptions& options, const std::string& folder) {
  const std::filesystem::path beside = std::filesystem::path(folder) / "sensor.yaml";
  Input input;
  std::error_code unreadable;  // the source itself will complain
  if (!given_sensor(options, input)) {
    if (std::filesystem::exists(beside, unreadable)) {
      input.sensor_name = beside;
      input.sensor = load_sensor(beside, options.calibration);
    } else {
      paper_sensor(input);
    }
  }
  input.source = std::make_unique<ImagesSource>(folder, options.fast);
  return input;
}

Input open_recording(const InputOptions& options, const std::string& file) {
  auto recording = std::make_unique<record::RecordingReader>(file);
  Input input;
  if (!given_sensor(options, input)) {
    input.recorded = recording->head();
    input.sensor = recorded_sensor(recording->head(), file, options.calibration);
  }
  input.source = std::make_unique<RecordingSource>(std::move(recording), options.fast);
  return input;
}

Input open_camera(const InputOptions& options, const std::string& argument) {
  Input input;
  if (!given_sensor(options, input)) paper_sensor(input);
  V4l2Options camera = parse_v4l2_spec(argument);
  camera.preferred_width = input.sensor.camera.width_px;
  camera.preferred_height = input.sensor.camera.height_px;
  const UniqueFd caught = termination_fd();  // from here on the camera's settings must be put back
  input.source = std::make_unique<V4l2Source>(camera);
  return input;
}

constexpr std::array<SourceRow, 4> kRows = {{
    {.kind = SourceKind::simulator,
     .name = "sim",
     .argument = "SCENARIO.yaml",
     .stands_alone = true,
     .help = "the simulated sensor",
     .own_time = false,
     .open = open_simulator},
    {.kind = SourceKind::camera,
     .name = "v4l2",
     .argument = "/dev/videoN[,WxH[@FPS][,FOURCC]]",
     .stands_alone = false,
     .help = "",
     .own_time = false,
     .open = open_camera},
    {.kind = SourceKind::images,
     .name = "images",
     .argument = "DIR",
     .stands_alone = false,
     .help = "PNG, PGM or JPEG in name order, times from DIR/frames.csv",
     .own_time = true,
     .open = open_images},
    {.kind = SourceKind::recording,
     .name = "recording",
     .argument = "FILE",
     .stands_alone = false,
     .help = "what `tagwrench record` made",
     .own_time = true,
     .open = open_recording},
}};

/// "sim, sim:SCENARIO.yaml", "images:DIR"
std::string forms(const SourceRow& row, const char* separator) {
  const std::string with_argument = fmt::format("{}:{}", row.name, row.argument);
  return row.stands_alone ? row.name + (separator + with_argument) : with_argument;
}

std::string all_forms() {
  std::string text;
  for (const SourceRow& row : kRows) {
    if (!text.empty()) text += &row == &kRows.back() ? " or " : ", ";
    text += forms(row, ", ");
  }
  return text;
}

}  // namespace

std::span<const SourceRow> source_rows() { return kRows; }

SourceSpec parse_source(const std::string& text) {
  const Spec spec = split_spec(text);
  for (const SourceRow& row : kRows) {
    if (spec.kind == row.name && (row.stands_alone || !spec.argument.empty()))
      return {&row, spec.argument};
  }
  throw ConfigError(fmt::format("--source {}: not a source; use {}", text, all_forms()));
}

std::string source_help() {
  std::string text = "where frames come from:\n";
  for (const SourceRow& row : kRows) {
    const std::string head = forms(row, " | ");
    text += *row.help == 0 ? fmt::format("  {}\n", head)
                           : fmt::format("  {:<28}  {}\n", head, row.help);
  }
  return text + "Without it: a camera that sees the tags, else sim";
}

std::string source_forms(std::initializer_list<SourceKind> kinds) {
  std::string text;
  for (const SourceRow& row : kRows) {
    if (std::find(kinds.begin(), kinds.end(), row.kind) == kinds.end()) continue;
    text += (text.empty() ? "" : " | ") + forms(row, " | ");
  }
  return text;
}

}  // namespace tagwrench

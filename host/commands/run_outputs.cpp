#include "host/commands/run_outputs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/output/csv.h"
#include "host/output/gadget_output.h"
#include "host/output/joystick.h"
#include "host/output/jsonl.h"
#include "host/output/service_watch.h"
#include "host/output/spacemouse.h"
#include "host/output/terminal.h"
#include "host/output/wrench_hid.h"

namespace tagwrench {
namespace {

/// HID_UNIQ of both devices, and what clients show of them.
std::string serial_of(const std::string& sensor_name) { return "tagwrench-" + sensor_name; }

SpacemouseOptions spacemouse_options(const SensorConfig& sensor, const std::string& name) {
  SpacemouseOptions options;
  options.serial = serial_of(name);
  options.vendor = sensor.spacemouse.vendor;
  options.product = sensor.spacemouse.product;
  return options;
}

void add_device(Outputs& outputs, const std::string& kind, const SensorConfig& sensor,
                const std::string& name) {
  if (kind == "spacemouse") {
    auto device = std::make_unique<SpacemouseOutput>(spacemouse_options(sensor, name));
    device->add_to(outputs.devices);
    if (const std::string advice = device->spacenavd_advice(); !advice.empty()) log_info(advice);
    outputs.all.push_back(std::move(device));
  } else if (kind == "wrench") {
    WrenchHidOptions options;
    options.serial = serial_of(name);
    auto device = std::make_unique<WrenchHidOutput>(options);
    device->add_to(outputs.devices);
    outputs.all.push_back(std::move(device));
  } else {
    JoystickOptions options;  // uinput has no serial number: the name tells two apart
    if (name != RunOptions().name) options.name += " " + name;
    auto device = std::make_unique<JoystickOutput>(options);
    device->add_to(outputs.devices);
    outputs.all.push_back(std::move(device));
  }
}

void add_gadget(Outputs& outputs, const std::string& face, const std::string& name) {
  GadgetOptions options;
  options.name = name;
  options.face = face_of(face);
  auto gadget = std::make_unique<GadgetOutput>(find_gadget(options));
  gadget->add_to(outputs.devices);
  outputs.all.push_back(std::move(gadget));
}

void add_spnav(Outputs& outputs, const std::string& socket, const SensorConfig& sensor) {
  SpnavOptions options;
  options.socket = socket;
  options.vendor = sensor.spacemouse.vendor;
  options.product = sensor.spacemouse.product;
  auto output = std::make_unique<SpnavOutput>(options);
  log_info(output->advice());
  outputs.programs = output.get();
  outputs.all.push_back(std::move(output));
}

std::unique_ptr<Output> terminal(const Input& input, bool stdout_taken) {
  TerminalOptions options;
  options.fd = stdout_taken ? STDERR_FILENO : STDOUT_FILENO;
  const SensorConfig& sensor = input.sensor;
  options.full_scale = sensor.wrench.range.cwiseMin(sensor.shaping.full_scale * 1.5);
  options.source = input.source->format().description;
  return std::make_unique<TerminalOutput>(options);
}

/// What a user gets who asked for nothing: the view, and every device that this machine allows.
void add_default_outputs(Outputs& outputs, const Input& input, const std::string& name) {
  for (const char* kind : {"spacemouse", "wrench", "joystick"}) {
    try {
      add_device(outputs, kind, input.sensor, name);
    } catch (const ConfigError& e) {
      // Both uhid devices lack the same thing; say it once.
      if (kind != std::string("wrench"))
        log_info(fmt::format("running without {}: {}", kind, e.what()));
    }
  }
  outputs.all.push_back(terminal(input, false));
}

bool is_gadget(const Spec& spec) {
  return spec.kind == "gadget" && (spec.argument.empty() || face_of(spec.argument));
}

bool is_file(const std::string& kind) {
  return kind == "jsonl" || kind == "csv" || kind == "reference";
}

/// Refuses what cannot be, before anything is made or overwritten.
void check_outputs(const std::vector<Spec>& specs, bool with_board) {
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const Spec& spec = specs[i];
    const bool known = spec.kind == "spnav" || spec.kind == "web" || is_gadget(spec) ||
                       (spec.argument.empty() ? spec.kind == "terminal" || is_hid_device(spec)
                                              : is_file(spec.kind));
    const std::string text = spec.argument.empty() ? spec.kind : spec.kind + ":" + spec.argument;
    if (!known) {
      throw ConfigError(fmt::format(
          "--output {}: not an output; use terminal, jsonl:FILE, csv:FILE, reference:FILE, "
          "spacemouse, wrench, joystick, spnav[:PATH], web[:ADDRESS:PORT] or "
          "gadget[:spacemouse|:wrench]",
          text));
    }
    if (spec.kind == "reference" && !with_board) {
      throw ConfigError(fmt::format(
          "--output {}: the load cells are a board's; name its port with --board", text));
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (spec.kind == "web" && specs[j].kind == "web")
        throw ConfigError("--output web: is there twice; pages have one place");
      if (spec.argument.empty() ? specs[j].kind == spec.kind : specs[j].argument == spec.argument) {
        throw ConfigError(
            spec.argument == "-"
                ? "--output: only one output can go to standard output (-); give the others a file"
                : fmt::format("--output {}: is there twice; give every output a place of its own",
                              text));
      }
    }
    if (spec.argument.empty() || spec.argument == "-" || is_gadget(spec) || spec.kind == "web")
      continue;
    const std::filesystem::path path = spec.argument;
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    const bool exists = ::access(path.c_str(), F_OK) == 0;
    if (::access(exists ? path.c_str() : folder.c_str(), W_OK) != 0) {
      throw ConfigError(
          fmt::format("--output {}: cannot be written: {}; choose a file in a folder of yours",
                      text, std::strerror(errno)));
    }
  }
}

/// A board lives in real time.
void check_board(const RunOptions& options) {
  if (options.board.empty()) {
    if (!options.cells.empty())
      throw ConfigError("--cells: the load cells are a board's; name its port with --board");
    return;
  }
  if (options.fast)
    throw ConfigError("--fast: a board has its own time; leave it out, or leave out --board");
  const std::string kind = split_spec(options.source).kind;
  if (kind == "images" || kind == "recording") {
    throw ConfigError(fmt::format(
        "--source {}: these pictures are of another time than what the board says now; leave out "
        "--board",
        options.source));
  }
}

}  // namespace

bool is_hid_device(const Spec& spec) {
  return spec.kind == "spacemouse" || spec.kind == "wrench" || spec.kind == "joystick";
}

bool is_input_device(const Spec& spec) {
  return spec.kind == "spacemouse" || spec.kind == "joystick" || spec.kind == "spnav" ||
         (spec.kind == "gadget" && spec.argument != "wrench");
}

std::vector<Spec> output_specs(const RunOptions& options) {
  check_board(options);
  std::vector<Spec> specs;
  for (const std::string& text : options.outputs) specs.push_back(split_spec(text));
  check_outputs(specs, !options.board.empty());
  return specs;
}

KeptOutputs keep_outputs(Outputs& outputs) {
  KeptOutputs kept;
  for (std::unique_ptr<Output>& output : outputs.all) {
    Output* one = output.get();
    if (dynamic_cast<JsonlOutput*>(one) != nullptr || dynamic_cast<CsvOutput*>(one) != nullptr ||
        dynamic_cast<ServiceWatch*>(one) != nullptr)
      kept.push_back(std::move(output));
  }
  std::erase(outputs.all, nullptr);
  return kept;
}

Outputs open_outputs(const RunOptions& options, const Input& input, RunBoard* board,
                     KeptOutputs& kept) {
  Outputs outputs;
  if (options.outputs.empty()) {
    if (!options.record) add_default_outputs(outputs, input, options.name);
    if (board != nullptr) outputs.all.push_back(board->output(input.sensor, {}));
    return outputs;
  }
  const std::vector<Spec> specs = output_specs(options);
  for (const Spec& spec : specs) {
    if (is_hid_device(spec)) add_device(outputs, spec.kind, input.sensor, options.name);
    if (spec.kind == "gadget") add_gadget(outputs, spec.argument, options.name);
    if (spec.kind == "spnav") add_spnav(outputs, spec.argument, input.sensor);
  }
  // Only a source that waits for its reader may be made to wait.
  const bool lossless = options.fast && input.source->poll_fd() < 0;
  const bool stdout_taken = std::any_of(specs.begin(), specs.end(),
                                        [](const Spec& spec) { return spec.argument == "-"; });
  const bool again = !kept.empty();
  for (std::unique_ptr<Output>& output : kept) outputs.all.push_back(std::move(output));
  kept.clear();
  for (const Spec& spec : specs) {
    if (spec.kind == "terminal") outputs.all.push_back(terminal(input, stdout_taken));
    if (again) continue;
    if (spec.kind == "jsonl")
      outputs.all.push_back(std::make_unique<JsonlOutput>(spec.argument, lossless));
    if (spec.kind == "csv")
      outputs.all.push_back(std::make_unique<CsvOutput>(spec.argument, lossless));
  }
  if (board != nullptr) {
    const auto reference = std::find_if(specs.begin(), specs.end(),
                                        [](const Spec& spec) { return spec.kind == "reference"; });
    outputs.all.push_back(
        board->output(input.sensor, reference == specs.end() ? "" : reference->argument));
  }
  return outputs;
}

}  // namespace tagwrench

#include "host/app/outputs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "host/app/input.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/output/gadget_output.h"
#include "host/output/hid_outputs.h"
#include "host/output/line_outputs.h"
#include "host/output/terminal.h"
#include "host/output/udp.h"
#include "host/web/server/web_options.h"

namespace tagwrench {
namespace {

using Argument = const std::string&;

/// HID_UNIQ of the uhid devices, and what clients show of them.
std::string serial_of(const std::string& sensor_name) { return "tagwrench-" + sensor_name; }

template <typename Device>
OpenedOutput with_watchdog(std::unique_ptr<Device> device) {
  OpenedOutput opened;
  device->add_to(opened.devices);
  opened.output = std::move(device);
  return opened;
}

OpenedOutput open_terminal(const OutputSetup& setup, Argument) {
  TerminalOptions options;
  options.fd = setup.standard_output ? STDERR_FILENO : STDOUT_FILENO;
  const SensorConfig& sensor = setup.sensor;
  options.full_scale = sensor.wrench.range.cwiseMin(sensor.shaping.full_scale * 1.5);
  options.source = setup.source;
  return {std::make_unique<TerminalOutput>(options)};
}

template <typename File>
OpenedOutput open_file(const OutputSetup& setup, Argument path) {
  return {std::make_unique<File>(path, setup.lossless)};
}

OpenedOutput open_spacemouse(const OutputSetup& setup, Argument) {
  SpacemouseOptions options;
  options.serial = serial_of(setup.name);
  options.vendor = setup.sensor.spacemouse.vendor;
  options.product = setup.sensor.spacemouse.product;
  auto device = std::make_unique<SpacemouseOutput>(options);
  if (const std::string advice = device->spacenavd_advice(); !advice.empty()) log_info(advice);
  return with_watchdog(std::move(device));
}

OpenedOutput open_wrench(const OutputSetup& setup, Argument) {
  WrenchHidOptions options;
  options.serial = serial_of(setup.name);
  return with_watchdog(std::make_unique<WrenchHidOutput>(options));
}

OpenedOutput open_joystick(const OutputSetup& setup, Argument) {
  JoystickOptions options;  // uinput has no serial number: the name tells two apart
  if (setup.name != kUsualSensorName) options.name += " " + setup.name;
  return with_watchdog(std::make_unique<JoystickOutput>(options));
}

OpenedOutput open_spnav(const OutputSetup& setup, Argument socket) {
  SpnavOptions options;
  options.socket = socket;
  options.vendor = setup.sensor.spacemouse.vendor;
  options.product = setup.sensor.spacemouse.product;
  auto output = std::make_unique<SpnavOutput>(options);
  log_info(output->advice());
  OpenedOutput opened;
  opened.programs = output.get();
  opened.output = std::move(output);
  return opened;
}

OpenedOutput open_gadget(const OutputSetup& setup, Argument face) {
  GadgetOptions options;
  options.name = setup.name;
  options.face = face_of(face);
  return with_watchdog(std::make_unique<GadgetOutput>(find_gadget(options)));
}

bool always(Argument) { return true; }
bool as_spacemouse(Argument face) { return face_of(face) != GadgetFace::wrench; }
bool is_face(Argument face) { return face.empty() || face_of(face); }

bool is_place(Argument place) {
  parse_web("--output web", place);
  return true;
}

constexpr std::array kRows = {
    OutputRow{.kind = OutputKind::people,
              .name = "terminal",
              .help = "live view",
              .unasked = true,
              .open = open_terminal},
    OutputRow{.kind = OutputKind::data,
              .name = "jsonl",
              .argument = ":FILE",
              .help = "one line of JSON per frame, - is standard output",
              .names_file = true,
              .outlives_job = true,
              .open = open_file<JsonlOutput>},
    OutputRow{.kind = OutputKind::data,
              .name = "csv",
              .argument = ":FILE",
              .help = "one line of columns per frame, likewise",
              .names_file = true,
              .outlives_job = true,
              .open = open_file<CsvOutput>},
    OutputRow{.kind = OutputKind::device,
              .name = "spacemouse",
              .help = "virtual 6-DOF puck for CAD programs",
              .hid = true,
              .unasked = true,
              .moves = always,
              .open = open_spacemouse},
    OutputRow{.kind = OutputKind::device,
              .name = "wrench",
              .help = "HID force-torque sensor in N and N m",
              .hid = true,
              .unasked = true,
              .open = open_wrench},
    OutputRow{.kind = OutputKind::device,
              .name = "joystick",
              .help = "six-axis joystick for games",
              .hid = true,
              .unasked = true,
              .moves = always,
              .open = open_joystick},
    OutputRow{.kind = OutputKind::device,
              .name = "spnav",
              .argument = "[:PATH]",
              .help = "the socket of libspnav programs, without any device",
              .names_file = true,
              .moves = always,
              .open = open_spnav},
    OutputRow{.kind = OutputKind::pages,
              .name = "web",
              .argument = "[:ADDRESS:PORT]",
              .help = "pages for a browser: 127.0.0.1:8137",
              .accepts = is_place},
    OutputRow{.kind = OutputKind::device,
              .name = "gadget",
              .argument = "[:spacemouse|:wrench]",
              .help = "a USB device of another computer, after `tagwrench gadget up`",
              .moves = as_spacemouse,
              .accepts = is_face,
              .open = open_gadget},
    OutputRow{
        .kind = OutputKind::device,
        .name = "udp",
        .argument = ":HOST:PORT",
        .help = "opentrack's UDP over network, in cm and degrees",
        .moves = always,
        .open = [](const OutputSetup&,
                   Argument place) { return with_watchdog(std::make_unique<UdpOutput>(place)); }},
    OutputRow{.kind = OutputKind::reference,
              .name = "reference",
              .argument = ":FILE",
              .help = "as csv, beside the load cells of --board at the same time",
              .names_file = true},
};

std::string all_forms() {
  std::string text;
  for (const OutputRow& row : kRows) {
    if (!text.empty()) text += &row == &kRows.back() ? " or " : ", ";
    text += std::string(row.name) + row.argument;
  }
  return text;
}

bool fits(const OutputRow& row, const Spec& spec) {
  if (spec.kind != row.name) return false;
  const bool optional = row.argument[0] == '[';
  if (!optional && spec.argument.empty() != (row.argument[0] == 0)) return false;
  return row.accepts == nullptr || row.accepts(spec.argument);
}

OutputSpec parse_output(const std::string& text) {
  const Spec spec = split_spec(text);
  for (const OutputRow& row : kRows)
    if (fits(row, spec)) return {&row, spec.argument};
  throw ConfigError("--output {}: not an output; use {}", text, all_forms());
}

void check_both(const OutputSpec& spec, const OutputSpec& other) {
  const bool same_row = spec.row == other.row;
  if (same_row && spec.is(OutputKind::pages))
    throw ConfigError("--output web: is there twice; pages have one place");
  if (spec.argument.empty() ? !same_row : spec.argument != other.argument) return;
  throw ConfigError(
      spec.argument == "-"
          ? "--output: only one output can go to standard output (-); give the others a file"
          : fmt::format("--output {}: is there twice; give every output a place of its own",
                        spec.text()));
}

void check_file(const OutputSpec& spec) {
  if (!spec.row->names_file || spec.argument.empty() || spec.argument == "-") return;
  const std::filesystem::path path = spec.argument;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const bool exists = ::access(path.c_str(), F_OK) == 0;
  if (::access(exists ? path.c_str() : folder.c_str(), W_OK) == 0) return;
  throw ConfigError("--output {}: cannot be written: {}; choose a file in a folder of yours",
                    spec.text(), std::strerror(errno));
}

}  // namespace

std::span<const OutputRow> output_rows() { return kRows; }

std::string OutputSpec::text() const {
  return argument.empty() ? row->name : row->name + (":" + argument);
}

std::vector<OutputSpec> parse_outputs(const std::vector<std::string>& texts) {
  std::vector<OutputSpec> specs;
  for (const std::string& text : texts) {
    OutputSpec spec = parse_output(text);
    for (const OutputSpec& other : specs) check_both(spec, other);
    check_file(spec);
    specs.push_back(std::move(spec));
  }
  return specs;
}

const OutputSpec* find_output(std::span<const OutputSpec> specs, OutputKind kind) {
  const auto found = std::find_if(specs.begin(), specs.end(),
                                  [&](const OutputSpec& spec) { return spec.is(kind); });
  return found == specs.end() ? nullptr : &*found;
}

std::string output_help() {
  std::string text = "where samples go (repeat it for more than one):\n";
  for (const OutputRow& row : kRows)
    text += fmt::format("  {:<28}  {}\n", std::string(row.name) + row.argument, row.help);
  return text + "Without it: terminal, and every device that this machine allows";
}

Outputs::Outputs(const std::vector<OutputSpec>& asked, bool unasked) {
  for (const OutputSpec& spec : asked) entries_.push_back({spec});
  if (asked.empty() && unasked) {
    for (const OutputRow& row : kRows)
      if (row.unasked) entries_.push_back({{&row, {}}, false});
  }
  std::stable_partition(entries_.begin(), entries_.end(),
                        [](const Entry& entry) { return entry.spec.is(OutputKind::device); });
}

void Outputs::open(OutputSetup setup) {
  setup.standard_output = std::any_of(entries_.begin(), entries_.end(), [](const Entry& entry) {
    return entry.spec.argument == "-";
  });
  std::string last_refusal;
  for (Entry& entry : entries_) {
    const OutputRow& row = *entry.spec.row;
    if (row.open == nullptr || entry.opened.output != nullptr) continue;
    try {
      entry.opened = row.open(setup, entry.spec.argument);
    } catch (const ConfigError& e) {
      if (entry.asked) throw;
      if (last_refusal == e.what()) continue;  // unasked ones often lack the same thing
      last_refusal = e.what();
      log_info("running without {}: {}", row.name, last_refusal);
    }
  }
}

}  // namespace tagwrench

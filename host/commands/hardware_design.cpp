#include "host/commands/hardware_design.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <utility>
#include <vector>

#include "host/commands/hardware_plan.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/source/simulator/folder_export.h"
#include "host/tools/design/checks.h"
#include "host/tools/design/drawing.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

/// sensor.yaml of the simulated sensor, said to be that of one to be built.
std::string nominal_sensor(const hardware::Parameters& p) {
  std::string text = sim::sensor_yaml(runnable_scenario_of(p));
  if (text.starts_with('#')) text.erase(0, text.find('\n') + 1);
  return fmt::format(
             "# The sensor as drawn, {:g} mm from lens to tags: once it is built, `tagwrench "
             "calibrate` puts what is true into here.\n",
             1e3 * p.target.lens_distance) +
         text;
}

void tell_of_mirror(const hardware::Geometry& g) {
  if (!g.mirror) return;
  log_info(
      "design: `run` does not follow the tag in the mirror yet: sensor.yaml and the simulator have "
      "the flat tag alone, with which z and the tilts are poor");
}

/// As YAML takes any text.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
  return out + "'";
}

/// As printed, in the order of the places.
std::vector<TagPattern> patterns_of(const hardware::Parameters& p, const hardware::Geometry& g) {
  const TagFamily family = *family_from_name(p.target.family);
  std::vector<TagPattern> out;
  for (const hardware::TagPlace& tag : g.tags)
    out.push_back(tag_pattern(family, tag.id, p.target.tag_size, p.target.border));
  return out;
}

/// Throws ConfigError if something else is at `path`: somebody may have worked on it.
void check_unchanged(const std::filesystem::path& path, const std::string& text) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::symlink_status(path, error))) return;
  if (std::filesystem::is_regular_file(path, error) && read_text(path) == text) return;
  throw ConfigError(
      fmt::format("{}: is there already and holds something else (another design or a person "
                  "may have changed it); name another folder, or replace it with --force",
                  path.string()));
}

}  // namespace

int check_hardware(const std::string& file) {
  const hardware::Parameters p = load_hardware(file);
  const hardware::Geometry g = hardware::geometry(p);
  const auto complaints = hardware::complaints(p, g);
  for (const hardware::Complaint& c : complaints)
    std::cout << fmt::format("{}: {}: {}\n", file, c.parameter, c.message);
  if (!complaints.empty()) return 2;
  const Vector6 range = hardware::range(p, g);
  std::cout << fmt::format(
      "{}: can be built: {:.1f} mm high; before the stops {:.2f} {:.2f} {:.2f} N, {:.1f} {:.1f} "
      "{:.1f} mN m\n",
      file, 1e3 * (g.top - g.bottom), range[0], range[1], range[2], 1e3 * range[3], 1e3 * range[4],
      1e3 * range[5]);
  tell_of_mirror(g);
  return std::cout ? 0 : 1;
}

void export_hardware(const std::string& file, const std::string& folder, bool force) {
  namespace fs = std::filesystem;
  const hardware::Parameters p = load_buildable(file);
  const hardware::Geometry g = hardware::geometry(p);
  const fs::path into(folder);
  const std::array<std::pair<fs::path, std::string>, 4> files{{
      {into / "sensor.yaml", nominal_sensor(p)},
      {into / "plan.yaml", hardware_plan(p)},
      {into / "scenario.yaml", "# The simulated sensor, as built.\nhardware: " +
                                   quoted(fs::absolute(file).lexically_normal().string()) + "\n"},
      {into / "parameters.scad", hardware::scad_parameters(p, g, patterns_of(p, g))},
  }};
  for (const auto& [path, text] : files) {
    if (!force) check_unchanged(path, text);
  }
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw ConfigError(fmt::format("{}: cannot be made a folder ({}): choose another --export",
                                  folder, error.message()));
  }
  tell_of_mirror(g);
  for (const auto& [path, text] : files) write_atomically(path, text);
  log_info(fmt::format(
      "design: wrote parameters.scad, scenario.yaml, sensor.yaml and plan.yaml to {}", folder));
}

}  // namespace tagwrench

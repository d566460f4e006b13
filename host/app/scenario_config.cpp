#include "host/app/scenario_config.h"

#include <filesystem>

#include "host/core/yaml/yaml_reader.h"
#include "host/source/simulator/disturbances.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

/// The sensor that `hardware: FILE` names, seen from the scenario, or the published one.
sim::Scenario base_of(YamlReader& root) {
  if (!root.has("hardware")) return {};
  const auto folder = std::filesystem::path(root.file()).parent_path();
  return runnable_scenario_of(
      load_buildable((folder / root.text("hardware")).lexically_normal().string()));
}

// "camera.fx must be ..." belongs to the line of camera.fx, or of camera where fx is not there.
[[noreturn]] void fail_at_key(YamlReader root, const std::string& problem) {
  const std::string key = problem.substr(0, problem.find_first_of(" :"));
  const std::size_t dot = key.find('.');
  const std::string section = key.substr(0, dot);
  if (dot != std::string::npos && root.has(section)) {
    YamlReader child = root.child(section);
    const std::string leaf = key.substr(dot + 1);
    if (child.has(leaf)) child.fail(leaf, problem);
  }
  root.fail(section, problem);
}

sim::Scenario checked_scenario(const YamlReader& file) {
  YamlReader root = file;
  sim::Scenario scenario = base_of(root);
  sim::read_scenario(root, scenario);
  root.finish();
  const std::string problem = sim::problem(scenario);
  if (!problem.empty()) fail_at_key(file, problem);
  return scenario;
}

}  // namespace

sim::Scenario parse_scenario(const std::string& text, const std::string& name) {
  return checked_scenario(YamlReader::from_text(text, name));
}

sim::Scenario load_scenario(const std::string& path) {
  if (is_hardware(path)) return runnable_scenario_of(load_buildable(path));
  return checked_scenario(YamlReader::from_file(path));
}

}  // namespace tagwrench

#include "host/web/bridge/profile_saving.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/yaml/yaml_edit.h"
#include "host/motion/profile_config.h"
#include "host/motion/profile_files.h"
#include "host/sensor/default_profile.h"
#include "host/web/bridge/job_command.h"
#include "host/web/bridge/recording_folder.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

/// What a profile that has no file is made from.
std::string text_of_ready(const std::string& name) {
  for (const ReadyProfile& ready : ready_profiles()) {
    if (ready.name == name) return ready.text;
  }
  return "name: " + name + "\n";
}

/// Whatever their names are.
bool same_profile(Profile a, const Profile& b) {
  a.name = b.name;
  return profile_text(a) == profile_text(b);
}

/// `before` with what `text` says instead; `text` itself if it says more than can be put in there.
std::string merged(const std::string& before, const std::string& file, const std::string& text,
                   const SensorConfig& sensor) {
  const Profile defaults = default_profile(sensor);
  try {
    const Profile was = parse_profile(before, file, defaults);
    const Profile wanted = parse_profile(text, "text", defaults);
    const std::string changed = with_changes(before, file, was, wanted);
    return same_profile(parse_profile(changed, file, defaults), wanted) ? changed : text;
  } catch (const ConfigError& e) {
    throw RequestRefused(e.what());
  }
}

}  // namespace

SavedProfile save_profile(const std::string& of, const std::string& name, const std::string& text,
                          const std::string& file, const fs::path& own,
                          const SensorConfig& sensor) {
  if (!file.empty()) {
    write_atomically(file, merged(read_text(file), file, text, sensor));
    return {file, false};
  }
  if (!is_recording_name(name)) {
    throw RequestRefused(
        "name: must be 1 to 64 letters, digits, -, _ and ., beginning with a letter or digit; "
        "choose another");
  }
  std::error_code error;
  fs::create_directories(own, error);
  const fs::path target = own / (name + ".yaml");
  if (error)
    throw ConfigError(fmt::format("{}: cannot be made: {}", own.string(), error.message()));
  if (fs::exists(fs::symlink_status(target, error))) {
    throw RequestRefused(fmt::format("name: {} is there already; choose another", target.string()));
  }
  const std::string changed = merged(text_of_ready(of), target.string(), text, sensor);
  write_atomically(target, with_value(changed, {"name"}, "\"" + name + "\"", target.string()));
  return {target, true};
}

}  // namespace tagwrench

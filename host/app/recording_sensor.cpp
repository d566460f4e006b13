#include "host/app/recording_sensor.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/measured_files.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

/// The file that a key of a section names, if it is there.
std::string named_file(const std::string& name, const std::string& text, const char* section,
                       const char* key) {
  try {
    YamlReader root = YamlReader::from_text(text, name);
    if (!root.has(section)) return {};
    YamlReader node = root.child(section);
    if (!node.has(key)) return {};
    return read_text(fs::path(name).parent_path() / node.text(key));
  } catch (const ConfigError&) {
    return {};  // whoever loads the sensor has said so, if it matters
  }
}

/// The text with another file's name at that key; its comments go.
std::string naming(const std::string& yaml, const char* section, const char* key,
                   const char* file) {
  try {
    YAML::Node root = YAML::Load(yaml);
    root[section][key] = file;
    return YAML::Dump(root) + "\n";
  } catch (const YAML::Exception& e) {
    throw ConfigError(fmt::format("its sensor.yaml is no YAML: {}", e.msg));
  }
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "tagwrench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw ConfigError(fmt::format("{}: cannot be made: {}; set TMPDIR to a folder of yours", name,
                                    std::strerror(errno)));
    }
    path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

void take_sensor(const std::string& name, const std::string& text, record::Head& head) {
  head.sensor_name = name;
  head.sensor_yaml = text;
  head.appearance = named_file(name, text, "rest", "appearance");
  head.calibration = named_file(name, text, "wrench", "calibration");
  std::error_code error;
  if (!fs::is_regular_file(name, error)) return;
  for (const char* file : kMeasuredFiles) {
    if (!is_measured(measured_folder(name), file)) continue;
    head.measured.emplace_back(file, read_text(measured_folder(name) / file));
  }
}

void write_recorded_sensor(const record::Head& head, const fs::path& folder) {
  std::string yaml = head.sensor_yaml;
  if (!head.appearance.empty()) {
    // Not .png: the folder may be one of frames.
    yaml = naming(yaml, "rest", "appearance", "sensor.yaml.rest");
    write_atomically(folder / "sensor.yaml.rest", head.appearance);
  }
  if (!head.calibration.empty()) {
    yaml = naming(yaml, "wrench", "calibration", "calibration.json");
    write_atomically(folder / "calibration.json", head.calibration);
  }
  for (const char* file : kMeasuredFiles) {
    const auto its = std::find_if(head.measured.begin(), head.measured.end(),
                                  [&](const auto& named) { return named.first == file; });
    if (its == head.measured.end()) continue;
    fs::create_directory(folder / kMeasuredFolder);
    write_atomically(folder / kMeasuredFolder / file, its->second);
  }
  write_atomically(folder / "sensor.yaml", yaml);
}

SensorConfig recorded_sensor(const record::Head& head, const std::string& recording,
                             WrenchCalibration use) {
  if (head.appearance.empty() && head.calibration.empty() && head.measured.empty())
    return parse_sensor(head.sensor_yaml, recording + ": sensor.yaml", use);
  const TemporaryFolder folder;
  try {
    write_recorded_sensor(head, folder.path());
    return load_sensor(folder.path() / "sensor.yaml", use);
  } catch (const std::exception& e) {
    throw ConfigError(fmt::format(
        "{}: its sensor cannot be used: {}; give another one with --sensor", recording, e.what()));
  }
}

}  // namespace tagwrench

#include "host/app/recording.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/measured_files.h"

// Not fuzzed: of the sensor in a recording fuzz.yaml_files has the parser.

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr int kLineSeconds = 2;

std::string bytes_text(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.3g} GB", bytes / 1e9);
  return fmt::format("{:.3g} MB", bytes / 1e6);
}

std::string time_text(double seconds) {
  if (seconds >= 2 * 86400) return fmt::format("{:.0f} days", seconds / 86400);
  if (seconds >= 2 * 3600) return fmt::format("{:.0f} h", seconds / 3600);
  if (seconds >= 2 * 60) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.0f} s", seconds);
}

double in_seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

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
    throw ConfigError("its sensor.yaml is no YAML: {}", e.msg);
  }
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "tagwrench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw ConfigError("{}: cannot be made: {}; set TMPDIR to a folder of yours", name,
                        std::strerror(errno));
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

void check_recording(const RecordOptions& options, std::string_view option) {
  const fs::path path = options.file;
  std::error_code error;
  if (fs::exists(fs::symlink_status(path, error))) {
    throw ConfigError("{} {}: exists, and a recording replaces nothing; choose another name",
                      option, options.file);
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (::access(folder.c_str(), W_OK) != 0) {
    throw ConfigError("{} {}: cannot be written: {}; choose a folder of yours", option,
                      options.file, std::strerror(errno));
  }
}

record::Head recording_head(const Input& input, record::Keep keep) {
  const SourceFormat& format = input.source->format();
  record::Head head;
  head.created = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  head.software = TAGWRENCH_VERSION;
  head.source = format.description;
  head.width = format.width;
  head.height = format.height;
  head.period = format.period;
  head.keep = keep;
  if (input.recorded) {
    head.sensor_name = input.recorded->sensor_name;
    head.sensor_yaml = input.recorded->sensor_yaml;
    head.appearance = input.recorded->appearance;
    head.calibration = input.recorded->calibration;
    head.measured = input.recorded->measured;
  } else {
    const bool is_file = input.sensor_text.empty();
    take_sensor(input.sensor_name, is_file ? read_text(input.sensor_name) : input.sensor_text,
                head);
  }
  return head;
}

Recording::Recording(const RecordOptions& options, const record::Head& head, bool lossless,
                     std::optional<std::uint64_t> frames, std::optional<Duration> time)
    : FrameRecorder({.path = options.file, .lossless = lossless}, head),
      file_(options.file),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      frames_(frames),
      time_(time),
      start_(std::chrono::steady_clock::now()),
      last_line_(start_) {
  itimerspec every{};
  every.it_interval.tv_sec = every.it_value.tv_sec = kLineSeconds;
  ::timerfd_settime(timer_.get(), 0, &every, nullptr);
}

std::string_view Recording::service() noexcept {
  std::uint64_t ticks = 0;
  if (::read(timer_.get(), &ticks, sizeof ticks) <= 0) return {};
  const TimePoint now = std::chrono::steady_clock::now();
  const record::WriterState state = writer().state();
  const double elapsed = in_seconds(now - start_);
  const double rate = static_cast<double>(state.frames - last_frames_) /
                      std::max(1e-3, in_seconds(now - last_line_));
  const double speed = static_cast<double>(state.bytes) / std::max(1e-3, elapsed);
  last_frames_ = state.frames;
  last_line_ = now;
  line_ = fmt::format("recording: {:.1f} frames/s, {} dropped", rate, dropped_);
  if (state.lost_frames > 0 || state.lost_others > 0) {
    line_ += fmt::format(", {} and {} lost by a slow disk", count_text(state.lost_frames, "frame"),
                         count_text(state.lost_others, "other row"));
  }
  line_ += fmt::format(", {} at {}/s, {} left on the disk ({})",
                       bytes_text(static_cast<double>(state.bytes)), bytes_text(speed),
                       bytes_text(static_cast<double>(state.disk_free)),
                       time_text(static_cast<double>(state.disk_free) / std::max(1.0, speed)));
  if (state.fill > 0.1) line_ += fmt::format(", buffer {:.0f} % full", 100 * state.fill);
  std::optional<double> left;
  if (time_) left = in_seconds(*time_) - elapsed;
  if (frames_ && rate > 0) {
    const double of_frames =
        (static_cast<double>(*frames_) - static_cast<double>(state.frames)) / rate;
    left = left ? std::min(*left, of_frames) : of_frames;
  }
  if (left) line_ += fmt::format(", {} to go", time_text(std::max(0.0, *left)));
  return line_;
}

std::string Recording::summary() const {
  const record::WriterState state = writer().state();
  std::string line = fmt::format("{}: {}, {}", file_, count_text(state.frames, "frame"),
                                 bytes_text(static_cast<double>(state.bytes)));
  if (state.lost_frames > 0 || state.lost_others > 0) {
    line += fmt::format("; the disk was too slow for {} and {}; --keep region keeps less",
                        count_text(state.lost_frames, "frame"),
                        count_text(state.lost_others, "other row"));
  }
  return line;
}

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
    throw ConfigError("{}: its sensor cannot be used: {}; give another one with --sensor",
                      recording, e.what());
  }
}

}  // namespace tagwrench

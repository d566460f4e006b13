// Room web/wasm: the tracker and the wrench, compiled for a page.
// In:  grey pixels of a browser's camera; sensor.yaml and what was measured.
// Out: displacement (m, rad), wrench (N, N m), sigmas and status, as the program has them.
// Then: page.cpp (what it asks of the page).
//
// A sensor that a page has opened: frame -> displacement -> wrench, as the program's pipeline does
// it.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <list>
#include <map>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/core/json/json_text.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/sensor/measured_files.h"
#include "host/sensor/sensor_config.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

// Not fuzzed: the tab; of a sensor.yaml fuzz.yaml_files has the parser.

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A file in the core's own memory, where those who read files find it; gone with this object.
class MemoryFile {
 public:
  MemoryFile(const fs::path& folder, const std::string& named,
             std::span<const std::uint8_t> bytes) {
    if (named.empty() || bytes.empty()) return;
    path_ = folder / named;
    std::error_code error;
    if (path_.has_parent_path()) fs::create_directories(path_.parent_path(), error);
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  ~MemoryFile() {
    std::error_code error;
    if (!path_.empty()) fs::remove(path_, error);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

 private:
  fs::path path_;
};

/// The text at section.key, empty where there is none; what is wrong with it others say.
std::string named(const std::string& yaml, const char* section, const char* key) {
  try {
    const YAML::Node root = YAML::Load(yaml);
    const YAML::Node node = root.IsMap() ? root[section] : YAML::Node();
    const YAML::Node value = node.IsMap() ? node[key] : YAML::Node();
    return value.IsScalar() ? value.Scalar() : "";
  } catch (const YAML::Exception&) {
    return "";
  }
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

json numbers(const Vector6& v, int first) { return {v[first], v[first + 1], v[first + 2]}; }

/// 0: not known.
json known_range(Vector6 range, int first) {
  for (double& value : range) value = value < kUnknownRange ? value : 0;
  return numbers(range, first);
}

void copy(const Vector6& from, std::array<double, 6>& to) {
  std::copy(from.data(), from.data() + from.size(), to.begin());
}

}  // namespace

/// One sample as numbers, for whoever reads the core's memory: core.ts knows the places too.
struct PageSample {
  static constexpr std::size_t kMaxTags = 8;

  double status = 0;  ///< as Status counts
  std::array<double, 6> displacement{}, displacement_sigma{}, wrench{}, wrench_sigma{}, zero{};
  double zero_state = 0;  ///< as ZeroState counts
  double tags_held = 0;
  double residual_px = 0;
  double residual_fraction = 0;
  double blur_px2 = 0;
  std::array<double, 4> wanted{};  ///< x, y, width, height; zeros: all
  double needs_whole_frame = 0;
  double news = 0;  ///< 1: diagnostic() has changed
  double tags = 0;
  std::array<std::array<double, 9>, kMaxTags> tag{};  ///< id, then x, y of its corners
};

class Session {
 public:
  using Bytes = std::vector<std::uint8_t>;
  /// What goes with the sensor's text; empty: not given.
  struct Files {
    std::string calibration;                   ///< as the text names it, beside it
    std::span<const std::uint8_t> appearance;  ///< alike
    std::map<std::string, Bytes> measured;     ///< by name
  };
  /// Throws ConfigError.
  static SensorConfig read(const std::string& yaml, const std::string& name, const Files& files) {
    const fs::path beside = fs::path(name).parent_path();
    const MemoryFile calibration(beside, named(yaml, "wrench", "calibration"),
                                 bytes_of(files.calibration));
    const MemoryFile appearance(beside, named(yaml, "rest", "appearance"), files.appearance);
    if (files.measured.empty()) return parse_sensor(yaml, name);
    const fs::path folder = measured_folder(name);
    std::list<MemoryFile> measured;
    for (const auto& [file, bytes] : files.measured)
      if (std::find(kMeasuredFiles.begin(), kMeasuredFiles.end(), file) != kMeasuredFiles.end())
        measured.emplace_back(folder, file, bytes);
    return parse_sensor(yaml, name, WrenchCalibration::use, folder);
  }

  Session(const SensorConfig& sensor, std::string name)
      : sensor_(sensor),
        name_(std::move(name)),
        tracker_(sensor.camera, sensor.target, sensor.rest),
        rest_given_(tracker_.reference().known),
        wrench_(sensor.wrench),
        zero_(zero_options(sensor, wrench_.tool(), true)) {}

  /// The life of a frame, as in the pipeline.
  const PageSample& track(const Frame& frame) noexcept {
    const Track track = tracker_.track(frame);
    Sample sample;
    sample.sequence = frame.sequence;
    sample.capture_time = sample.latency_origin = frame.capture_time;
    wrench_.estimate(track, sample);
    zero_.follow(sample, wrench_.noise(track));
    fill(track, sample);
    note(track);
    return sample_;
  }
  void ask_zero() noexcept { zero_.ask(); }

  /// What the tracker noticed last, in words; empty when all is well.
  const std::string& diagnostic() const noexcept { return diagnostic_; }
  /// What there is to know about the sensor, as JSON.
  std::string description() const {
    json ids = json::array();
    for (const Tag& tag : sensor_.target.tags) ids.push_back(tag.id);
    const Vector6 range = range_through(wrench_.tool(), sensor_.wrench.range);
    const CameraModel& camera = sensor_.camera;
    return dump_json(
        json{{"camera",
              {{"width", camera.width_px},
               {"height", camera.height_px},
               {"mirrored", camera.mirrored},
               {"readout_ms", camera.readout * 1e3}}},
             {"family", name(sensor_.target.family)},
             {"tag_ids", ids},
             {"tag_size_mm", sensor_.target.tag_size * 1e3},
             {"rest_frames", sensor_.rest.frames},
             {"rest_given", rest_given_},
             {"appearance", sensor_.rest.appearance.has_value()},
             {"calibration", sensor_.calibration.empty() ? "" : sensor_.wrench_from.file},
             {"in_force", in_force(sensor_)},
             {"range_n", known_range(range, 0)},
             {"range_nm", known_range(range, 3)}});
  }
  /// What was learned at rest, as files of measured/: a JSON object of names and texts. Empty where
  /// nothing had to be learned; "null" while it is not known. `date`: YYYY-MM-DD.
  std::string learned(const std::string& date) const {
    const KnownReference& rest = tracker_.reference();
    if (!rest.known) return "null";
    json files = json::object();
    if (rest_given_) return dump_json(files);
    SensorConfig now = sensor_;
    for (std::size_t t = 0; t < now.target.tags.size(); ++t) {
      now.target.tags[t].platform_T_tag = rest.platform_T_tag[t];
      now.target.tags[t].sigma = rest.tag_sigma[t];
    }
    now.target.scale_sigma = rest.scale_sigma;
    now.rest.camera_T_platform = rest.camera_T_platform;
    now.rest.appearance.reset();
    const MeasuredStamp stamp{date, "tagwrench in a browser", fs::path(name_).filename().string()};
    files[kMeasuredTarget] = target_yaml({stamp, now.target, rest.camera_T_platform,
                                          sha256_of(now.camera), std::nullopt, std::nullopt});
    if (!now.zero.set.isZero()) {  // found at another rest: overruled
      files[kMeasuredZero] = zero_yaml({stamp, Vector6::Zero(),
                                        sha256_of(identity_of(now.camera, now.target, now.rest)),
                                        sha256_of(now.wrench)});
    }
    return dump_json(files);
  }

 private:
  /// As the pipeline says it: what was wrong is not, once the target is held.
  void note(const Track& track) noexcept {
    if (const std::string_view line = zero_text(zero_.take_answer()); !line.empty()) {
      diagnostic_ = line;
      sample_.news = 1;
    }
    if (track.status == Status::ok && trouble_shown_) {
      trouble_shown_ = false;
      diagnostic_.clear();
      sample_.news = 1;
    }
    const bool trouble = is_trouble(track.diagnostic);
    if (track.diagnostic == Diagnostic::none || (track.diagnostic == last_diagnostic_ && !trouble))
      return;
    last_diagnostic_ = track.diagnostic;
    diagnostic_ = diagnostic_text(track.diagnostic, track.details);
    trouble_shown_ = trouble_shown_ || (trouble && track.status != Status::ok);
    sample_.news = 1;
  }
  void fill(const Track& track, const Sample& sample) noexcept {
    sample_ = {};
    sample_.status = static_cast<double>(sample.status);
    copy(sample.displacement, sample_.displacement);
    copy(sample.displacement_sigma, sample_.displacement_sigma);
    copy(sample.wrench, sample_.wrench);
    copy(sample.wrench_sigma, sample_.wrench_sigma);
    copy(sample.zero, sample_.zero);
    sample_.zero_state = static_cast<double>(sample.zero_state);
    sample_.tags_held = track.tags_held;
    sample_.residual_px = track.residual_px;
    sample_.residual_fraction = track.residual_fraction;
    sample_.blur_px2 = track.blur_px2;
    const Region& wanted = track.wanted;
    sample_.wanted = {static_cast<double>(wanted.x), static_cast<double>(wanted.y),
                      static_cast<double>(wanted.width), static_cast<double>(wanted.height)};
    sample_.needs_whole_frame = track.needs_whole_frame ? 1 : 0;
    sample_.tags = track.corner_count;
    for (std::size_t t = 0; t < track.corner_count; ++t) {
      sample_.tag[t][0] = track.corners[t].id;
      std::copy(track.corners[t].px.begin(), track.corners[t].px.end(), sample_.tag[t].begin() + 1);
    }
  }

  SensorConfig sensor_;
  std::string name_;
  Tracker tracker_;
  bool rest_given_;  ///< together with the places of all tags
  WrenchEstimator wrench_;
  ZeroTracking zero_;
  PageSample sample_;
  std::string diagnostic_;
  Diagnostic last_diagnostic_ = Diagnostic::none;
  bool trouble_shown_ = false;
};

struct PageCore {
  std::unique_ptr<Session> session;
  std::string text;  ///< the last one handed out
  std::vector<std::uint8_t> pixels;
  std::map<std::string, Session::Bytes> measured;  ///< for the next sensor
};

// The core as a page calls it: plain C, numbers and texts in the core's memory. core.ts wraps it.
extern "C" {

PageCore* tagwrench_create() { return new (std::nothrow) PageCore; }

/// One of the files of measured/, for the sensor that is opened next.
void tagwrench_measured(PageCore* core, const char* name, const std::uint8_t* bytes,
                        std::size_t size) {
  core->measured[name].assign(bytes, bytes + size);
}

/// 1: open. 0: not, and tagwrench_text() says why; what was open before stays open. `calibration`
/// and `appearance` may be null.
int tagwrench_open(PageCore* core, const char* yaml, const char* name, const char* calibration,
                   const std::uint8_t* appearance, std::size_t appearance_size) {
  try {
    Session::Files files;
    if (calibration != nullptr) files.calibration = calibration;
    if (appearance != nullptr) files.appearance = {appearance, appearance_size};
    files.measured = std::exchange(core->measured, {});
    auto session = std::make_unique<Session>(Session::read(yaml, name, files), name);
    core->text = session->description();
    core->session = std::move(session);
    return 1;
  } catch (const std::exception& e) {
    core->text = e.what();
  }
  return 0;
}

/// What the last call that has a text to say said.
const char* tagwrench_text(PageCore* core) { return core->text.c_str(); }

/// Where the page puts the next frame: height rows of `stride` bytes. Null: out of memory.
std::uint8_t* tagwrench_frame(PageCore* core, int height, int stride) {
  if (height <= 0 || stride <= 0) return nullptr;
  try {
    core->pixels.resize(static_cast<std::size_t>(height) * static_cast<std::size_t>(stride));
    return core->pixels.data();
  } catch (const std::exception&) {
    return nullptr;
  }
}

/// Of the frame that lies at tagwrench_frame(). Null while nothing is open, or where the frame is
/// larger than what lies there.
const PageSample* tagwrench_track(PageCore* core, int width, int height, int stride,
                                  std::int64_t t_ns, double sequence) {
  const auto rows = static_cast<std::size_t>(std::max(0, height));
  if (!core->session || width <= 0 || stride < width ||
      rows * static_cast<std::size_t>(stride) > core->pixels.size())
    return nullptr;
  Frame frame;
  frame.image = {core->pixels.data(), width, height, stride};
  frame.capture_time = frame.latency_origin = TimePoint(std::chrono::nanoseconds(t_ns));
  frame.sequence = static_cast<std::uint64_t>(sequence);
  return &core->session->track(frame);
}

void tagwrench_zero(PageCore* core) {
  if (core->session) core->session->ask_zero();
}

const char* tagwrench_diagnostic(PageCore* core) {
  return core->session ? core->session->diagnostic().c_str() : "";
}

const char* tagwrench_learned(PageCore* core, const char* date) {
  if (!core->session) return "null";
  core->text = core->session->learned(date);
  return core->text.c_str();
}
}

}  // namespace tagwrench

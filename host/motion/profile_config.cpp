#include "host/motion/profile_config.h"

#include <fmt/format.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>

#include "host/core/config_error.h"
#include "host/core/os/remedy.h"
#include "host/core/os/text_file.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/motion/focus_watch.h"
#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr std::size_t kMaxName = 64;
constexpr double kFinestScale = 1e-6;  // N, N m
constexpr double kCoarsestScale = 1e6;
constexpr double kSlowestRate_hz = 20;
constexpr double kFastestRate_hz = 125;
constexpr int kMaxButtons = 16;  // more move the mouse pointer on Linux

const std::vector<std::string_view> kAxes = {"x", "y", "z", "rx", "ry", "rz"};
const std::vector<std::string_view> kLocks = {"none", "translation", "rotation"};
const std::vector<std::string_view> kFills = {"none", "predict"};
const std::vector<std::string_view> kFilters = {"none", "exponential", "one_euro"};

/// The gestures' keys, in the order of their actions below.
constexpr std::array<const char*, 5> kGestures = {"tap", "double_tap", "press_hold", "twist_left",
                                                  "twist_right"};
template <typename Options>
auto actions(Options& o) {
  return std::array{&o.tap, &o.double_tap, &o.press_hold, &o.twist_left, &o.twist_right};
}

bool is_force(int source) { return source < 3; }

void check_label(const YamlReader& node, const std::string& key, const std::string& text) {
  const bool printable =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
  if (text.empty() || text.size() > kMaxName || !printable)
    node.fail(key, fmt::format("must be 1 to {} printable characters", kMaxName));
}

CurveOptions read_points(YamlReader& node) {
  CurveOptions curve;
  curve.kind = CurveKind::points;
  const std::vector<std::vector<double>> points = node.points("points", 2);
  if (points.size() < 2 || points.size() > kMaxCurvePoints) {
    node.fail("points", fmt::format("has {} points; give 2 to {}, from [0, 0] to [1, ...]",
                                    points.size(), kMaxCurvePoints));
  }
  for (const std::vector<double>& point : points) {
    const CurvePoint next{point[0], point[1]};
    if (curve.count == 0 && (next.in != 0 || next.out != 0))
      node.fail("points", "must begin with [0, 0], rest");
    if (curve.count > 0) {
      const CurvePoint& last = curve.points[curve.count - 1];
      if (next.in < last.in + 1e-3 || next.out < last.out || next.out > 1) {
        node.fail("points", fmt::format("the curve goes backwards, or beyond 1, at [{}, {}]; each "
                                        "point needs a larger first number (by 0.001) and a second "
                                        "one that is not smaller than the last one's and at most 1",
                                        next.in, next.out));
      }
    }
    curve.points[curve.count++] = next;
  }
  if (curve.points[curve.count - 1].in != 1)
    node.fail("points", "must end with [1, ...], full scale");
  return curve;
}

CurveOptions read_curve(YamlReader node) {
  CurveOptions curve;
  if (node.has("power") == node.has("points"))
    node.fail("power", "give either a power, such as {power: 1.6}, or points");
  if (node.has("points")) {
    curve = read_points(node);
  } else {
    curve.power = node.within("power", 0.2, 10);
    curve.kind = curve.power == 1 ? CurveKind::linear : CurveKind::power;
  }
  node.finish();
  return curve;
}

/// Full scale and dead zone, in the unit of what the axis is fed with.
void read_scale(YamlReader& node, bool force, double& full_scale, double& dead_zone) {
  const char* const full_key = force ? "full_scale_n" : "full_scale_nm";
  const char* const dead_key = force ? "dead_zone_n" : "dead_zone_nm";
  for (const char* const wrong :
       {force ? "full_scale_nm" : "full_scale_n", force ? "dead_zone_nm" : "dead_zone_n"}) {
    if (node.has(wrong)) {
      node.fail(wrong, fmt::format("this axis is fed with a {}; use {} and {}",
                                   force ? "force" : "torque", full_key, dead_key));
    }
  }
  if (node.has(full_key)) full_scale = node.within(full_key, kFinestScale, kCoarsestScale);
  if (node.has(dead_key)) dead_zone = node.non_negative(dead_key);
  if (dead_zone >= full_scale) {
    node.fail(node.has(dead_key) ? dead_key : full_key,
              fmt::format("the dead zone, {}, must be smaller than the full scale, {}", dead_zone,
                          full_scale));
  }
}

void read_axis(YamlReader node, int i, const ShapingOptions& defaults, ShapingOptions& shaping) {
  AxisOptions& axis = shaping.axes[static_cast<std::size_t>(i)];
  if (node.has("from")) {
    axis.source = static_cast<int>(node.one_of("from", kAxes));
    shaping.full_scale[i] = defaults.full_scale[axis.source];
    shaping.dead_zone[i] = defaults.dead_zone[axis.source];
  }
  axis.invert = node.boolean_or("invert", axis.invert);
  if (node.has("limit")) axis.limit = node.within("limit", 0, 1);
  if (node.has("curve")) axis.curve = read_curve(node.child("curve"));
  read_scale(node, is_force(axis.source), shaping.full_scale[i], shaping.dead_zone[i]);
  node.finish();
}

void read_axes(YamlReader node, ShapingOptions& shaping) {
  const ShapingOptions defaults = shaping;
  for (int i = 0; i < 6; ++i) {
    const std::string name(kAxes[static_cast<std::size_t>(i)]);
    if (node.has(name)) read_axis(node.child(name), i, defaults, shaping);
  }
  node.finish();
}

FilterOptions read_filter(YamlReader node) {
  FilterOptions filter;
  filter.kind = static_cast<FilterKind>(node.one_of("kind", kFilters));
  const auto number = [&](const char* key, double& value, double lowest, double highest) {
    if (node.has(key)) value = node.within(key, lowest, highest);
  };
  if (filter.kind == FilterKind::exponential) {
    number("weight", filter.weight, 0.001, 1);
    number("at_hz", filter.weight_hz, 1, 1000);
  }
  if (filter.kind == FilterKind::one_euro) {
    number("cutoff_hz", filter.cutoff_hz, 0.01, 1000);
    number("hz_per_speed", filter.hz_per_speed, 0, 1000);
    number("speed_cutoff_hz", filter.speed_cutoff_hz, 0.01, 1000);
  }
  node.finish();
  return filter;
}

DominantOptions read_dominant(YamlReader node, DominantOptions dominant) {
  dominant.on = node.boolean_or("on", true);
  if (node.has("ratio")) dominant.ratio = node.within("ratio", 1, 10);
  node.finish();
  return dominant;
}

void read_shaping(YamlReader& root, ShapingOptions& shaping) {
  if (root.has("curve")) {
    const CurveOptions curve = read_curve(root.child("curve"));
    for (AxisOptions& axis : shaping.axes) axis.curve = curve;
  }
  if (root.has("axes")) read_axes(root.child("axes"), shaping);
  if (root.has("dead_zone_release")) shaping.release = root.within("dead_zone_release", 0, 1);
  if (root.has("noise_sigmas")) shaping.noise_sigmas = root.within("noise_sigmas", 0, 100);
  if (root.has("swing_ms")) shaping.swing = root.within("swing_ms", 0, 1000) / 1000;
  if (root.has("translation")) shaping.translation = root.within("translation", 0, 10);
  if (root.has("rotation")) shaping.rotation = root.within("rotation", 0, 10);
  if (root.has("dominant"))
    shaping.dominant = read_dominant(root.child("dominant"), shaping.dominant);
  if (root.has("lock")) shaping.lock = static_cast<Lock>(root.one_of("lock", kLocks));
  if (root.has("filter")) shaping.filter = read_filter(root.child("filter"));
  if (root.has("fill")) shaping.fill = static_cast<Fill>(root.one_of("fill", kFills));
}

std::string action_text(const GestureAction& action) {
  if (action.button >= 0) return fmt::format("button {}", action.button + 1);
  if (action.command == GestureCommand::zero) return "zero";
  return action.command == GestureCommand::next_profile ? "next_profile" : "none";
}

/// One of those that action_text() makes.
GestureAction read_action(YamlReader& node, const char* key) {
  const std::string text = node.text(key);
  std::vector<GestureAction> known = {
      {}, {-1, GestureCommand::zero}, {-1, GestureCommand::next_profile}};
  for (int button = 0; button < kMaxButtons; ++button) known.push_back({button});
  for (const GestureAction& action : known)
    if (action_text(action) == text) return action;
  node.fail(
      key,
      fmt::format("'{}' is not known; use one of: none, zero, next_profile, button 1 to button {}",
                  text, kMaxButtons));
}

void read_gestures(YamlReader node, GestureOptions& gestures) {
  const auto all = actions(gestures);
  for (std::size_t i = 0; i < all.size(); ++i)
    if (node.has(kGestures[i])) *all[i] = read_action(node, kGestures[i]);
  const auto scale = [&](const char* key, double& value) {
    if (node.has(key)) value = node.within(key, kFinestScale, kCoarsestScale);
  };
  scale("tap_force_n", gestures.tap_force);
  scale("press_force_n", gestures.press_force);
  scale("twist_torque_nm", gestures.twist_torque);
  if (node.has("press_ms"))
    gestures.press_time = std::chrono::milliseconds(node.integer("press_ms", 200, 5000));
  gestures.hold_motion = node.boolean_or("hold_motion", gestures.hold_motion);
  node.finish();
}

Profile read_profile(YamlReader root, Profile profile) {
  if (root.has("name")) {
    profile.name = root.text("name");
    check_label(root, "name", profile.name);
  }
  if (root.has("applications")) {
    profile.applications = root.texts("applications");
    for (const std::string& application : profile.applications)
      check_label(root, "applications", application);
  }
  if (root.has("rate_hz")) {
    profile.rate_hz = root.number("rate_hz");
    if (profile.rate_hz != 0)
      profile.rate_hz = root.within("rate_hz", kSlowestRate_hz, kFastestRate_hz);
  }
  read_shaping(root, profile.shaping);
  if (root.has("gestures")) read_gestures(root.child("gestures"), profile.gestures);
  root.finish();
  return profile;
}

Profile named_after(const std::string& file, Profile profile) {
  profile.name = std::filesystem::path(file).stem().string();
  return profile;
}

/// What reads back to the same number, if it was read from a file.
double milli(double seconds) { return std::round(seconds * 1e9) / 1e6; }

std::string curve_text(const CurveOptions& curve) {
  if (curve.kind != CurveKind::points) return fmt::format("{{power: {}}}", curve.power);
  std::string points;
  for (std::size_t i = 0; i < curve.count; ++i) {
    points +=
        fmt::format("{}[{}, {}]", i == 0 ? "" : ", ", curve.points[i].in, curve.points[i].out);
  }
  return fmt::format("{{points: [{}]}}", points);
}

std::string axes_text(const ShapingOptions& shaping) {
  std::string out = "axes:\n";
  for (int i = 0; i < 6; ++i) {
    const AxisOptions& axis = shaping.axes[static_cast<std::size_t>(i)];
    const char* const unit = is_force(axis.source) ? "n" : "nm";
    out += fmt::format(
        "  {}: {{from: {}, invert: {}, limit: {}, full_scale_{}: {}, dead_zone_{}: {}, curve: "
        "{}}}\n",
        kAxes[static_cast<std::size_t>(i)], kAxes[static_cast<std::size_t>(axis.source)],
        axis.invert, axis.limit, unit, shaping.full_scale[i], unit, shaping.dead_zone[i],
        curve_text(axis.curve));
  }
  return out;
}

std::string filter_text(const FilterOptions& filter) {
  if (filter.kind == FilterKind::exponential) {
    return fmt::format("{{kind: exponential, weight: {}, at_hz: {}}}", filter.weight,
                       filter.weight_hz);
  }
  if (filter.kind == FilterKind::one_euro) {
    return fmt::format("{{kind: one_euro, cutoff_hz: {}, hz_per_speed: {}, speed_cutoff_hz: {}}}",
                       filter.cutoff_hz, filter.hz_per_speed, filter.speed_cutoff_hz);
  }
  return "{kind: none}";
}

std::string dominant_text(const DominantOptions& dominant) {
  return fmt::format("{{on: {}, ratio: {}}}", dominant.on, dominant.ratio);
}

std::string_view lock_text(Lock lock) { return kLocks[static_cast<std::size_t>(lock)]; }

auto press_ms(const GestureOptions& gestures) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(gestures.press_time).count();
}

std::string gestures_text(const GestureOptions& gestures) {
  std::string out = "gestures:\n";
  const auto all = actions(gestures);
  for (std::size_t i = 0; i < all.size(); ++i)
    out += fmt::format("  {}: {}\n", kGestures[i], action_text(*all[i]));
  return out + fmt::format(
                   "  tap_force_n: {}\n  press_force_n: {}\n  twist_torque_nm: {}\n"
                   "  press_ms: {}\n  hold_motion: {}\n",
                   gestures.tap_force, gestures.press_force, gestures.twist_torque,
                   press_ms(gestures), gestures.hold_motion);
}

namespace fs = std::filesystem;

constexpr std::size_t kMaxFile = 65536;
constexpr std::size_t kMostRead = 4 * kMaxFile;  // and is then said to be too long

std::vector<std::string> yaml_files(const std::string& folder) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == ".yaml") found.push_back(entry->path());
  if (error)
    throw ConfigError(folder + ": cannot be read: " + error.message() +
                      "; give --profile a folder of yours");
  std::sort(found.begin(), found.end());
  return found;
}

bool ready_made(const std::string& name) {
  const auto& ready = ready_profiles();
  return std::any_of(ready.begin(), ready.end(),
                     [&](const ReadyProfile& profile) { return profile.name == name; });
}

}  // namespace

Profile load_profile(const std::string& name_or_file, const Profile& defaults) {
  std::string names;
  for (const ReadyProfile& ready : ready_profiles()) {
    if (ready.name == name_or_file) return parse_profile(ready.text, ready.name, defaults);
    names += (names.empty() ? "" : ", ") + ready.name;
  }
  std::error_code error;
  if (!std::filesystem::is_regular_file(name_or_file, error)) {
    throw ConfigError("{}: neither a ready-made profile ({}) nor a file; check the path",
                      name_or_file, names);
  }
  return read_profile(YamlReader::from_file(name_or_file), named_after(name_or_file, defaults));
}

Profile parse_profile(const std::string& text, const std::string& file, const Profile& defaults) {
  return read_profile(YamlReader::from_text(text, file), named_after(file, defaults));
}

std::string profile_text(const Profile& profile) {
  std::string applications;
  for (const std::string& application : profile.applications)
    applications += (applications.empty() ? "" : ", ") + yaml_quoted(application);
  const ShapingOptions& shaping = profile.shaping;
  std::string out =
      fmt::format("name: {}\napplications: [{}]\n", yaml_quoted(profile.name), applications);
  out += fmt::format("rate_hz: {}\nfill: {}\n", profile.rate_hz,
                     kFills[static_cast<std::size_t>(shaping.fill)]);
  out += axes_text(shaping);
  out += fmt::format(
      "dead_zone_release: {}\nnoise_sigmas: {}\nswing_ms: {}\ntranslation: {}\nrotation: {}\n",
      shaping.release, shaping.noise_sigmas, milli(shaping.swing), shaping.translation,
      shaping.rotation);
  out += fmt::format("dominant: {}\nlock: {}\nfilter: {}\n", dominant_text(shaping.dominant),
                     lock_text(shaping.lock), filter_text(shaping.filter));
  return out + gestures_text(profile.gestures);
}

bool serves(const Profile& profile, std::string_view application) {
  const std::string whole = lower_case(application);
  return std::any_of(
      profile.applications.begin(), profile.applications.end(),
      [&](const std::string& part) { return whole.find(lower_case(part)) != std::string::npos; });
}

ProfileFiles::ProfileFiles(const std::vector<std::string>& chosen, Profile defaults)
    : defaults_(std::move(defaults)) {
  for (const std::string& what : chosen) {
    std::error_code none;
    if (ready_made(what)) {
      profiles_.push_back(load_profile(what, defaults_));
    } else if (fs::is_directory(what, none)) {
      const std::vector<std::string> files = yaml_files(what);
      if (files.empty()) throw ConfigError(what + ": there is no profile in it (*.yaml)");
      for (const std::string& file : files) take(file);
    } else {
      profiles_.push_back(
          load_profile(what, defaults_));  // it says best what is wrong with the file
      profiles_.pop_back();
      take(what);
    }
  }
  if (profiles_.empty()) profiles_.push_back(defaults_);
  for (auto a = profiles_.begin(); a != profiles_.end(); ++a) {
    for (auto b = std::next(a); b != profiles_.end(); ++b)
      if (a->name == b->name)
        throw ConfigError("profile " + a->name + ": two have this name; change `name:` in one");
  }
  if (!files_.empty()) watch();
}

void ProfileFiles::take(const std::string& path) {
  const std::string text = read_text(path, kMaxFile);
  Profile profile = checked(text, path);
  const fs::path whole = fs::absolute(path);
  files_.push_back({whole.parent_path(), whole.filename(), std::move(text), profiles_.size()});
  profiles_.push_back(std::move(profile));
}

Profile ProfileFiles::checked(const std::string& text, const std::string& path) const {
  if (text.size() > kMaxFile)
    throw ConfigError(path + ": longer than 64 kB; a profile is a page of text");
  return parse_profile(text, path, defaults_);
}

/// Folders and not files: an editor puts a new file in the place of the old one.
void ProfileFiles::watch() {
  watch_.reset(inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  bool good = static_cast<bool>(watch_);
  int error = errno;
  for (const File& file : files_) {
    // And where a link leads to.
    const fs::path real = fs::weakly_canonical(fs::path(file.folder) / file.name).parent_path();
    for (const fs::path& folder : {fs::path(file.folder), real}) {
      if (!good) break;
      good = inotify_add_watch(watch_.get(), folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO) >= 0;
      error = errno;
    }
  }
  if (!good)
    throw ConfigError(
        "profiles: cannot be watched: {}; {}", std::strerror(error),
        remedy_for(error, "raise fs.inotify.max_user_watches, or take ready-made ones"));
}

std::vector<ProfileFiles::Change> ProfileFiles::reread() {
  std::array<char, 4096> events;
  bool any = false;
  while (::read(watch_.get(), events.data(), events.size()) > 0) any = true;
  std::vector<Change> changes;
  if (!any) return changes;
  for (File& file : files_)
    if (std::optional<Change> change = look_again(file)) changes.push_back(std::move(*change));
  return changes;
}

std::optional<ProfileFiles::Change> ProfileFiles::look_again(File& file) {
  const std::string path = file.folder + "/" + file.name;
  std::optional<std::string> text = text_of_file(path, kMostRead);
  if (!text || *text == file.text) return {};
  file.text = std::move(*text);
  try {
    profiles_[file.profile] = checked(file.text, path);
    return Change{file.profile, "profile " + profiles_[file.profile].name + ": read again"};
  } catch (const ConfigError& e) {
    return Change{{}, std::string(e.what()) + "; the earlier profile stays"};
  }
}

}  // namespace tagwrench

#include "host/motion/profile_files.h"

#include <fmt/format.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_edit.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFile = 65536;
constexpr const char* kTooLong = ": longer than 64 kB; a profile is a page of text";

/// One byte more of a file that is too long.
std::optional<std::string> read_start(const std::string& path) {
  std::error_code none;
  if (!fs::is_regular_file(path, none)) return {};  // a pipe would be waited for
  std::ifstream in(path, std::ios::binary);
  std::string text(kMaxFile + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad() || (!in.eof() && in.fail())) return {};
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

std::vector<std::string> yaml_files(const std::string& folder) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".yaml") found.push_back(entry->path());
  }
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
    for (auto b = std::next(a); b != profiles_.end(); ++b) {
      if (a->name == b->name)
        throw ConfigError("profile " + a->name + ": two have this name; change `name:` in one");
    }
  }
  if (!files_.empty()) watch();
}

void ProfileFiles::take(const std::string& path) {
  const std::optional<std::string> text = read_start(path);
  if (!text) throw ConfigError(path + ": cannot be read; give --profile a file of yours");
  if (text->size() > kMaxFile) throw ConfigError(path + kTooLong);
  const fs::path whole = fs::absolute(path);
  files_.push_back({whole.parent_path(), whole.filename(), *text, profiles_.size()});
  profiles_.push_back(parse_profile(*text, path, defaults_));
}

/// Folders and not files: an editor puts a new file in the place of the old one.
void ProfileFiles::watch() {
  watch_.reset(inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  bool good = static_cast<bool>(watch_);
  for (const File& file : files_) {
    // And where a link leads to.
    const fs::path real = fs::weakly_canonical(fs::path(file.folder) / file.name).parent_path();
    for (const fs::path& folder : {fs::path(file.folder), real}) {
      good = good &&
             inotify_add_watch(watch_.get(), folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO) >= 0;
    }
  }
  if (!good)
    throw ConfigError(std::string("profiles: cannot be watched: ") + std::strerror(errno) +
                      "; raise fs.inotify.max_user_watches, or take ready-made ones");
}

std::string ProfileFiles::file_of(std::size_t profile) const {
  for (const File& file : files_) {
    if (file.profile == profile) return file.folder + "/" + file.name;
  }
  return {};
}

Profile ProfileFiles::parse(const std::string& text, std::size_t profile) const {
  const std::string file = file_of(profile);
  return parse_profile(text, file.empty() ? profiles_[profile].name : file, defaults_);
}

std::vector<ProfileFiles::Change> ProfileFiles::reread() {
  std::array<char, 4096> events;
  bool any = false;
  while (::read(watch_.get(), events.data(), events.size()) > 0) any = true;
  std::vector<Change> changes;
  if (!any) return changes;
  for (File& file : files_) {
    if (std::optional<Change> change = look_again(file)) changes.push_back(std::move(*change));
  }
  return changes;
}

std::optional<ProfileFiles::Change> ProfileFiles::look_again(File& file) {
  const std::string path = file.folder + "/" + file.name;
  std::optional<std::string> text = read_start(path);
  if (!text || *text == file.text) return {};
  file.text = std::move(*text);
  try {
    if (file.text.size() > kMaxFile) throw ConfigError(path + kTooLong);
    Profile read = parse_profile(file.text, path, defaults_);
    profiles_[file.profile] = std::move(read);
    return Change{file.profile, "profile " + profiles_[file.profile].name + ": read again"};
  } catch (const ConfigError& e) {
    return Change{{}, std::string(e.what()) + "; the earlier profile stays"};
  }
}

namespace {

constexpr std::array<const char*, 6> kAxisKeys = {"x", "y", "z", "rx", "ry", "rz"};

bool force_feeds(const Profile& profile, std::size_t axis) {
  return profile.shaping.axes[axis].source < 3;
}

/// Where a key of the profile's text stands, and what it says.
struct TextEdit {
  std::vector<std::string> path;
  std::string value;
};

void edit_number(std::vector<TextEdit>& edits, std::vector<std::string> path, double before,
                 double after) {
  if (before != after) edits.push_back({std::move(path), fmt::format("{}", after)});
}

void edit_axis(std::vector<TextEdit>& edits, std::size_t i, const Profile& before,
               const Profile& after) {
  const std::string unit = force_feeds(after, i) ? "n" : "nm";
  const auto axis = static_cast<Eigen::Index>(i);
  const ShapingOptions& was = before.shaping;
  const ShapingOptions& is = after.shaping;
  edit_number(edits, {"axes", kAxisKeys[i], "full_scale_" + unit}, was.full_scale[axis],
              is.full_scale[axis]);
  edit_number(edits, {"axes", kAxisKeys[i], "dead_zone_" + unit}, was.dead_zone[axis],
              is.dead_zone[axis]);
  if (was.axes[i].invert != is.axes[i].invert)
    edits.push_back({{"axes", kAxisKeys[i], "invert"}, fmt::format("{}", is.axes[i].invert)});
}

std::string filter_value(const FilterOptions& filter) {
  switch (filter.kind) {
    case FilterKind::one_euro:
      return fmt::format("{{kind: one_euro, cutoff_hz: {}, hz_per_speed: {}, speed_cutoff_hz: {}}}",
                         filter.cutoff_hz, filter.hz_per_speed, filter.speed_cutoff_hz);
    case FilterKind::exponential:
      return fmt::format("{{kind: exponential, weight: {}, at_hz: {}}}", filter.weight,
                         filter.weight_hz);
    case FilterKind::none:
      break;
  }
  return "{kind: none}";
}

std::vector<TextEdit> edits_between(const Profile& before, const Profile& after) {
  std::vector<TextEdit> edits;
  const ShapingOptions& was = before.shaping;
  const ShapingOptions& is = after.shaping;
  edit_number(edits, {"translation"}, was.translation, is.translation);
  edit_number(edits, {"rotation"}, was.rotation, is.rotation);
  if (was.axes[0].curve != is.axes[0].curve)
    edits.push_back({{"curve"}, fmt::format("{{power: {}}}", is.axes[0].curve.power)});
  if (was.dominant != is.dominant)
    edits.push_back(
        {{"dominant"}, fmt::format("{{on: {}, ratio: {}}}", is.dominant.on, is.dominant.ratio)});
  constexpr std::array<const char*, 3> kLocks = {"none", "translation", "rotation"};
  if (was.lock != is.lock) edits.push_back({{"lock"}, kLocks[static_cast<std::size_t>(is.lock)]});
  if (was.filter != is.filter) edits.push_back({{"filter"}, filter_value(is.filter)});
  for (std::size_t i = 0; i < kAxisKeys.size(); ++i) edit_axis(edits, i, before, after);
  const GestureOptions& gestures = after.gestures;
  edit_number(edits, {"gestures", "tap_force_n"}, before.gestures.tap_force, gestures.tap_force);
  edit_number(edits, {"gestures", "press_force_n"}, before.gestures.press_force,
              gestures.press_force);
  edit_number(edits, {"gestures", "twist_torque_nm"}, before.gestures.twist_torque,
              gestures.twist_torque);
  if (before.gestures.press_time != gestures.press_time)
    edits.push_back(
        {{"gestures", "press_ms"},
         fmt::format(
             "{}",
             std::chrono::duration_cast<std::chrono::milliseconds>(gestures.press_time).count())});
  return edits;
}

}  // namespace

std::string with_changes(const std::string& text, const std::string& file, const Profile& before,
                         const Profile& after) {
  std::string changed = text;
  for (const TextEdit& edit : edits_between(before, after))
    changed = with_value(changed, edit.path, edit.value, file);
  return changed;
}

}  // namespace tagwrench

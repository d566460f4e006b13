#include "host/motion/profile_files.h"

#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "host/core/config_error.h"

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

}  // namespace tagwrench

// Profiles, ready-made or on disk; those on disk are read again when somebody saves them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/motion/profile_config.h"

namespace tagwrench {

class ProfileFiles {
 public:
  /// `chosen`: names of ready-made profiles, files, and folders of *.yaml, which come in the order
  /// of their names. None: what the sensor itself says. Throws ConfigError: there is no such
  /// profile, two have one name, or the first fault in a file.
  ProfileFiles(const std::vector<std::string>& chosen, Profile defaults);

  /// At least one.
  const std::vector<Profile>& profiles() const noexcept { return profiles_; }
  /// Where a profile is on disk; empty if it is not.
  std::string file_of(std::size_t profile) const;
  /// What a text says that would stand in a profile's place. Throws ConfigError: the first fault.
  Profile parse(const std::string& text, std::size_t profile) const;
  /// Until its file is saved again.
  void replace(std::size_t profile, Profile by) { profiles_[profile] = std::move(by); }

  /// Readable when a file may have changed; -1: none is on disk.
  int fd() const noexcept { return watch_.get(); }

  struct Change {
    std::optional<std::size_t>
        profile;       ///< that is new; none: the file is wrong, the earlier stays
    std::string line;  ///< for people
  };
  /// Reads again what has changed, if fd() is readable. A file that is gone leaves what it said.
  std::vector<Change> reread();

 private:
  struct File {
    std::string folder;
    std::string name;
    std::string text;  ///< as it was read last
    std::size_t profile = 0;
  };
  void take(const std::string& path);
  void watch();
  std::optional<Change> look_again(File& file);

  Profile defaults_;
  std::vector<Profile> profiles_;
  std::vector<File> files_;
  UniqueFd watch_;
};

// What has changed of a profile, written into its text.

/// The text of `before` with what differs in `after` written into it: comments and all else stay.
/// Throws ConfigError, naming `file`, if the text is no YAML mapping.
std::string with_changes(const std::string& text, const std::string& file, const Profile& before,
                         const Profile& after);

}  // namespace tagwrench

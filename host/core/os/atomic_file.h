// Files that are replaced as a whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

/// Throws ConfigError unless `path` (or what it links to) is a regular file that may be replaced,
/// or a new name in a folder that can be written.
void check_replaceable(const std::filesystem::path& path);

/// Throws ConfigError if there is a symbolic link at the path, neither one's own nor root's.
void refuse_foreign_link(const std::filesystem::path& path);

/// What is to stand at a path, written beside it under a name that nobody can foresee: a reader
/// sees the old file or the new one, never a part, and a link that somebody has put there leads
/// nowhere. What writers of the same path left that were killed is removed first.
class NewFile {
 public:
  /// Whether a file that is there already gives way.
  enum class Existing : std::uint8_t { replaced, refused };

  /// Follows a symbolic link at `path`, unless it is another user's. Throws ConfigError: it is,
  /// something else than a file is there (/dev/null, say), or the folder takes no file.
  explicit NewFile(const std::filesystem::path& path);
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;
  /// What has not taken its name is gone.
  ~NewFile();

  /// Throws std::runtime_error: no room, say.
  void write(std::string_view bytes);
  void write(const void* bytes, std::size_t size) {
    write({static_cast<const char*>(bytes), size});
  }
  /// On disk, with the mode of the file of one's own that it replaces, or as the umask has it. The
  /// folder too. Throws std::runtime_error, and leaves what was there: no room, or it is refused.
  void take_the_name(Existing existing = Existing::replaced);
  /// Where it stands until then.
  const std::filesystem::path& temporary() const noexcept { return name_; }

 private:
  void keep_mode_of_target();

  std::filesystem::path target_;
  std::filesystem::path name_;  ///< empty: it has taken its name
  UniqueFd file_;
};

/// A folder of files that is to stand at a path, made as NewFile makes a file.
class NewFolder {
 public:
  /// Throws ConfigError if there can be no folder.
  explicit NewFolder(const std::filesystem::path& path);
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  /// What has not taken its name is gone, with all that is in it.
  ~NewFolder();

  /// A file that was not in it. Throws std::runtime_error: no room, say.
  void add(const std::string& name, std::string_view text,
           std::span<const std::uint8_t> bytes = {});
  /// Nothing, or an empty folder, gives way. Throws std::runtime_error.
  void take_the_name();
  const std::filesystem::path& temporary() const noexcept { return name_; }

 private:
  std::filesystem::path target_;
  std::filesystem::path name_;
  UniqueFd folder_;  ///< holds the lock
};

/// Replaces the file as a whole. Keeps the permissions. Throws ConfigError if the folder takes no
/// file, std::runtime_error if writing fails later, and leaves the old file.
void write_atomically(const std::filesystem::path& path, std::string_view text);

/// So that a name in the folder that has come or gone is so after a power cut, too.
void sync_folder_of(const std::filesystem::path& path) noexcept;

}  // namespace tagwrench

#include <fmt/format.h>

#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/sha256.h"
#include "host/sensor/appearance_file.h"
#include "host/sensor/measured_files.h"

namespace tagwrench {

namespace fs = std::filesystem;

void check_measurable(const fs::path& folder, const std::vector<const char*>& files) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) {
    check_replaceable(folder);  // a new name in a folder that can be written
    return;
  }
  if (!fs::is_directory(folder, error)) {
    throw ConfigError(fmt::format(
        "{}: is no folder, and what is measured goes there; move it elsewhere", folder.string()));
  }
  for (const char* file : files) {
    check_replaceable(folder / file);
    check_replaceable(folder / (std::string(file) + kBefore));
  }
}

void write_measured(const fs::path& file, std::string_view text) {
  std::error_code error;
  fs::create_directory(file.parent_path(), error);  // whoever writes below says what is wrong
  if (fs::exists(file, error)) write_atomically(fs::path(file) += kBefore, read_text(file));
  write_atomically(file, text);
}

void write_measured_target(const fs::path& folder, TargetFile target,
                           const ReferenceImage& picture) {
  const std::string bytes = encode_reference_image(picture);
  target.picture = {kMeasuredPicture, sha256_hex(bytes), picture.frames};
  std::error_code error;
  fs::create_directory(folder, error);
  // The picture before may be the one in force, where an earlier measurement ended in between.
  const fs::path file = folder / kMeasuredPicture;
  std::string in_force;
  try {
    if (const auto named = read_target_file(folder / kMeasuredTarget).picture)
      in_force = named->sha256;
  } catch (const ConfigError&) {  // nothing is in force that could get lost
  }
  const std::string old = fs::exists(file, error) ? read_text(file) : std::string();
  if (!old.empty() && sha256_hex(old) == in_force) write_atomically(fs::path(file) += kBefore, old);
  write_atomically(file, bytes);
  write_measured(folder / kMeasuredTarget, target_yaml(target));
}

void set_aside(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return;
  fs::rename(file, fs::path(file) += kBefore, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: cannot be renamed ({}); remove it yourself",
                                         file.string(), error.message()));
  }
}

}  // namespace tagwrench

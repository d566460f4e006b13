// Pictures of a recording, for images:DIR.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "host/app/recording_sensor.h"
#include "host/commands/export_command.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/log.h"
#include "host/source/recording.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFrames = 1'000'000;  // names have six digits

struct Picture {
  const char* extension;
  std::string header;  ///< before the bytes
  std::vector<std::uint8_t> bytes;
};

/// A file as it was, or the luminance that was decoded, with nothing where there is none.
Picture picture_of(const RawFrame& raw, const Frame& frame) {
  if (raw.fourcc == fourcc("MJPG") || raw.fourcc == fourcc("PNG ") ||
      raw.fourcc == fourcc("PGM ")) {
    const char* extension = raw.fourcc == fourcc("MJPG")   ? ".jpg"
                            : raw.fourcc == fourcc("PNG ") ? ".png"
                                                           : ".pgm";
    return {extension, {}, {raw.bytes.begin(), raw.bytes.end()}};
  }
  const ImageView& image = frame.image;
  const Region part = frame.readable();
  Picture picture{".pgm", fmt::format("P5\n{} {}\n255\n", image.width, image.height), {}};
  picture.bytes.resize(static_cast<std::size_t>(image.width) *
                       static_cast<std::size_t>(image.height));
  for (int y = part.y; y < part.y + part.height; ++y) {
    std::copy_n(image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride + part.x, part.width,
                picture.bytes.begin() + static_cast<std::ptrdiff_t>(y) * image.width + part.x);
  }
  return picture;
}

void write(const fs::path& path, const std::string& header, const std::uint8_t* bytes,
           std::size_t count) {
  std::ofstream file(path, std::ios::binary);
  file << header;
  file.write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(count));
  file.close();
  if (!file) {
    throw std::runtime_error(
        fmt::format("{}: cannot be written; free some space on the disk", path.string()));
  }
}

/// Beside its final place until all is there.
class PartialFolder {
 public:
  explicit PartialFolder(const fs::path& final_place) : final_(final_place) {
    std::error_code error;
    if (fs::exists(final_, error) &&
        !(fs::is_directory(final_, error) && fs::is_empty(final_, error))) {
      throw ConfigError(
          fmt::format("{}: exists; give --frames an empty or a new folder", final_.string()));
    }
    std::string name = final_.string() + ".partial-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) {
      throw ConfigError(fmt::format("{}: cannot be made: {}; give --frames a folder of yours",
                                    final_.string(), std::strerror(errno)));
    }
    path_ = name;
    fs::permissions(path_, fs::perms(0755), error);
  }
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;
  ~PartialFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }
  void finish() {
    fs::rename(path_, final_);
    path_.clear();
  }

 private:
  fs::path final_;
  fs::path path_;
};

/// "build/frames/" has no name that ".partial" could be put behind.
fs::path without_slash(const std::string& folder) {
  const fs::path path = fs::path(folder).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

void export_frames(const std::string& recording, const std::string& folder) {
  RecordingSource source(std::make_unique<record::RecordingReader>(recording), /*fast=*/true);
  const record::Head& head = source.recording().head();
  PartialFolder partial(without_slash(folder));
  std::string times = "file,t_ns\n";
  std::size_t count = 0;
  Frame frame;
  for (ReadStatus status; (status = source.read(frame)) != ReadStatus::end;) {
    if (status != ReadStatus::frame) continue;
    if (count == kMaxFrames)
      throw ConfigError(fmt::format("{}: has more than {} frames", recording, kMaxFrames));
    source.complete(frame);
    const Picture picture = picture_of(source.raw(), frame);
    const std::string name = fmt::format("{:06}{}", count++, picture.extension);
    write(partial.path() / name, picture.header, picture.bytes.data(), picture.bytes.size());
    times += fmt::format("{},{}\n", name, frame.capture_time.time_since_epoch().count());
  }
  write(partial.path() / "frames.csv", times, nullptr, 0);
  write_recorded_sensor(head, partial.path());
  partial.finish();
  log_info(
      fmt::format("{} in {}{}", count_text(static_cast<std::uint64_t>(count), "frame"), folder,
                  head.keep == record::Keep::region
                      ? ", black where nothing was kept: replay the recording itself for samples"
                      : ""));
  if (const std::string unusable = source.unusable(); !unusable.empty()) log_info(unusable);
}

}  // namespace tagwrench

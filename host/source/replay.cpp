#include "host/source/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <unordered_map>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/text_file.h"
#include "host/core/os/timer.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

/// What a file holds is shown in a message: short and printable.
std::string shown(std::string_view text) {
  std::string out(text.substr(0, 40));
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < ' ' || c > 126; }, '?');
  return out;
}

std::optional<std::int64_t> nanoseconds(std::string_view text) {
  const auto value = parse_whole<std::int64_t>(text);
  // Half the range: differences and sums with a present time must not overflow.
  return value && *value >= 0 && *value <= INT64_MAX / 2 ? value : std::nullopt;
}

struct FrameTime {
  std::int64_t t_ns = 0;
  std::size_t line = 0;
};

using Entries = std::unordered_map<std::string_view, std::optional<FrameTime>>;

void take_line(std::string_view line, std::size_t number, const std::string& source,
               Entries& entries) {
  const auto comma = line.find(',');
  const auto time =
      comma == std::string_view::npos ? std::nullopt : nanoseconds(line.substr(comma + 1));
  if (!time) {
    throw ConfigError(
        "{}:{}: '{}' is not file,t_ns with t_ns in whole nanoseconds; correct the line", source,
        number, shown(line));
  }
  const auto entry = entries.find(line.substr(0, comma));
  if (entry == entries.end()) {
    throw ConfigError(
        "{}:{}: there is no picture '{}' in the folder; remove the line or add the file", source,
        number, shown(line.substr(0, comma)));
  }
  if (entry->second) {
    throw ConfigError("{}:{}: '{}' was already on line {}; remove one of them", source, number,
                      shown(entry->first), entry->second->line);
  }
  entry->second = FrameTime{*time, number};
}

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr Duration kDefaultPeriod = 40ms;
constexpr std::size_t kHeaderBytes = 256 * 1024;  ///< a JPEG may carry a thumbnail before its size
constexpr std::streamoff kMaxFileBytes = 512LL << 20;

bool is_picture(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".pgm" || extension == ".jpg" || extension == ".jpeg";
}

std::vector<std::string> picture_names(const std::string& dir) {
  std::error_code error;
  if (!fs::is_directory(dir, error))
    throw ConfigError("images:{}: no such folder; give one that holds PNG, PGM or JPEG files", dir);
  std::vector<std::string> names;
  fs::directory_iterator it(dir, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error))
    if (is_picture(it->path()) && it->is_regular_file(error))
      names.push_back(it->path().filename().string());
  if (error)
    throw ConfigError("images:{}: cannot be read: {}; check its permissions", dir, error.message());
  if (names.empty())
    throw ConfigError("images:{}: holds no PNG, PGM or JPEG file; give another folder", dir);
  std::sort(names.begin(), names.end());
  return names;
}

/// Empty: the header cannot be read.
std::optional<ImageSize> size_of(const std::string& path, std::vector<char>& scratch) {
  std::ifstream file(path, std::ios::binary);
  scratch.resize(kHeaderBytes);
  file.read(scratch.data(), static_cast<std::streamsize>(scratch.size()));
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(scratch.data());
  return image_size({bytes, static_cast<std::size_t>(file.gcount())});
}

ImageSize size_of_all(const std::vector<OddPicture>& pictures) {
  const OddPicture& first = pictures.front();
  for (const OddPicture& picture : pictures) {
    if (!picture.size) {
      throw ConfigError("{}: is not a readable PNG, PGM or JPEG file; remove it or record it again",
                        picture.path);
    }
    if (picture.size == first.size) continue;
    throw ConfigError(
        "{}: is {}x{}, but {} is {}x{}; a folder must hold pictures of one camera and size",
        picture.path, picture.size->width, picture.size->height, first.path, first.size->width,
        first.size->height);
  }
  return *first.size;
}

/// The first of them where several sizes are as frequent.
ImageSize size_of_most(const std::vector<OddPicture>& pictures, const std::string& dir) {
  std::optional<ImageSize> best;
  std::ptrdiff_t most = 0;
  for (const OddPicture& picture : pictures) {
    const auto alike =
        std::count_if(pictures.begin(), pictures.end(),
                      [&](const OddPicture& other) { return other.size == picture.size; });
    if (!picture.size || alike <= most) continue;
    most = alike;
    best = picture.size;
  }
  if (!best)
    throw ConfigError("images:{}: none of its pictures can be read; record them again", dir);
  return *best;
}

std::vector<Duration> frame_times(const std::string& dir, const std::vector<std::string>& names) {
  const fs::path path = fs::path(dir) / "frames.csv";
  std::error_code error;
  if (fs::exists(path, error)) {
    return parse_frame_times(read_text(path), path.string(), names);
  }
  std::vector<Duration> times(names.size());
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<int>(i) * kDefaultPeriod;
  return times;
}

}  // namespace

std::vector<Duration> parse_frame_times(std::string_view text, const std::string& source,
                                        std::span<const std::string> files) {
  Entries entries;
  for (const std::string& file : files) entries.emplace(file, std::nullopt);
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || (number == 1 && line == "file,t_ns")) continue;
    take_line(line, number, source, entries);
  }
  std::vector<Duration> times;
  times.reserve(files.size());
  for (const std::string& file : files) {
    const auto& entry = entries.at(file);
    if (!entry) {
      throw ConfigError("{}: has no time for {}; add a line {},t_ns", source, shown(file),
                        shown(file));
    }
    const Duration time(entry->t_ns);
    if (!times.empty() && time <= times.back()) {
      throw ConfigError(
          "{}:{}: t_ns {} of {} is not after {}, that of the picture before it; times must "
          "increase in the order of the names",
          source, entry->line, entry->t_ns, shown(file), times.back().count());
    }
    times.push_back(time);
  }
  return times;
}

ImagesSource::ImagesSource(const std::string& dir, bool fast, OddPictures odd) {
  const std::vector<std::string> names = picture_names(dir);
  std::vector<OddPicture> all;
  std::vector<char> scratch;
  for (const std::string& name : names) {
    const std::string path = (fs::path(dir) / name).string();
    all.push_back({path, size_of(path, scratch)});
  }
  const ImageSize size = odd == OddPictures::refuse ? size_of_all(all) : size_of_most(all, dir);
  const std::vector<Duration> times = frame_times(dir, names);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].size != size) {
      odd_.push_back(all[i]);
      continue;
    }
    paths_.push_back(all[i].path);
    times_.push_back(times[i]);
  }
  format_.width = size.width;
  format_.height = size.height;
  decoder_ = std::make_unique<RawDecoder>(size.width, size.height);
  format_.period = times_.size() < 2 ? kDefaultPeriod
                                     : (times_.back() - times_.front()) /
                                           static_cast<std::int64_t>(times_.size() - 1);
  format_.description = fmt::format(
      "{}: {} pictures, {}x{}, {:.4g} fps{}", dir, paths_.size(), size.width, size.height,
      1e9 / static_cast<double>(format_.period.count()), fast ? ", as fast as they can go" : "");
  if (fast) return;
  timer_ = monotonic_timer();
  if (!timer_) throw ConfigError("images:{}: no more file descriptors; raise ulimit -n", dir);
  arm();
}

std::string ImagesSource::unusable() const {
  if (corrupt_ == 0) return {};
  return fmt::format("{}: is damaged or has changed, and was skipped{}; record it again",
                     paths_[first_corrupt_],
                     corrupt_ == 1 ? "" : fmt::format(", as were {} others", corrupt_ - 1));
}

void ImagesSource::arm() const noexcept {
  // At once for the first frame, which starts the clock, and for the end.
  if (timer_) wake_at(timer_, next_ > 0 && next_ < paths_.size() ? due(next_) : TimePoint{});
}

ReadStatus ImagesSource::read(Frame& frame) noexcept {
  if (next_ >= paths_.size()) return ReadStatus::end;
  if (timer_) {
    const TimePoint now = std::chrono::steady_clock::now();
    if (next_ == 0) start_ = now;
    if (now < due(next_)) {
      arm();
      return ReadStatus::nothing;
    }
    while (next_ + 1 < paths_.size() && due(next_ + 1) <= now) ++next_;
  }
  const std::size_t index = next_++;
  arm();
  const TimePoint handed_over = std::chrono::steady_clock::now();
  if (!load(paths_[index], frame)) {
    if (corrupt_++ == 0) first_corrupt_ = index;
    return ReadStatus::nothing;
  }
  frame.capture_time = TimePoint(times_[index]);
  frame.latency_origin = handed_over;
  frame.sequence = index;
  frame.dropped = static_cast<std::uint32_t>(index - delivered_);
  delivered_ = index + 1;
  return ReadStatus::frame;
}

bool ImagesSource::complete(Frame& frame) noexcept {
  const Region whole{0, 0, format_.width, format_.height};
  return frame.readable() == whole || decoder_->decode(raw_, whole, frame);
}

bool ImagesSource::load(const std::string& path, Frame& frame) noexcept {
  raw_ = {};
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff length = file.tellg();
  if (length <= 0 || length > kMaxFileBytes) return false;
  bytes_.resize(static_cast<std::size_t>(length));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes_.data()), length)) return false;
  // Asked again: the file may have changed.
  if (image_size(bytes_) != ImageSize{format_.width, format_.height}) return false;
  const std::uint8_t first = bytes_[0];
  raw_.fourcc = first == 0xFF ? fourcc("MJPG") : first == 'P' ? fourcc("PGM ") : fourcc("PNG ");
  raw_.bytes = bytes_;
  return decoder_->decode(raw_, wanted_, frame);
}

using record::Entry;
using record::Keep;

RecordingSource::RecordingSource(std::unique_ptr<record::RecordingReader> recording, bool fast)
    : recording_(std::move(recording)),
      decoder_(recording_->head().width, recording_->head().height) {
  const record::Head& head = recording_->head();
  const std::string file = recording_->path().string();
  if (head.keep == Keep::none) {
    throw ConfigError(
        "recording:{0}: was made with --keep none and has no pictures to replay; `tagwrench export "
        "{0} --csv FILE` gives its samples",
        file);
  }
  if (recording_->frame_times().empty())
    throw ConfigError("recording:{}: holds no frames; give another one", file);
  format_.width = head.width;
  format_.height = head.height;
  format_.period = head.period;
  const std::vector<TimePoint>& times = recording_->frame_times();
  first_ = times.front();
  const double seconds = std::chrono::duration<double>(times.back() - first_).count();
  format_.description =
      fmt::format("{}: {} {} in {:.4g} s, {}x{}, of {} ({}){}", file, times.size(),
                  times.size() == 1 ? "frame" : "frames", seconds, head.width, head.height,
                  head.source, head.created, fast ? ", as fast as they can go" : "");
  if (const auto unclosed = recording_->unclosed(); !unclosed.empty())
    format_.description += fmt::format("; it {}", unclosed);
  picture_.resize(static_cast<std::size_t>(head.width) * static_cast<std::size_t>(head.height));
  if (fast) return;
  timer_ = monotonic_timer();
  if (!timer_) throw ConfigError("recording:{}: no more file descriptors; raise ulimit -n", file);
  arm();
}

/// Makes entry_ the next one. False: there is none.
bool RecordingSource::advance() noexcept {
  if (waiting_) return true;
  if (!damage_.empty()) return false;
  try {
    waiting_ = recording_->next(entry_);
  } catch (const std::exception& e) {
    damage_ = e.what();
  }
  return waiting_;
}

void RecordingSource::arm() const noexcept {
  // At once for the first entry, which starts the clock, and for the end.
  if (timer_) wake_at(timer_, started_ && waiting_ ? due() : TimePoint{});
}

ReadStatus RecordingSource::read(Frame& frame) noexcept {
  if (!advance()) return ReadStatus::end;
  const TimePoint now = std::chrono::steady_clock::now();
  if (!std::exchange(started_, true)) start_ = now;
  if (timer_) {
    if (now < due()) {
      arm();
      return ReadStatus::nothing;
    }
    pass_late(now);
    if (!waiting_) return ReadStatus::end;
  }
  frame.recorded_latency = entry_.latency;
  waiting_ = false;
  ReadStatus status = ReadStatus::missing;
  if (entry_.kind == Entry::Kind::disconnected || entry_.kind == Entry::Kind::reconnected) {
    detail_ = std::move(entry_.text);
    status = entry_.kind == Entry::Kind::disconnected ? ReadStatus::disconnected
                                                      : ReadStatus::reconnected;
  }
  if (entry_.kind == Entry::Kind::frame) {
    ++frame_;
    frame.capture_time = entry_.time;
    frame.latency_origin = now;
    frame.sequence = entry_.sequence;
    frame.touched = entry_.touched;
    frame.dropped = entry_.dropped + passed_;
    status = decode(frame) ? ReadStatus::frame : ReadStatus::nothing;
    if (status == ReadStatus::frame) {
      passed_ = 0;
    } else {
      ++(entry_.raw.bytes.empty() ? without_pixels_ : damaged_frames_);
      passed_ += entry_.dropped + 1;
    }
  }
  // At once, to see what comes next: entry_ is still what raw() and complete() refer to.
  arm();
  return status;
}

/// The newest frame that is due counts, as with a camera: others are passed over.
void RecordingSource::pass_late(TimePoint now) noexcept {
  const std::vector<TimePoint>& times = recording_->frame_times();
  while (entry_.kind == Entry::Kind::frame && frame_ + 1 < times.size() &&
         start_ + (times[frame_ + 1] - times.front()) <= now) {
    passed_ += entry_.dropped + 1;
    ++frame_;
    waiting_ = false;
    if (!advance()) return;
  }
}

bool RecordingSource::decode(Frame& frame) noexcept {
  if (entry_.raw.bytes.empty()) return false;
  if (!entry_.crop) return decoder_.decode(entry_.raw, wanted_, frame);
  // Elsewhere the picture holds what earlier frames left there.
  const Region& part = entry_.all;
  const auto width = static_cast<std::size_t>(part.width);
  for (int y = 0; y < part.height; ++y) {
    const auto row = static_cast<std::ptrdiff_t>(part.y + y) * format_.width + part.x;
    std::copy_n(entry_.raw.bytes.data() + static_cast<std::size_t>(y) * width, width,
                picture_.begin() + row);
  }
  frame.image = {picture_.data(), format_.width, format_.height, format_.width};
  frame.decoded = entry_.first;
  return true;
}

bool RecordingSource::complete(Frame& frame) noexcept {
  const Region whole{0, 0, format_.width, format_.height};
  if (frame.readable() == whole) return true;
  if (!entry_.crop) return decoder_.decode(entry_.raw, whole, frame);
  if (entry_.all == frame.readable()) return false;
  frame.decoded = entry_.all;
  return true;
}

RawFrame RecordingSource::raw() const noexcept { return entry_.crop ? RawFrame{} : entry_.raw; }

std::string RecordingSource::unusable() const {
  const std::string file = recording_->path().string();
  if (!damage_.empty())
    return fmt::format("{}; {} of {} frames were read", damage_, frame_,
                       recording_->frame_times().size());
  if (damaged_frames_ > 0)
    return fmt::format("{}: is damaged: {} of {} frames cannot be decoded, and were skipped", file,
                       damaged_frames_, recording_->frame_times().size());
  if (without_pixels_ == 0) return {};
  return fmt::format("{}: {} frames have no pixels, and were skipped", file, without_pixels_);
}

}  // namespace tagwrench

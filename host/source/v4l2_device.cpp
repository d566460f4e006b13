#include "host/source/v4l2_device.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"
#include "host/core/parse.h"
#include "host/source/v4l2_settings.h"

// Not fuzzed: a process' name, for people; fuzz.pictures has the pictures.

namespace tagwrench {
namespace {

constexpr unsigned kBuffers = 4;  ///< one held by the reader, the rest for a loop that is late once
constexpr unsigned kMinBuffers = 2;
constexpr unsigned kMaxListed = 128;  ///< of anything a driver enumerates
constexpr int kMaxSide = 16384;
constexpr double kDefaultFps = 30;

int device_ioctl(int fd, unsigned long request, void* argument) noexcept {
  return uninterrupted([&] { return ::ioctl(fd, request, argument); }) < 0 ? errno : 0;
}

v4l2_buffer mapped_buffer(unsigned index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

template <std::size_t size>
std::string text_of(const __u8 (&field)[size]) {
  const auto* begin = reinterpret_cast<const char*>(field);
  std::string text(begin, ::strnlen(begin, size));
  // The name comes from the device: it must not be able to write on the terminal.
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; }, '?');
  return text;
}

double rate_of(const v4l2_fract& interval) {
  if (interval.numerator == 0 || interval.denominator == 0) return 0;
  return static_cast<double>(interval.denominator) / interval.numerator;
}

/// Bounded, because a wild stamp must not overflow nanoseconds; the capture_queue judges whether it
/// makes sense.
TimePoint time_of(const timeval& stamp) {
  const auto seconds = std::clamp<std::int64_t>(stamp.tv_sec, 0, 4'000'000'000);
  const auto micros = std::clamp<std::int64_t>(stamp.tv_usec, 0, 999'999);
  return TimePoint(std::chrono::seconds(seconds) + std::chrono::microseconds(micros));
}

int open_node(const std::string& path, UniqueFd& fd) {
  fd.reset(uninterrupted([&] { return ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); }));
  return fd ? 0 : errno;
}

int ask_capability(int fd, V4l2Capability& capability) {
  v4l2_capability answer{};
  if (const int error = device_ioctl(fd, VIDIOC_QUERYCAP, &answer)) return error;
  const auto caps =
      answer.capabilities & V4L2_CAP_DEVICE_CAPS ? answer.device_caps : answer.capabilities;
  capability.card = text_of(answer.card);
  capability.driver = text_of(answer.driver);
  capability.captures = (caps & V4L2_CAP_VIDEO_CAPTURE) != 0 && (caps & V4L2_CAP_STREAMING) != 0;
  return 0;
}

namespace fs = std::filesystem;

std::optional<int> number_after(std::string_view text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return std::nullopt;
  return parse_whole<int>(text.substr(prefix.size()));
}

template <typename Visit>
void for_each_entry(const fs::path& folder, Visit visit) {
  std::error_code error;
  fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) visit(it->path());
}

CameraNode inspect(const std::string& path) {
  CameraNode node;
  node.path = path;
  node.error = query_capability(path, node);
  return node;
}

std::vector<std::string> node_paths() {
  std::vector<int> numbers;
  for_each_entry("/dev", [&](const fs::path& path) {
    if (const auto number = number_after(path.filename().string(), "video"))
      numbers.push_back(*number);
  });
  std::sort(numbers.begin(), numbers.end());
  std::vector<std::string> paths;
  for (const int number : numbers) paths.push_back(fmt::format("/dev/video{}", number));
  return paths;
}

}  // namespace

int query_capability(const std::string& path, V4l2Capability& capability) {
  UniqueFd fd;
  const int error = open_node(path, fd);
  return error ? error : ask_capability(fd.get(), capability);
}

V4l2Device::V4l2Device(const std::string& path) : path_(path) {
  if (const int error = open_node(path, fd_)) fail("open it", error);
  if (ask_capability(fd_.get(), capability_) != 0)
    throw ConfigError("{}: is not a video device; {}", path, capture_nodes_text());
  if (!capability_.captures) {
    throw ConfigError(
        "{}: {} ({}) cannot capture (a metadata or output node, or a loopback that nobody feeds); "
        "{}",
        path, capability_.card, capability_.driver, capture_nodes_text());
  }
}

std::unique_ptr<V4l2Device> V4l2Device::reopen(const std::string& path) {
  std::unique_ptr<V4l2Device> device(new V4l2Device);
  device->path_ = path;
  if (const int error = open_node(path, device->fd_)) device->fail("open it", error);
  return device;
}

V4l2Device::~V4l2Device() {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    device_ioctl(fd_.get(), VIDIOC_STREAMOFF, &type);
  }
  for (const auto& mapping : mappings_) ::munmap(mapping.data(), mapping.size());
}

void V4l2Device::fail(const char* doing, int error) const {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
    case ENOTDIR: throw ConfigError("{}: no such camera; {}", path_, capture_nodes_text());
    case EACCES:
    case EPERM:
      throw ConfigError(
          "{}: no permission; join the group video: sudo usermod -aG video $USER, then log in "
          "again",
          path_);
    case EBUSY: {
      const std::string holders = holders_text(path_);
      throw ConfigError(
          "{}: the camera is busy, {}; close it there, or choose another", path_,
          holders.empty() ? "held by a process that is not visible" : "held by " + holders);
    }
    default:
      throw ConfigError("{}: cannot {}: {}; try another mode, or plug it in again", path_, doing,
                        std::strerror(error));
  }
}

std::vector<V4l2Mode> V4l2Device::modes(int wanted_width, int wanted_height) const {
  std::vector<V4l2Mode> modes;
  for (unsigned i = 0; i < kMaxListed; ++i) {
    v4l2_fmtdesc format{};
    format.index = i;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device_ioctl(fd_.get(), VIDIOC_ENUM_FMT, &format)) break;
    const auto pixels = pixel_format(format.pixelformat);
    if (!pixels) continue;
    add_sizes({.pixels = *pixels, .fourcc = format.pixelformat}, wanted_width, wanted_height,
              modes);
  }
  return modes;
}

void V4l2Device::add_sizes(V4l2Mode mode, int wanted_width, int wanted_height,
                           std::vector<V4l2Mode>& modes) const {
  const auto add = [&](unsigned width, unsigned height) {
    if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) return;
    mode.width = static_cast<int>(width);
    mode.height = static_cast<int>(height);
    add_rates(mode, modes);
  };
  for (unsigned i = 0; i < kMaxListed; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = mode.fourcc;
    if (device_ioctl(fd_.get(), VIDIOC_ENUM_FRAMESIZES, &size)) {
      if (i > 0) return;
      // A driver that lists no sizes has the one that is set.
      v4l2_format format{};
      format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      if (device_ioctl(fd_.get(), VIDIOC_G_FMT, &format) == 0 &&
          format.fmt.pix.pixelformat == mode.fourcc)
        add(format.fmt.pix.width, format.fmt.pix.height);
      return;
    }
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      add(size.discrete.width, size.discrete.height);
      continue;
    }
    const auto& range = size.stepwise;
    const auto fits = [](int value, unsigned low, unsigned high, unsigned step) {
      const auto v = static_cast<unsigned>(value);
      return value > 0 && v >= low && v <= high && (v - low) % std::max(1U, step) == 0;
    };
    if (fits(wanted_width, range.min_width, range.max_width, range.step_width) &&
        fits(wanted_height, range.min_height, range.max_height, range.step_height))
      add(static_cast<unsigned>(wanted_width), static_cast<unsigned>(wanted_height));
    add(range.min_width, range.min_height);
    add(range.max_width, range.max_height);
    return;
  }
}

void V4l2Device::add_rates(V4l2Mode mode, std::vector<V4l2Mode>& modes) const {
  for (unsigned i = 0; i < kMaxListed; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = mode.fourcc;
    interval.width = static_cast<unsigned>(mode.width);
    interval.height = static_cast<unsigned>(mode.height);
    if (device_ioctl(fd_.get(), VIDIOC_ENUM_FRAMEINTERVALS, &interval)) {
      if (i == 0) modes.push_back(mode);
      return;
    }
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      mode.fps_min = mode.fps_max = rate_of(interval.discrete);
      modes.push_back(mode);
      continue;
    }
    mode.fps_max = rate_of(interval.stepwise.min);
    mode.fps_min = rate_of(interval.stepwise.max);
    modes.push_back(mode);
    return;
  }
}

V4l2Stream V4l2Device::set_mode(const V4l2Choice& choice) {
  const V4l2Mode& mode = choice.mode;
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<unsigned>(mode.width);
  format.fmt.pix.height = static_cast<unsigned>(mode.height);
  format.fmt.pix.pixelformat = mode.fourcc;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int error = device_ioctl(fd_.get(), VIDIOC_S_FMT, &format))
    fail(("set " + describe(mode)).c_str(), error);
  const v4l2_pix_format& got = format.fmt.pix;
  if (got.width != static_cast<unsigned>(mode.width) ||
      got.height != static_cast<unsigned>(mode.height) || got.pixelformat != mode.fourcc) {
    throw ConfigError("{}: the driver does not give {} although it lists it; choose another mode",
                      path_, describe(mode));
  }
  const int row = row_bytes(mode.pixels, mode.width);
  const bool plausible = got.bytesperline >= static_cast<unsigned>(row) &&
                         got.bytesperline <= static_cast<unsigned>(4 * kMaxSide);
  return {.pixels = mode.pixels,
          .width = mode.width,
          .height = mode.height,
          .stride = row == 0    ? 0
                    : plausible ? static_cast<int>(got.bytesperline)
                                : row,
          .period = set_rate(choice.fps)};
}

Duration V4l2Device::set_rate(double fps) const {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (fps > 0) {
    parameters.parm.capture.timeperframe = {1000, static_cast<unsigned>(std::lround(fps * 1000))};
    device_ioctl(fd_.get(), VIDIOC_S_PARM, &parameters);
  }
  // What the driver made of it counts; one that does not answer keeps its own rate.
  if (device_ioctl(fd_.get(), VIDIOC_G_PARM, &parameters) == 0) {
    const double answered = rate_of(parameters.parm.capture.timeperframe);
    if (answered > 0) fps = answered;
  }
  if (!(fps > 0.01 && fps < 100000)) fps = kDefaultFps;
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1 / fps));
}

void V4l2Device::start() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = device_ioctl(fd_.get(), VIDIOC_REQBUFS, &request))
    fail("get buffers", error);
  if (request.count < kMinBuffers) fail("get buffers", ENOMEM);
  for (unsigned i = 0; i < std::min(request.count, 2 * kBuffers); ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    if (const int error = device_ioctl(fd_.get(), VIDIOC_QUERYBUF, &buffer))
      fail("get buffers", error);
    // Read-only would do, but some drivers map writable or not at all.
    void* memory = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(),
                          buffer.m.offset);
    if (memory == MAP_FAILED) fail("map buffers", errno);
    mappings_.emplace_back(static_cast<std::uint8_t*>(memory), buffer.length);
    // A child process must not keep the camera's memory alive.
    ::madvise(memory, buffer.length, MADV_DONTFORK);
    if (!requeue(i)) fail("queue buffers", errno);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = device_ioctl(fd_.get(), VIDIOC_STREAMON, &type)) fail("start it", error);
  streaming_ = true;
}

V4l2Device::Dequeue V4l2Device::dequeue(V4l2Buffer& out, int& error) noexcept {
  v4l2_buffer buffer = mapped_buffer(0);
  error = device_ioctl(fd_.get(), VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return Dequeue::empty;
  if (error == 0 && buffer.index >= mappings_.size()) error = EPROTO;
  if (error != 0) return Dequeue::failed;
  out.index = buffer.index;
  out.bytes = mappings_[buffer.index];
  out.bytes_used = buffer.bytesused;
  out.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  out.stamp.sequence = buffer.sequence;
  out.stamp.driver_time = time_of(buffer.timestamp);
  // A driver that does not say which clock it reads (v4l2loopback) is judged by its times.
  const auto type = buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK;
  out.stamp.monotonic =
      type == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC || type == V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  out.stamp.dequeued = std::chrono::steady_clock::now();
  return Dequeue::buffer;
}

bool V4l2Device::requeue(unsigned index) noexcept {
  v4l2_buffer buffer = mapped_buffer(index);
  return device_ioctl(fd_.get(), VIDIOC_QBUF, &buffer) == 0;
}

bool V4l2Device::broken() const noexcept {
  pollfd entry{fd_.get(), POLLIN, 0};
  return ::poll(&entry, 1, 0) > 0 && (entry.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0;
}

std::string V4l2Device::lockable_controls() const {
  V4l2ControlPort port(fd_.get());
  return ControlLock::available(port);
}

std::vector<CameraNode> list_camera_nodes() {
  std::vector<CameraNode> nodes;
  for (const std::string& path : node_paths()) {
    CameraNode node = inspect(path);
    if (node.captures) {
      try {
        V4l2Device device(path);
        node.modes = device.modes(640, 480);
        node.controls = device.lockable_controls();
      } catch (const ConfigError&) {
        node.error = EBUSY;
      }
    }
    nodes.push_back(std::move(node));
  }
  return nodes;
}

std::string capture_nodes_text() {
  std::string text;
  for (const std::string& path : node_paths()) {
    const CameraNode node = inspect(path);
    if (!node.captures) continue;
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", path, node.card);
  }
  return text.empty() ? "no camera is connected" : "cameras here: " + text;
}

std::string stable_path(const std::string& path) {
  std::error_code error;
  const fs::path node = fs::canonical(path, error);
  if (error) return path;
  for (const char* folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"})
    if (path.starts_with(folder)) return path;
  for (const char* folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"}) {
    std::string found;
    for_each_entry(folder, [&](const fs::path& link) {
      std::error_code broken;
      if (fs::canonical(link, broken) == node && !broken) found = link.string();
    });
    if (!found.empty()) return found;
  }
  return path;
}

std::string holders_text(const std::string& path) {
  std::error_code error;
  const fs::path node = fs::canonical(path, error);
  std::string text;
  for_each_entry("/proc", [&](const fs::path& process) {
    const auto pid = number_after(process.filename().string(), "");
    if (!pid || *pid == ::getpid()) return;
    bool holds = false;
    for_each_entry(process / "fd", [&](const fs::path& link) {
      std::error_code gone;
      holds = holds || (fs::read_symlink(link, gone) == node && !gone);
    });
    if (!holds) return;
    std::string name;
    std::getline(std::ifstream(process / "comm"), name);
    text += fmt::format("{}{} (pid {})", text.empty() ? "" : ", ", name, *pid);
  });
  return text;
}

}  // namespace tagwrench

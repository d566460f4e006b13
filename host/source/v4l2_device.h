// The ioctls of one V4L2 capture device: opening, listing, setting a mode, streaming from mapped
// buffers.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/source/v4l2_settings.h"

namespace tagwrench {

struct V4l2Capability {
  std::string card;  ///< the camera's name
  std::string driver;
  bool captures = false;  ///< single-planar capture with streaming
};

/// Asks a node what it is. Returns errno, 0 if it answered.
int query_capability(const std::string& path, V4l2Capability& capability);

/// What the driver agreed to.
struct V4l2Stream {
  PixelFormat pixels = PixelFormat::grey;
  int width = 0;
  int height = 0;
  int stride = 0;     ///< bytes between rows, 0 for mjpg
  Duration period{};  ///< between frames
};

/// What the driver wrote on a buffer, and when we took it.
struct BufferStamp {
  std::uint32_t sequence = 0;
  TimePoint driver_time{};
  bool monotonic = false;  ///< the driver does not deny that driver_time is CLOCK_MONOTONIC
  TimePoint dequeued{};
};

struct V4l2Buffer {
  unsigned index = 0;
  std::span<const std::uint8_t> bytes;  ///< the whole mapping
  std::size_t bytes_used = 0;           ///< as the driver says; may exceed the mapping
  bool damaged = false;                 ///< the driver says that the picture is
  BufferStamp stamp;
};

class V4l2Device {
 public:
  /// Throws ConfigError: no such node, no permission, busy, not a capture device.
  explicit V4l2Device(const std::string& path);
  /// Opens a node that was a capture device before, without asking what it is. (v4l2loopback with
  /// exclusive_caps, asked while nobody feeds it, stops accepting feeders.)
  static std::unique_ptr<V4l2Device> reopen(const std::string& path);
  ~V4l2Device();

  /// The modes whose pixels are understood. Where the driver gives a range of sizes, the wanted
  /// size if it lies within, and both ends.
  std::vector<V4l2Mode> modes(int wanted_width, int wanted_height) const;

  /// Throws ConfigError if the driver is busy or turns the mode into another.
  V4l2Stream set_mode(const V4l2Choice& choice);

  /// Maps the buffers, queues them and starts. Throws ConfigError.
  void start();

  enum class Dequeue : std::uint8_t { buffer, empty, failed };
  /// Never blocks. On `failed`, `error` is the errno.
  Dequeue dequeue(V4l2Buffer& buffer, int& error) noexcept;
  /// Gives a buffer back to the driver.
  bool requeue(unsigned index) noexcept;
  /// Whether the kernel has flagged the device as broken or gone.
  bool broken() const noexcept;

  int fd() const noexcept { return fd_.get(); }
  unsigned buffer_count() const noexcept { return static_cast<unsigned>(mappings_.size()); }
  const V4l2Capability& capability() const noexcept { return capability_; }
  /// Names of the controls that a run would lock.
  std::string lockable_controls() const;

 private:
  V4l2Device() = default;
  [[noreturn]] void fail(const char* doing, int error) const;
  void add_sizes(V4l2Mode mode, int wanted_width, int wanted_height,
                 std::vector<V4l2Mode>& modes) const;
  void add_rates(V4l2Mode mode, std::vector<V4l2Mode>& modes) const;
  Duration set_rate(double fps) const;

  std::string path_;
  UniqueFd fd_;
  V4l2Capability capability_;
  std::vector<std::span<std::uint8_t>> mappings_;
  bool streaming_ = false;
};

// Which camera nodes there are, what they are called and who holds them. For messages and the
// doctor.

struct CameraNode : V4l2Capability {
  std::string path;             ///< /dev/videoN
  int error = 0;                ///< errno of opening or asking it, 0 if it answered
  std::vector<V4l2Mode> modes;  ///< understood ones; empty unless it captures
  std::string controls;         ///< those that a run would lock, for people
};

/// Every /dev/videoN in order of N.
std::vector<CameraNode> list_camera_nodes();

/// "/dev/video0 (HD Webcam), /dev/video2 (...)", or a sentence that there is none.
std::string capture_nodes_text();

/// The link in /dev/v4l/by-id, else by-path, that leads to this node; else the path itself.
std::string stable_path(const std::string& path);

/// "ffmpeg (pid 41), obs (pid 7)": other processes that have the node open, as far as /proc shows
/// them.
std::string holders_text(const std::string& path);

}  // namespace tagwrench

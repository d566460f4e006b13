// A camera made of files: writes clips into a v4l2loopback node, which a reader then sees as a
// capture device.
//
//   feeder DEVICE GREY|YUYV|MJPG RATE_HZ NAME=DIR...    each DIR holds .pgm (GREY, YUYV) or .jpg
//   (MJPG) files
//
// Starts by repeating the first clip's first frame. Commands on standard input:
//   loop NAME     plays the clip for ever
//   once NAME     plays it once, then repeats its last frame; says `done NAME`
//   hold NAME     repeats the clip's last frame
//   truncate N    cuts the next N frames in half (MJPG)
// Every frame that is written says `frame NAME INDEX TIME_ns`.
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "tests/kernel/guest/lines.h"

namespace tagwrench::rig {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Size {
  unsigned width = 0;
  unsigned height = 0;
  bool operator==(const Size&) const = default;
};

struct Clip {
  std::string name;
  std::vector<Bytes> frames;
};

Bytes read_all(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Binary PGM, 8 bits, no comments, as the simulator writes it; leaves the pixels in `file`.
Size strip_pgm_header(Bytes& file, const std::string& path) {
  const std::string head(file.begin(),
                         file.begin() + std::min<std::ptrdiff_t>(64, std::ssize(file)));
  std::istringstream in(head);
  std::string magic;
  Size size;
  unsigned white = 0;
  in >> magic >> size.width >> size.height >> white;
  const std::streamoff pixels = in ? static_cast<std::streamoff>(in.tellg()) + 1 : 0;
  if (magic != "P5" || white != 255 ||
      file.size() != std::size_t{size.width} * size.height + static_cast<std::size_t>(pixels)) {
    fail(path + ": not an 8-bit binary PGM");
  }
  file.erase(file.begin(), file.begin() + pixels);
  return size;
}

/// From the start-of-frame segment (ITU T.81, B.2.2).
Size jpeg_size(const Bytes& file, const std::string& path) {
  std::size_t at = 2;
  while (at + 9 < file.size() && file[at] == 0xff) {
    const std::uint8_t marker = file[at + 1];
    if (marker >= 0xc0 && marker <= 0xc2) {
      return {file[at + 7] * 256U + file[at + 8], file[at + 5] * 256U + file[at + 6]};
    }
    at += 2 + file[at + 2] * 256U + file[at + 3];
  }
  fail(path + ": not a JPEG file");
}

Bytes grey_to_yuyv(const Bytes& grey) {
  Bytes out;
  out.reserve(2 * grey.size());
  for (const std::uint8_t y : grey) {
    out.push_back(y);
    out.push_back(128);
  }
  return out;
}

class Feeder {
 public:
  Feeder(const std::string& device, const std::string& format, double rate)
      : device_(device), format_(format), period_ns_(static_cast<std::int64_t>(1e9 / rate)) {
    if (format != "GREY" && format != "YUYV" && format != "MJPG") fail(format + ": no such format");
  }

  void load(const std::string& name, const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> paths;
    const char* wanted = format_ == "MJPG" ? ".jpg" : ".pgm";
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == wanted) paths.push_back(entry.path());
    }
    if (paths.empty()) fail(folder.string() + ": no " + wanted + " files");
    std::sort(paths.begin(), paths.end());
    Clip clip{name, {}};
    for (const auto& path : paths) {
      Bytes file = read_all(path);
      const Size size = format_ == "MJPG" ? jpeg_size(file, path) : strip_pgm_header(file, path);
      if (size_.width == 0) size_ = size;
      if (size != size_) fail(path.string() + ": another size than the frames before");
      clip.frames.push_back(format_ == "YUYV" ? grey_to_yuyv(file) : std::move(file));
    }
    clips_.push_back(std::move(clip));
  }

  void open_device() {
    fd_.reset(::open(device_.c_str(), O_RDWR | O_CLOEXEC));
    if (!fd_) fail(device_ + ": " + std::strerror(errno));
    const unsigned per_pixel = format_ == "YUYV" ? 2 : 1;
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = size_.width;
    format.fmt.pix.height = size_.height;
    format.fmt.pix.pixelformat = v4l2_fourcc(format_[0], format_[1], format_[2], format_[3]);
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.bytesperline = format_ == "MJPG" ? 0 : size_.width * per_pixel;
    format.fmt.pix.sizeimage = size_.width * size_.height * per_pixel;
    if (::ioctl(fd_.get(), VIDIOC_S_FMT, &format) != 0)
      fail(device_ + ": S_FMT: " + std::strerror(errno));
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    rate.parm.output.timeperframe = {1000,
                                     static_cast<unsigned>(1e12 / static_cast<double>(period_ns_))};
    if (::ioctl(fd_.get(), VIDIOC_S_PARM, &rate) != 0)
      fail(device_ + ": S_PARM: " + std::strerror(errno));
  }

  [[noreturn]] void run() {
    std::int64_t due_ns = now_ns();
    for (;;) {
      while (const auto command = commands_.next()) obey(*command);
      write_frame();
      advance();
      // From tick to tick, so that the rate does not drift; a late feeder does not make up for lost
      // time.
      due_ns = std::max(due_ns + period_ns_, now_ns());
      const timespec until{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
      while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
      }
    }
  }

 private:
  enum class Play { hold, once, loop };

  void obey(const std::string& command) {
    std::istringstream in(command);
    std::string verb;
    std::string argument;
    in >> verb >> argument;
    if (verb == "truncate") {
      truncate_ = std::atoi(argument.c_str());
      return;
    }
    const auto clip = std::find_if(clips_.begin(), clips_.end(),
                                   [&](const Clip& c) { return c.name == argument; });
    const bool known = verb == "loop" || verb == "once" || verb == "hold";
    if (!known || clip == clips_.end()) fail("cannot do: " + command);
    clip_ = static_cast<std::size_t>(clip - clips_.begin());
    index_ = verb == "hold" ? clip->frames.size() - 1 : 0;
    play_ = verb == "loop" ? Play::loop : verb == "once" ? Play::once : Play::hold;
  }

  void write_frame() {
    const Clip& clip = clips_[clip_];
    const Bytes& frame = clip.frames[index_];
    std::size_t size = frame.size();
    if (truncate_ > 0) {
      --truncate_;
      size /= 2;
    }
    const ssize_t written = ::write(fd_.get(), frame.data(), size);
    if (written != static_cast<ssize_t>(size)) fail(device_ + ": write: " + std::strerror(errno));
    std::printf("frame %s %zu %lld\n", clip.name.c_str(), index_, static_cast<long long>(now_ns()));
  }

  void advance() {
    if (play_ == Play::hold) return;
    if (index_ + 1 < clips_[clip_].frames.size()) {
      ++index_;
    } else if (play_ == Play::loop) {
      index_ = 0;
    } else {
      play_ = Play::hold;
      std::printf("done %s\n", clips_[clip_].name.c_str());
    }
  }

  std::string device_;
  std::string format_;
  std::int64_t period_ns_;
  Size size_;
  std::vector<Clip> clips_;
  UniqueFd fd_;
  Commands commands_;
  std::size_t clip_ = 0;
  std::size_t index_ = 0;
  Play play_ = Play::hold;
  int truncate_ = 0;
};

int feed(const std::vector<std::string>& arguments) {
  if (arguments.size() < 4) fail("usage: feeder DEVICE GREY|YUYV|MJPG RATE_HZ NAME=DIR...");
  const double rate = std::atof(arguments[2].c_str());
  if (!(rate > 0)) fail(arguments[2] + ": not a rate");
  Feeder feeder(arguments[0], arguments[1], rate);
  for (std::size_t i = 3; i < arguments.size(); ++i) {
    const std::size_t equals = arguments[i].find('=');
    if (equals == std::string::npos) fail(arguments[i] + ": want NAME=DIR");
    feeder.load(arguments[i].substr(0, equals), arguments[i].substr(equals + 1));
  }
  feeder.open_device();
  feeder.run();
}

}  // namespace
}  // namespace tagwrench::rig

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  return tagwrench::rig::feed({argv + 1, argv + argc});
}

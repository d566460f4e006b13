#include "host/output/line_outputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/remedy.h"
#include "host/core/os/termination.h"
#include "host/core/os/uninterrupted.h"

namespace tagwrench {
namespace {

constexpr int kLastWait_ms = 100;

const char* remedy(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT: return "free some space, or write somewhere else";
    case EPIPE: return "its reader has gone; start it again, or write to a file";
    case EFBIG: return "raise the limit (ulimit -f), or write to another file";
    default: return "write somewhere else";
  }
}

constexpr std::string_view kJson =
    R"({{"seq":{},"t_ns":{},"status":"{}",)"
    R"("d_m":[{},{},{}],"d_rad":[{},{},{}],"d_sigma":[{},{},{},{},{},{}],)"
    R"("f_n":[{},{},{}],"m_nm":[{},{},{}],"w_sigma":[{},{},{},{},{},{}],)"
    R"("dropped":{},"latency_us":{}}})"
    "\n";

constexpr std::string_view kCsv =
    "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n";

template <typename Format>
std::string_view line(LineBuffer& buffer, Format format, const Sample& sample) noexcept {
  const Status status = shown_status(sample);
  const bool numbers = carries_numbers(status);
  static const Vector6 kZero = Vector6::Zero();
  const Vector6& d = numbers ? sample.displacement : kZero;
  const Vector6& ds = numbers ? sample.displacement_sigma : kZero;
  const Vector6& w = numbers ? sample.wrench : kZero;
  const Vector6& ws = numbers ? sample.wrench_sigma : kZero;
  const std::int64_t t_ns =
      std::chrono::duration_cast<Duration>(sample.capture_time.time_since_epoch()).count();
  const auto done = fmt::format_to_n(buffer.data(), buffer.size(), format, sample.sequence, t_ns,
                                     name(status),                              //
                                     d[0], d[1], d[2], d[3], d[4], d[5],        //
                                     ds[0], ds[1], ds[2], ds[3], ds[4], ds[5],  //
                                     w[0], w[1], w[2], w[3], w[4], w[5],        //
                                     ws[0], ws[1], ws[2], ws[3], ws[4], ws[5],  //
                                     sample.dropped, latency_us(sample));
  return {buffer.data(), std::min(done.size, buffer.size())};
}

}  // namespace

TextSink::TextSink(const std::string& path, bool lossless)
    : label_(path == "-" ? "standard output" : path), lossless_(lossless) {
  if (path == "-") {
    adopt(STDOUT_FILENO);
    return;
  }
  refuse_foreign_link(path);
  // Non-blocking, so that a named pipe without a reader is an error and not a wait.
  UniqueFd fd(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0644));
  if (!fd) {
    const char* what = errno == ENXIO ? "start the reader of the named pipe first"
                                      : remedy_for(errno, "choose a file that can be written");
    throw ConfigError("{}: cannot be written: {}; {}", path, std::strerror(errno), what);
  }
  adopt(fd.get());
}

TextSink::TextSink(int fd, std::string label, bool lossless)
    : label_(std::move(label)), lossless_(lossless) {
  adopt(fd);
}

TextSink::~TextSink() {
  if (fd_ && error_ == 0 && rest_begin_ < rest_end_ && writable(kLastWait_ms)) flush_rest();
}

void TextSink::adopt(int fd) {
  struct stat about {};
  if (fstat(fd, &about) != 0)
    throw ConfigError("{}: not open: {}; redirect it somewhere", label_, std::strerror(errno));
  if ((::fcntl(fd, F_GETFL) & O_ACCMODE) == O_RDONLY)
    throw std::runtime_error(
        fmt::format("{}: is closed, or open for reading only; redirect it somewhere", label_));
  if (S_ISREG(about.st_mode)) kind_ = Kind::file;
  if (S_ISSOCK(about.st_mode)) kind_ = Kind::socket;
  if (kind_ == Kind::stream) {
    // Opened anew: O_NONBLOCK on a duplicate would also change the shell's and the other programs'
    // view of the stream.
    const std::string self = fmt::format("/proc/self/fd/{}", fd);
    fd_.reset(::open(self.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  }
  if (!fd_) fd_.reset(fcntl(fd, F_DUPFD_CLOEXEC, 0));
  if (!fd_) {
    throw ConfigError("{}: cannot be written: {}; {}", label_, std::strerror(errno),
                      remedy_for(errno, "redirect it somewhere"));
  }
}

bool TextSink::writable(int timeout_ms) noexcept {
  if (kind_ == Kind::file) return true;
  pollfd waiting{fd_.get(), POLLOUT, 0};
  // A hang-up counts as writable: the write then names the error.
  return uninterrupted([&] { return ::poll(&waiting, 1, timeout_ms); }) > 0;
}

/// False: termination was requested before there was room.
bool TextSink::wait_writable() noexcept {
  if (kind_ == Kind::file) return true;
  pollfd fds[2] = {{fd_.get(), POLLOUT, 0}, {borrowed_termination_fd(), POLLIN, 0}};
  uninterrupted([&] { return ::poll(fds, 2, -1); });
  return fds[0].revents != 0;
}

long TextSink::put(const char* data, std::size_t size) noexcept {
  if (kind_ == Kind::socket) return ::send(fd_.get(), data, size, MSG_DONTWAIT | MSG_NOSIGNAL);
  return ::write(fd_.get(), data, size);
}

SendStatus TextSink::flush_rest() noexcept {
  while (rest_begin_ < rest_end_) {
    const long done = put(rest_.data() + rest_begin_, rest_end_ - rest_begin_);
    if (done < 0 && errno != EAGAIN && errno != EINTR) return fail(errno);
    if (done > 0) rest_begin_ += static_cast<std::size_t>(done);
    if (done <= 0 && (!lossless_ || !wait_writable())) return SendStatus::skipped;
  }
  return SendStatus::ok;
}

void TextSink::undo_partial_line(std::size_t written) noexcept {
  const off_t end = lseek(fd_.get(), 0, SEEK_CUR);
  struct stat about {};
  if (end < static_cast<off_t>(written) || fstat(fd_.get(), &about) != 0) return;
  if (about.st_size != end) return;  // somebody else writes here too
  const off_t start = end - static_cast<off_t>(written);
  if (ftruncate(fd_.get(), start) == 0) lseek(fd_.get(), start, SEEK_SET);
}

SendStatus TextSink::write(std::string_view block) noexcept {
  if (error_ != 0) return SendStatus::failed;
  if (block.size() > kMaxBlock) return fail(EMSGSIZE);
  if (const SendStatus before = flush_rest(); before != SendStatus::ok) return before;

  while (true) {
    if (!(lossless_ ? wait_writable() : writable(0))) return SendStatus::skipped;
    const long done = put(block.data(), block.size());
    if (done < 0) {
      if (errno != EAGAIN && errno != EINTR) return fail(errno);
      if (!lossless_ || termination_requested()) return SendStatus::skipped;
      continue;  // a pipe that has room, but less than the block
    }
    const auto written = static_cast<std::size_t>(done);
    if (written == block.size()) return SendStatus::ok;
    if (kind_ == Kind::file) {  // a file takes less than it is given when there is no more room
      undo_partial_line(written);
      return fail(ENOSPC);
    }
    rest_begin_ = 0;
    rest_end_ = block.size() - written;
    std::memcpy(rest_.data(), block.data() + written, rest_end_);
    return flush_rest() == SendStatus::failed ? SendStatus::failed : SendStatus::ok;
  }
}

std::string TextSink::failure() const {
  return fmt::format("{}: cannot be written: {}; {}", label_, std::strerror(error_),
                     remedy(error_));
}

std::string_view json_line(LineBuffer& buffer, const Sample& sample) noexcept {
  return line(buffer, FMT_STRING(kJson), sample);
}

std::string_view csv_line(LineBuffer& buffer, const Sample& sample) noexcept {
  return line(buffer, FMT_STRING(kCsv), sample);
}

std::int64_t latency_us(const Sample& sample) noexcept {
  const auto late = std::chrono::duration_cast<std::chrono::microseconds>(sample.output_time -
                                                                          sample.latency_origin);
  return std::max<std::int64_t>(late.count(), 0);
}

// A header that does not go out now (the reader has not started) goes out before the first row; one
// that cannot go out at all shows as the failure of the first send().
CsvOutput::CsvOutput(const std::string& path, bool lossless) : sink_(path, lossless) {
  header_written_ = sink_.write(kCsvHeader) == SendStatus::ok;
}

SendStatus CsvOutput::send(const Sample& sample) noexcept {
  if (!header_written_) {
    const SendStatus status = sink_.write(kCsvHeader);
    if (status != SendStatus::ok) return status;
    header_written_ = true;
  }
  return sink_.write(csv_line(line_, sample));
}

}  // namespace tagwrench

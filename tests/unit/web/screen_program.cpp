// `tagwrench camera-timing --screen web` with a camera that others hold: its pictures at 50 Hz are
// as bright as the last line of standard input says (0 to 255). Prints the page's address, then the
// report.
#include <poll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "host/tools/camera_timing/flip_patches.h"

namespace tagwrench {
namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 48;
constexpr Duration kPeriod = std::chrono::milliseconds(20);

class LineCamera final : public FrameSource {
 public:
  LineCamera() : timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {
    itimerspec every{};
    every.it_interval.tv_nsec = every.it_value.tv_nsec = kPeriod.count();
    ::timerfd_settime(timer_.get(), 0, &every, nullptr);
    format_ = {kWidth, kHeight, kPeriod, "a camera made of lines"};
  }

  const SourceFormat& format() const noexcept override { return format_; }
  int poll_fd() const noexcept override { return timer_.get(); }
  ReadStatus read(Frame& frame) noexcept override {
    std::uint64_t ticks = 0;
    if (::read(timer_.get(), &ticks, sizeof ticks) <= 0) return ReadStatus::nothing;
    take_lines();
    frame.image = {pixels_.data(), kWidth, kHeight, kWidth};
    frame.decoded = {};
    frame.dropped = static_cast<std::uint32_t>(ticks - 1);
    frame.sequence = sequence_ += ticks;
    frame.capture_time = frame.latency_origin = std::chrono::steady_clock::now();
    return ReadStatus::frame;
  }

 private:
  void take_lines() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    std::array<char, 256> bytes{};
    while (::poll(&input, 1, 0) > 0) {
      const ssize_t size = ::read(STDIN_FILENO, bytes.data(), bytes.size());
      if (size <= 0) return;
      text_.append(bytes.data(), static_cast<std::size_t>(size));
    }
    for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos;
         text_.erase(0, end + 1)) {
      std::fill(pixels_.begin(), pixels_.end(),
                static_cast<std::uint8_t>(std::atoi(text_.c_str())));
    }
  }

  UniqueFd timer_;
  SourceFormat format_;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(std::size_t{kWidth} * kHeight);
  std::string text_;
  std::uint64_t sequence_ = 0;
};

int measure(const std::string& pages, double seconds) {
  WebOptions options{.port = 0};
  options.pages = pages;
  PagePatch page(options);
  std::cout << page.url() << std::endl;
  LineCamera camera;
  if (!page.wait_for_page(-1)) {
    std::cerr << page.ended() << std::endl;
    return 1;
  }
  ScreenOptions how;
  how.seconds = seconds;
  const ScreenMeasurement measured = measure_screen(camera, page, how);
  if (!measured.refusal.empty()) {
    std::cerr << measured.refusal << std::endl;
    return 1;
  }
  std::cout << report_json(measured, camera.format().description, page.description(), 0.02);
  return 0;
}

}  // namespace
}  // namespace tagwrench

int main(int argc, char** argv) try {
  if (argc != 3) return 2;
  return tagwrench::measure(argv[1], std::atof(argv[2]));
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}

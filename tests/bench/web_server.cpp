// What a dashboard costs the frame loop: tracked frames at 120 Hz, with nobody looking and with a
// page that reads all samples and pictures, in turns; medians and tails of the time from the frame
// to the outputs, and to the end of its step. The page is a process of its own, as a browser is.
#include "host/web/server/web_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <ctime>
#include <string>
#include <thread>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/sensor/sensor_config.h"
#include "host/source/decode.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "host/web/server/live_feed.h"
#include "host/web/server/request_guard.h"
#include "host/wrench/estimate.h"
#include "tests/bench/hid_figures.h"

namespace tagwrench::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::uint8_t>;

constexpr Duration kPeriod = std::chrono::nanoseconds(1'000'000'000 / 120);
constexpr int kFrames = 60;
constexpr int kTurns = 40;  // of each, a second long

struct Silent final : PageRequestHandler {
  explicit Silent(WebServer& to) : server(to) {}
  void handle(PageRequest request) override { server.answer(request.page, request.id, true, ""); }
  WebServer& server;
};

/// Reads whatever comes; does not return before the server closes.
int read_all(std::uint16_t port) {
  const UniqueFd socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) return 1;
  const std::string host = "127.0.0.1:" + std::to_string(port);
  std::string sent =
      "GET /ws HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
      "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\nSec-WebSocket-Protocol: tagwrench.v1\r\n\r\n";
  std::vector<char> bytes(65536);
  if (::send(socket.get(), sent.data(), sent.size(), 0) < 0) return 1;
  if (::recv(socket.get(), bytes.data(), bytes.size(), 0) <= 0) return 1;
  const std::string request = R"({"id":1,"ask":"pictures","on":true})";
  sent = "\x81" + std::string(1, static_cast<char>(0x80 | request.size())) + std::string(4, '\0') +
         request;
  if (::send(socket.get(), sent.data(), sent.size(), 0) < 0) return 1;
  while (::recv(socket.get(), bytes.data(), bytes.size(), 0) > 0) {
  }
  return 0;
}

class Reader {
 public:
  explicit Reader(std::uint16_t port) {
    std::string port_text = std::to_string(port);
    std::string verb = "--read";
    std::string name = "reader";
    std::array<char*, 4> arguments{name.data(), verb.data(), port_text.data(), nullptr};
    ::posix_spawn(&pid_, "/proc/self/exe", nullptr, nullptr, arguments.data(), environ);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }

 private:
  pid_t pid_ = 0;
};

double thread_us() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

struct Times {
  std::vector<double> output_us;  ///< from the frame to the outputs
  std::vector<double> step_us;    ///< and the live feed
  std::vector<double> cpu_us;     ///< of the step, of this thread alone
  std::vector<double> feed_us;    ///< of the live feed alone, without pictures
  std::vector<double> picture_us;
};

/// Frames of the simulated sensor, forwards and backwards, so that there is no jump.
class Loop {
 public:
  Loop(PixelFormat format, LiveFeed& feed)
      : format_(format),
        feed_(feed),
        sensor_(parse_sensor(sim::sensor_yaml(scenario_), "bench")),
        decoder_(format, scenario_.camera.width_px, scenario_.camera.height_px, 0),
        tracker_(sensor_.camera, sensor_.target, sensor_.rest),
        wrench_(sensor_.wrench) {
    SimulatorSource source(scenario_, /*live=*/false);
    for (int i = 0; i < kFrames; ++i) {
      Frame frame;
      source.read(frame);
      const ImageView& image = frame.image;
      const auto pixels = static_cast<std::size_t>(image.width * image.height);
      Bytes bytes(image.pixels, image.pixels + pixels);
      if (format == PixelFormat::yuyv) {
        bytes.assign(2 * pixels, 128);
        for (std::size_t p = 0; p < pixels; ++p) bytes[2 * p] = image.pixels[p];
      }
      clip_.push_back(std::move(bytes));
    }
  }

  void turn(Times& times) {
    for (int i = 0; i < 2 * kFrames; ++i) {
      std::this_thread::sleep_until(next_ += kPeriod);
      step(clip_[static_cast<std::size_t>(i < kFrames ? i : 2 * kFrames - 1 - i)], times);
    }
  }
  void begin() { next_ = Clock::now(); }
  int lost() const { return lost_; }

 private:
  void step(const Bytes& bytes, Times& times) {
    Frame frame;
    frame.sequence = sequence_++;
    frame.capture_time = TimePoint(kPeriod * frame.sequence);  // whenever this process may run
    const TimePoint begin = Clock::now();
    frame.latency_origin = begin;
    const double cpu = thread_us();
    decoder_.decode(bytes, bytes.size(), wanted_, frame.image, frame.decoded);
    const Track track = tracker_.track(frame);
    wanted_ = track.wanted;
    Sample sample{.sequence = frame.sequence,
                  .capture_time = frame.capture_time,
                  .latency_origin = frame.latency_origin};
    wrench_.estimate(track, sample);
    const TimePoint output = Clock::now();
    sample.output_time = output;
    feed_.sample(sample, &track);
    const TimePoint fed = Clock::now();
    const bool picture = feed_.wants_picture(output);
    const RawFrame raw{format_ == PixelFormat::yuyv ? fourcc("YUYV") : fourcc("GREY"), bytes, 0};
    if (picture) feed_.picture({frame, {}, raw, track, sample});
    const double cpu_end = thread_us();
    const TimePoint end = Clock::now();
    const auto us = [](Duration time) { return static_cast<double>(time.count()) * 1e-3; };
    times.output_us.push_back(us(output - begin));
    times.step_us.push_back(us(end - begin));
    times.cpu_us.push_back(cpu_end - cpu);
    times.feed_us.push_back(us(fed - output));
    if (picture) times.picture_us.push_back(us(end - fed));
    if (track.status != Status::ok) ++lost_;
  }

  sim::Scenario scenario_;
  PixelFormat format_;
  LiveFeed& feed_;
  SensorConfig sensor_;
  Decoder decoder_;
  Tracker tracker_;
  WrenchEstimator wrench_;
  std::vector<Bytes> clip_;
  Region wanted_;
  TimePoint next_{};
  std::uint64_t sequence_ = 0;
  int lost_ = 0;
};

void print_row(const char* name, const std::vector<double>& alone,
               const std::vector<double>& seen) {
  fmt::print("  {:<28}", name);
  for (const double share : {0.5, 0.99}) {
    const double before = quantile(alone, share);
    const double after = quantile(seen, share);
    fmt::print(" {:>8.1f} {:>8.1f} {:>+7.1f} %", before, after, 100 * (after / before - 1));
  }
  fmt::print("\n");
}

void measure(const char* title, PixelFormat format) {
  WebOptions options;
  options.port = 0;
  WebServer server(options);
  Silent handler(server);
  server.set_hello({{"type", "hello"}, {"protocol", 1}});
  server.start(handler);
  Loop loop(format, server.feed());
  Times warm;
  Times alone;
  Times seen;
  loop.begin();
  loop.turn(warm);
  for (int i = 0; i < kTurns; ++i) {
    loop.turn(alone);
    const Reader reader(server.port());
    while (!server.pictures_wanted()) std::this_thread::yield();
    loop.begin();
    loop.turn(seen);
  }
  server.stop();
  fmt::print("{}, {} frames each, {} of them without the target, {} pictures\n", title,
             alone.step_us.size(), loop.lost(), seen.picture_us.size());
  fmt::print("  {:<28} {:^27} {:^27}\n", "", "median", "99 of 100");
  fmt::print("  {:<28} {:>8} {:>8} {:>9} {:>8} {:>8} {:>9}\n", "us", "alone", "page", "", "alone",
             "page", "");
  print_row("frame to outputs", alone.output_us, seen.output_us);
  print_row("whole step", alone.step_us, seen.step_us);
  print_row("whole step, processor time", alone.cpu_us, seen.cpu_us);
  print_row("of it the live feed", alone.feed_us, seen.feed_us);
  fmt::print("  a picture's copy, of about every 12th frame: {:.1f}, at most {:.1f}\n\n",
             median(seen.picture_us), most(seen.picture_us));
}

}  // namespace
}  // namespace tagwrench::bench

int main(int argc, char** argv) {
  using namespace tagwrench;
  if (argc == 3 && std::string(argv[1]) == "--read")
    return bench::read_all(static_cast<std::uint16_t>(std::stoi(argv[2])));
  bench::measure("640x480 GREY at 120 Hz", PixelFormat::grey);
  bench::measure("640x480 YUYV at 120 Hz", PixelFormat::yuyv);
  return 0;
}

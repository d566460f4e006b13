// web_server_program [--token TOKEN] [--pages DIR] [--files DIR] [--rate HZ] [--hurry FACTOR]: the
// pages' server with a made-up sensor behind it, for tests of what comes over the wire. Prints its
// port; ends when standard input does.
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "host/web/server/live_feed.h"
#include "host/web/server/request_guard.h"
#include "host/web/server/web_server.h"

namespace {

using namespace tagwrench;
using nlohmann::json;

/// Answers what tests ask: echo, say, quiet (never answers), fail (throws).
class EchoHandler final : public PageRequestHandler {
 public:
  explicit EchoHandler(WebServer& server) : server_(server) {}

  void handle(PageRequest request) override {
    if (request.what == "fail") throw std::runtime_error("it fails");
    if (request.what == "say") {
      const int lines = request.arguments.value("lines", 1);
      for (int i = 0; i < lines; ++i)
        server_.send_all({{"type", "say"}, {"line", std::string(1000, 'x')}});
    }
    if (request.what == "memory") request.arguments["resident_kb"] = resident_kb();
    if (request.what == "quiet") return;
    request.arguments["pages"] = server_.pages();
    const LiveFigures figures = server_.figures();
    request.arguments["rate_hz"] = figures.rate_hz;
    request.arguments["latency_p99_us"] = figures.latency_p99_us;
    server_.answer(request.page, request.id, true, request.what, std::move(request.arguments));
  }

  void page_came(std::uint64_t page) override {
    server_.send(page, {{"type", "state"}, {"rate_hz", 0}, {"words", "no state yet"}});
  }

 private:
  static long resident_kb() {
    long pages = 0;
    if (FILE* const file = std::fopen("/proc/self/statm", "r")) {
      if (std::fscanf(file, "%*d %ld", &pages) != 1) pages = 0;
      std::fclose(file);
    }
    return pages * (::sysconf(_SC_PAGESIZE) / 1024);
  }

  WebServer& server_;
};

/// A push that comes and goes, and a picture with a square that moves.
class MadeUpSensor {
 public:
  MadeUpSensor(LiveFeed& feed, double rate_hz) : feed_(feed), period_s_(1 / rate_hz) {}

  void step() {
    const TimePoint now = std::chrono::steady_clock::now();
    const double t = static_cast<double>(sequence_) * period_s_;
    Sample sample{.sequence = sequence_++, .capture_time = now, .latency_origin = now};
    sample.status = Status::ok;
    sample.wrench << std::sin(t), std::cos(t), 1, 0.01 * std::sin(2 * t), 0, 0;
    sample.wrench_sigma.setConstant(0.01);
    sample.output_time = now + std::chrono::microseconds(500);
    Track track;
    track.status = Status::ok;
    track.residual_px = 0.02;
    track.tags_held = 2;
    track.corner_count = 1;
    track.corners[0] = {5, {100, 100, 200, 100, 200, 200, 100, 200}};
    feed_.sample(sample, &track);
    if (!feed_.wants_picture(now)) return;
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      pixels_[i] = static_cast<std::uint8_t>((i + sequence_) % 640 / 3);
    Frame frame;
    frame.image = {pixels_.data(), 640, 480, 640};
    frame.sequence = sample.sequence;
    feed_.picture({frame, {}, {fourcc("GREY"), pixels_, 640}, track, sample});
  }

  Duration period() const { return std::chrono::nanoseconds(std::llround(period_s_ * 1e9)); }

 private:
  LiveFeed& feed_;
  double period_s_;
  std::uint64_t sequence_ = 0;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(640 * 480);
};

/// What waits for seconds waits a part of it.
void hurry(WebPatience& patience, int factor) {
  for (Duration* time :
       {&patience.header, &patience.request, &patience.unread, &patience.ping, &patience.silence})
    *time /= factor;
}

}  // namespace

int main(int argc, char** argv) try {
  WebOptions options{.port = 0};
  double rate_hz = 100;
  std::string files;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    if (name == "--token") options.token = argv[i + 1];
    if (name == "--pages") options.pages = argv[i + 1];
    if (name == "--files") files = argv[i + 1];
    if (name == "--rate") rate_hz = std::stod(argv[i + 1]);
    if (name == "--hurry") hurry(options.patience, std::stoi(argv[i + 1]));
  }
  WebServer server(options);
  EchoHandler handler(server);
  if (!files.empty()) server.serve_folder("/files/recordings/", files);
  server.set_hello({{"type", "hello"}, {"protocol", 1}, {"version", "test"}, {"name", "made up"}});
  server.start(handler);
  std::cout << server.port() << std::endl;
  std::atomic<bool> stop{false};
  std::thread loop([&] {
    MadeUpSensor sensor(server.feed(), rate_hz);
    TimePoint next = std::chrono::steady_clock::now();
    while (!stop) {
      sensor.step();
      std::this_thread::sleep_until(next += sensor.period());
    }
  });
  char byte = 0;
  while (::read(STDIN_FILENO, &byte, 1) > 0) {
  }
  stop = true;
  loop.join();
  server.stop();  // before the handler goes
  return 0;
} catch (const std::exception& error) {
  std::cerr << "web_server_program: " << error.what() << '\n';
  return 2;
}

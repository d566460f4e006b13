#include "tests/bench/hid_live.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <numeric>
#include <optional>
#include <string>

#include "host/app/pipeline.h"
#include "host/output/line_outputs.h"
#include "host/output/spnav_output.h"
#include "host/sensor/sensor_config.h"
#include "tests/bench/hid_clip.h"
#include "tests/bench/hid_figures.h"
#include "tests/bench/hid_spnav.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::bench {
namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

constexpr double kRest = 1.2;  // s at the clip's beginning; the rest pose is learned from it
constexpr double kHeldFrom = kRest + 0.9;  // the ramp and its swing are over
constexpr double kHold = 1.8;
constexpr double kLetGo = kRest + 0.3 + kHold;
constexpr double kClip = kLetGo + 1.5;

sim::Scenario pushed(double fps) {
  sim::Scenario scenario;
  scenario.seed = 5;
  scenario.camera.frame_rate = fps;
  scenario.trajectory.motion = sim::Motion::push;
  scenario.trajectory.axis = 0;
  scenario.trajectory.rest_time = kRest;
  scenario.trajectory.hold_time = kHold;
  return scenario;
}

/// Which picture comes when: parts of a clip, repeated forth and back so that nothing jumps.
class Script {
 public:
  explicit Script(const HidClip& clip) : fps_(clip.fps), count_(clip.pictures.size()) {}

  Script& once(double from, double to) {
    for (std::size_t i = index(from); i < index(to); ++i) pictures.push_back(static_cast<int>(i));
    return *this;
  }
  Script& repeat(double from, double to, double seconds) {
    const auto first = static_cast<int>(index(from));
    const int span = static_cast<int>(index(to)) - first - 1;
    const int frames = static_cast<int>(seconds * fps_);
    for (int i = 0; i < frames; ++i) {
      const int phase = i % (2 * span);
      pictures.push_back(first + (phase <= span ? phase : 2 * span - phase));
    }
    return *this;
  }
  std::size_t frames() const { return pictures.size(); }

  std::vector<int> pictures;

 private:
  std::size_t index(double time) const {
    return std::min(count_, static_cast<std::size_t>(time * fps_));
  }
  double fps_;
  std::size_t count_;
};

/// Rest, a push that is held, and rest again.
Script press(const HidClip& clip, double rest, double held) {
  Script script(clip);
  script.once(0, kRest).repeat(0.2, kRest, rest).once(kRest, kHeldFrom);
  script.repeat(kHeldFrom, kLetGo - 0.1, held).once(kLetGo - 0.1, kClip);
  return script.repeat(kClip - 0.8, kClip, 1.5);
}

/// Notes what is handed to the outputs, and when.
class Probe final : public Output {
 public:
  struct Move {
    TimePoint time{};
    TimePoint origin{};
    std::uint64_t sequence = 0;
    bool zero = true;
  };
  Probe() { moves.reserve(1 << 16); }
  SendStatus move(const Sample& sample) noexcept override {
    const bool zero = spnav_counts(sample.deflection) == Counts6{};
    moves.push_back(
        {std::chrono::steady_clock::now(), sample.latency_origin, sample.sequence, zero});
    return SendStatus::ok;
  }
  bool notice(std::string_view) noexcept override { return true; }  // nobody reads along

  std::vector<Move> moves;
};

struct LiveFigures {
  std::vector<Probe::Move> moves;
  std::vector<SpnavEvent> events;
  double loop_cpu = 0;    ///< of one core
  double daemon_cpu = 0;  ///< of one core
  RunReport report;
};

/// Who is connected and never reads, and what waits for him in the end.
struct Bystanders {
  int slow_pipe = -1;  ///< write end; jsonl goes there
  int waiting_events = 0;
  bool then_zero = false;
};

std::vector<std::string> profile(const test::TemporaryFolder& folder, double rate_hz) {
  const std::string path = (folder / "rate.yaml").string();
  std::ofstream(path) << fmt::format("name: rate\nrate_hz: {}\n", rate_hz);
  return {path};
}

/// How many events wait for a program that never read, and whether the state after them is zero.
void drain(const UniqueFd& program, Bystanders& bystanders) {
  int bytes = 0;
  ::ioctl(program.get(), FIONREAD, &bytes);
  bystanders.waiting_events = bytes / 32;
  std::array<std::int32_t, 8> record{};
  for (pollfd more{program.get(), POLLIN, 0}; ::poll(&more, 1, 200) > 0;) {
    if (::recv(program.get(), record.data(), sizeof record, MSG_WAITALL) != sizeof record) return;
    if (record[0] == 0)
      bystanders.then_zero = std::all_of(record.begin() + 1, record.begin() + 7,
                                         [](std::int32_t count) { return count == 0; });
  }
}

LiveFigures run_live(const HidClip& clip, const Script& script, double rate_hz,
                     Bystanders* bystanders = nullptr) {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "spnav.sock").string();
  HidHolder daemon(path);
  SpnavListener listener(path);
  UniqueFd slow;
  if (bystanders != nullptr) slow = connect_as_program(path);

  ClipSource source(clip, script.pictures, static_cast<std::size_t>(1.5 * clip.fps));
  Tracker tracker(clip.sensor.camera, clip.sensor.target, clip.sensor.rest);
  WrenchEstimator wrench(clip.sensor.wrench);
  ProfileManager profiles(ProfileFiles(profile(folder, rate_hz), default_profile(clip.sensor)), {},
                          {});
  ZeroOptions zero_options;
  zero_options.range = clip.sensor.wrench.range;
  ZeroTracking zero(zero_options);
  Probe probe;
  SpnavOptions options;
  options.socket = path;
  std::optional<SpnavOutput> spnav(options);
  std::optional<JsonlOutput> jsonl;
  std::vector<Output*> outputs{&probe, &*spnav};
  if (bystanders != nullptr) {
    jsonl.emplace(fmt::format("/proc/self/fd/{}", bystanders->slow_pipe), /*lossless=*/false);
    outputs.push_back(&*jsonl);
  }
  Watchdog watchdog({});
  Pipeline pipeline(source, tracker, wrench, profiles, outputs, watchdog, /*stop_fd=*/-1);
  pipeline.follow_zero(zero);

  LiveFigures figures;
  const double daemon_before = daemon.cpu_seconds();
  figures.report = pipeline.run({});
  figures.daemon_cpu = (daemon.cpu_seconds() - daemon_before) /
                       std::chrono::duration<double>(figures.report.elapsed).count();
  if (bystanders != nullptr) drain(slow, *bystanders);
  figures.loop_cpu = source.cpu_share();
  figures.moves = probe.moves;
  jsonl.reset();
  spnav.reset();
  figures.events = listener.events();
  return figures;
}

/// The events of the whole push, from the first to the last that is not zero.
std::vector<double> intervals_ms(const std::vector<SpnavEvent>& events) {
  std::vector<double> out;
  for (std::size_t i = 1; i < events.size(); ++i) {
    if (events[i - 1].zero() || events[i].zero()) continue;
    out.push_back(Milliseconds(events[i].time - events[i - 1].time).count());
  }
  return out;
}

struct Latencies {
  std::vector<double> capture_ms;    ///< picture due to first event that knows it
  std::vector<double> transport_ms;  ///< handed to the outputs to event
};

/// Each event belongs to the last move before it.
Latencies latencies(const LiveFigures& live) {
  Latencies out;
  std::size_t next = 0;
  std::uint64_t known = 0;
  for (const SpnavEvent& event : live.events) {
    while (next < live.moves.size() && live.moves[next].time <= event.time) ++next;
    if (next == 0) continue;
    const Probe::Move& move = live.moves[next - 1];
    if (move.zero) continue;
    out.transport_ms.push_back(Milliseconds(event.time - move.time).count());
    if (move.sequence == known) continue;
    known = move.sequence;
    out.capture_ms.push_back(Milliseconds(event.time - move.origin).count());
  }
  return out;
}

std::string tail(const std::vector<double>& ms) {
  return fmt::format("median {:.2f} ms, p99 {:.2f}, worst {:.2f} of {}", median(ms),
                     quantile(ms, 0.99), most(ms), ms.size());
}

int idle_events(const LiveFigures& live, double rest) {
  const TimePoint from = live.moves.front().time + std::chrono::milliseconds(500);
  const TimePoint to =
      from + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(rest - 1));
  return static_cast<int>(
      std::count_if(live.events.begin(), live.events.end(),
                    [&](const SpnavEvent& e) { return e.time > from && e.time < to; }));
}

const std::vector<std::string> kAboutLive = {
    "The program's own loop in this process, its outputs, the spnav daemon and a program on its "
    "socket, live;",
    "640x480 GREY, rendered before, handed over as a camera's mapped buffers are (V4L2's own calls "
    "are not in it)."};

std::vector<std::string> about(const std::string& more) {
  std::vector<std::string> lines = kAboutLive;
  lines.push_back(more);
  return lines;
}

}  // namespace

void bench_socket(Table& table) {
  table.open("socket", about("A held push, and rest. From the instant a picture is there (exposure "
                             "and readout come before it)."));
  const double rest = 4;
  for (const double fps : {30.0, 120.0}) {
    const HidClip clip(pushed(fps), kClip);
    const LiveFigures each = run_live(clip, press(clip, 0.5, 5), 0);
    const Latencies direct = latencies(each);
    table.line(
        fmt::format("{:.0f} fps, a report for each picture: {}", fps, tail(direct.capture_ms)));
    table.line(fmt::format("  of this handed to outputs to event: {}", tail(direct.transport_ms)));
    table.at_most(
        fmt::format("{:.0f} fps: picture to event, median (a SpaceNavigator reports every 8 ms)",
                    fps),
        median(direct.capture_ms), 8, "ms");
  }
  const HidClip clip(pushed(30), kClip);
  const LiveFigures steady = run_live(clip, press(clip, rest, 10), 125);
  table.line(fmt::format("30 fps, 125 reports a second: {}", tail(latencies(steady).capture_ms)));
  const std::vector<double> gaps = intervals_ms(steady.events);
  const double rate =
      1e3 * static_cast<double>(gaps.size()) / std::accumulate(gaps.begin(), gaps.end(), 0.0);
  table.line(fmt::format("events while held: {:.2f}/s, interval {:.2f} +- {:.2f} ms, {}", rate,
                         median(gaps), deviation(gaps), tail(gaps)));
  table.at_least("rate while held (125/s asked)", rate, 124, "/s");
  table.at_most("interval, p99 (a wireless SpaceMouse's usual one)", quantile(gaps, 0.99), 16,
                "ms");
  table.at_most(fmt::format("events in {:.0f} s at rest", rest - 1), idle_events(steady, rest), 0,
                "");
}

void bench_slow(Table& table) {
  table.open("slow", about("Beside it a program on the socket and a reader of jsonl that never "
                           "read, through rest, a push of 5 s and its release."));
  int pipe[2];
  if (::pipe2(pipe, O_CLOEXEC | O_NONBLOCK) != 0) {
    table.skipped("slow", "no pipe to be had");
    return;
  }
  const UniqueFd reader(pipe[0]);
  const UniqueFd writer(pipe[1]);
  Bystanders slow{.slow_pipe = writer.get()};
  const HidClip clip(pushed(30), kClip);
  const LiveFigures live = run_live(clip, press(clip, 1, 5), 125, &slow);
  const std::vector<double> gaps = intervals_ms(live.events);
  table.at_most("interval of events for the one that reads, p99", quantile(gaps, 0.99), 16, "ms");
  table.line(
      "spnav keeps a queue for who does not read, on purpose: who draws slowly loses no motion.");
  table.at_most("spnav: events in it", slow.waiting_events, 0, "events");
  table.at_least("spnav: what comes after these is the state as it is, zero",
                 slow.then_zero ? 1 : 0, 1, "");
  int bytes = 0;
  ::ioctl(reader.get(), FIONREAD, &bytes);
  std::vector<char> text(static_cast<std::size_t>(bytes));
  const ssize_t got = ::read(reader.get(), text.data(), text.size());
  const auto lines = std::count(text.begin(), text.begin() + std::max<ssize_t>(got, 0), '\n');
  table.line(
      fmt::format("jsonl: {} lines wait in the kernel's pipe, {} were skipped: data, whose "
                  "gaps show in seq",
                  lines, live.report.skipped));
}

void bench_cpu(Table& table) {
  table.open("cpu", about("The platform moves on all axes at up to 1 Hz over half of its range. "
                          "Thread clock of the loop, of one core."));
  struct Case {
    double fps, limit;
  };
  for (const Case& c : {Case{30, 3}, Case{120, 10}}) {
    sim::Scenario scenario;
    scenario.seed = 5;
    scenario.camera.frame_rate = c.fps;
    scenario.trajectory.rest_time = kRest;
    const HidClip clip(scenario, kRest + 2);
    Script script(clip);
    script.once(0, kRest).repeat(kRest, kRest + 2, 10);
    const LiveFigures live = run_live(clip, script, 125);
    table.line(
        fmt::format("{:.0f} fps: {} pictures, {} with numbers, {} lost; {} events; the "
                    "daemon takes {:.2f} % more",
                    c.fps, live.report.frames, live.report.with_numbers, live.report.dropped,
                    live.events.size(), 100 * live.daemon_cpu));
    table.at_most(fmt::format("{:.0f} fps: processor time of the loop", c.fps), 100 * live.loop_cpu,
                  c.limit, "%");
  }
}

}  // namespace tagwrench::bench

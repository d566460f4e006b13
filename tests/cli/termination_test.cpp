// Ctrl-C, kill and a closed terminal end every command that runs until it is stopped, as that
// command has it: also where a library has started a thread that takes signals, and with Ctrl-C
// ignored, as shells have it for a script's background jobs.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <functional>
#include <memory>

#include "tests/cli/bridge.h"
#include "tests/cli/served_board.h"
#include "tests/unit/board/optoforce_frames.h"
#include "tests/unit/board/pty.h"

namespace tagwrench::test {
namespace {

constexpr int kLines = 3;  // as many show that it runs

/// A command, and what shows that it has taken charge of signals.
struct Verb {
  std::vector<std::string> arguments;
  std::string message = "";  ///< on standard error; empty: lines on standard output
  int status = 0;
  std::string last_words = "";  ///< on standard error
  std::string input = "/dev/null";
  std::function<void()> before = [] {};  ///< every start
  int lines = kLines;
};

class Termination : public testing::Test {
 protected:
  Termination() {
    ::setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    ::setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
    for (const char* name : {"SWAYSOCK", "I3SOCK", "WAYLAND_DISPLAY", "DISPLAY", "NOTIFY_SOCKET"})
      ::unsetenv(name);
  }

  static Surroundings alone(const Verb& verb) { return {.input = verb.input}; }
  /// With a thread of a library that takes all signals.
  static Surroundings with_foreign_thread(const Verb& verb) {
    return {.input = verb.input, .environment = {"LD_PRELOAD=" TAGWRENCH_FOREIGN_THREAD}};
  }
  static void await(Bridge& program, const Verb& verb) {
    const bool runs = verb.message.empty() ? program.wait_for_lines(verb.lines)
                                           : program.wait_for_message(verb.message);
    ASSERT_TRUE(runs) << program.err();
  }
  static pid_t foreign_thread(const Bridge& program) {
    const std::vector<pid_t> threads = program.threads("foreign");
    return threads.empty() ? -1 : threads.front();
  }
  static void expect_end(Bridge& program, const Verb& verb) {
    const Outcome outcome = program.finish();
    EXPECT_EQ(outcome.status, verb.status) << outcome.err;
    EXPECT_NE(outcome.err.find(verb.last_words), std::string::npos) << outcome.err;
  }

  /// All signals, in all the ways in which they can come. Without another thread there is but one
  /// that they can come to, which what is ignored shows too.
  static void expect_ends(const Verb& verb) {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
      SCOPED_TRACE(verb.arguments.front() + ", " + ::strsignal(number));
      expect_ends_beside_foreign_thread(verb, number);
    }
    expect_ignores_what_is_ignored(verb);
  }

  static void expect_ends_beside_foreign_thread(const Verb& verb, int number) {
    for (const bool to_the_thread : {false, true}) {
      SCOPED_TRACE(to_the_thread ? "sent to a library's thread" : "beside a library's thread");
      verb.before();
      Bridge program(verb.arguments, with_foreign_thread(verb));
      ASSERT_NO_FATAL_FAILURE(await(program, verb));
      const pid_t thread = foreign_thread(program);
      ASSERT_GT(thread, 0);
      if (to_the_thread) {
        program.signal_thread(thread, number);
      } else {
        program.signal(number);
      }
      expect_end(program, verb);
    }
  }

  static void expect_ignores_what_is_ignored(const Verb& verb) {
    SCOPED_TRACE(verb.arguments.front() + ", Ctrl-C ignored");
    Surroundings background = alone(verb);
    background.ignored = {SIGINT};
    verb.before();
    Bridge program(verb.arguments, background);
    ASSERT_NO_FATAL_FAILURE(await(program, verb));
    EXPECT_TRUE(ignores(program.pid(), SIGINT));
    program.signal(SIGINT);
    if (verb.message.empty()) {
      const auto lines = static_cast<std::ptrdiff_t>(lines_in(program.out()));
      EXPECT_TRUE(program.wait_for_lines(lines + verb.lines)) << "it goes on";
    }
    program.signal(SIGTERM);
    expect_end(program, verb);
  }

  static bool ignores(pid_t process, int number) {
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("SigIgn:"))
        return (std::stoull(line.substr(7), nullptr, 16) >> (number - 1) & 1) != 0;
    }
    return false;
  }

  std::string path(const std::string& name) const { return folder_ / name; }
  /// What is there beside what a test has put there: sockets that were left.
  std::vector<std::string> sockets() const {
    std::vector<std::string> found;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder_.path())) {
      if (file.is_socket()) found.push_back(file.path());
    }
    return found;
  }

  TemporaryFolder folder_;
};

TEST_F(Termination, EndsARun) {
  expect_ends({.arguments = {"run", "--source", "sim", "--output", "jsonl:-", "--output",
                             "csv:" + path("out.csv"), "--output", "web:127.0.0.1:0"},
               .last_words = " frames in "});
  EXPECT_EQ(sockets(), std::vector<std::string>());
}

TEST_F(Termination, EndsARunWhoseReaderIsSlow) {
  expect_ends({.arguments = {"run", "--source", "sim", "--fast", "--output", "jsonl:-"},
               .last_words = " frames in "});
}

TEST_F(Termination, EndsTheWaitForACamera) {
  expect_ends({.arguments = {"run", "--wait", "--source", "v4l2:/dev/video-of-nobody", "--output",
                             "jsonl:" + path("out")},
               .message = "waiting"});
}

TEST_F(Termination, EndsARecording) {
  const std::string file = path("trial.twr");
  expect_ends({.arguments = {"record", "--source", "sim", "--output", "jsonl:-", "--out", file},
               .last_words = " frames in ",
               .before = [&] { std::filesystem::remove(file); }});
}

TEST_F(Termination, EndsTheWaitForADeviceToRead) {
  expect_ends({.arguments = {"read", "no-such-serial-71c2", "--wait"}, .message = "waiting for"});
}

TEST_F(Termination, EndsTheDaemonOfTheSpnavSocketWhichTakesItAway) {
  expect_ends({.arguments = {"spnav", "--socket", path("spnav.sock")}, .message = "serving"});
  EXPECT_EQ(sockets(), std::vector<std::string>());
}

TEST_F(Termination, EndsTheFocusGuide) {
  // A line is what it measured over many pictures.
  expect_ends({.arguments = {"doctor", "--focus", "--source", "sim"}, .lines = 1});
}

TEST_F(Termination, EndsABandwidthMeasurementWithoutAReport) {
  expect_ends(
      {.arguments = {"camera-timing", "--source", "sim:" TAGWRENCH_SCENARIOS "/camera_timing.yaml",
                     "--port", "sim", "--seconds", "20"},
       .message = "LED steady",
       .status = 1,
       .last_words = "stopped"});
}

TEST_F(Termination, EndsWhatTalksToABoard) {
  link::ServedBoard board;
  const std::string keys = path("keys");
  ASSERT_EQ(::mkfifo(keys.c_str(), 0600), 0);
  const UniqueFd keyboard(::open(keys.c_str(), O_RDWR | O_CLOEXEC));
  const std::string port = board.path();
  expect_ends({.arguments = {"board", "watch", "--json", "--port", port}});
  for (const Verb& verb :
       {Verb{.arguments = {"board", "log", "--out", path("log.csv"), "--port", port},
       .message = "Ctrl-C ends it",
       .last_words = "written to"},
        Verb{.arguments = {"board", "led", "20%", "--port", port},
        .message = "the light stays until Ctrl-C"},
        Verb{.arguments = {"board", "calibrate-cell", "--channel", "0", "--mass", "0,0.5", "--port",
                           port},
        .message = "take everything off",
        .last_words = "nothing was changed",
        .input = keys},
        Verb{.arguments = {"run", "--source", "sim", "--board", port, "--output", "jsonl:-"},
        .last_words = " frames in "}}) {
    expect_ends_beside_foreign_thread(verb, SIGINT);
    expect_ignores_what_is_ignored(verb);
  }
  EXPECT_TRUE(board.wait_for([](const link::BoardModel& model) {
    return !model.leds.empty() && model.leds.back().mode == link::LedMode::off;
  }));
}

TEST_F(Termination, EndsWhatReadsAnOptoforceSensor) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    link::Pty device;
    const Verb verb{.arguments = {"board", "optoforce", "--json", "--port", device.path(),
                                  "--counts-per-unit", "100,100,20,5000,5000,8000"}};
    Bridge program(verb.arguments, with_foreign_thread(verb));
    ASSERT_TRUE(link::readable(device.fd(), 20'000)) << "it is configured";
    for (std::uint16_t counter = 0; !program.has_lines(kLines); ++counter) {
      device.write(link::optoforce_frame(counter, 0, {150, 0, 0, 0, 0, 0}));
      ::poll(nullptr, 0, 10);  // the sensor's own pace
    }
    program.signal(number);
    expect_end(program, verb);
  }
}

/// A sensor in motion for a minute: what waits for rest, or looks at it for long, goes on.
class TerminationOfACalibration : public Termination {
 protected:
  void SetUp() override {
    constexpr int kRendered = 40, kAtRest = 30, kShown = 1500;
    write_file(path("scenario.yaml"), "seed: 3\ntrajectory: {rest_s: 1.2}\n");
    ASSERT_EQ(run_bridge({"sim", "--scenario", path("scenario.yaml"), "--out", path("frames"),
                          "--frames", std::to_string(kRendered)})
                  .status,
              0);
    std::filesystem::create_directory(path("long"));
    const auto name = [](int frame) {
      const std::string number = std::to_string(frame);
      return "/" + std::string(6 - number.size(), '0') + number + ".png";
    };
    for (int i = 0; i < kShown; ++i) {
      const int frame = i < kAtRest ? i : kAtRest + i % (kRendered - kAtRest);
      std::filesystem::create_symlink(path("frames") + name(frame), path("long") + name(i));
    }
    std::filesystem::copy(path("frames") + "/sensor.yaml", path("sensor.yaml"));
  }
  static void expect_stops(const Verb& verb) {
    expect_ends_beside_foreign_thread(verb, SIGINT);
    expect_ends_beside_foreign_thread(verb, SIGHUP);
    expect_ignores_what_is_ignored(verb);
  }
};

TEST_F(TerminationOfACalibration, EndsItWithStatusOneAndWritesNothing) {
  const std::string before = read_file(path("sensor.yaml"));
  expect_stops({.arguments = {"calibrate", "target", "--sensor", path("sensor.yaml"), "--source",
                              "images:" + path("long")},
                .message = "hands off until",
                .status = 1,
                .last_words = "stopped; nothing was written"});
  EXPECT_EQ(read_file(path("sensor.yaml")), before);
  ASSERT_EQ(run_bridge({"record", "--source", "images:" + path("long"), "--frames", "60", "--fast",
                        "--keep", "raw", "--out", path("views.twr")})
                .status,
            0);
  expect_stops(
      {.arguments = {"calibrate", "camera", "--board", "charuco:9x6:1.2mm:0.9mm:aruco_4x4_50",
                     "--sensor", path("sensor.yaml"), "--source", "recording:" + path("views.twr")},
       .message = "show the board",
       .status = 1,
       .last_words = "stopped; nothing was written"});
  EXPECT_EQ(read_file(path("sensor.yaml")), before);
  const std::vector<std::string> wrench = {"calibrate", "wrench", "--sensor", path("sensor.yaml"),
                                           "--source",  "sim",    "--plan",   "six_orientations"};
  Bridge program(wrench, with_foreign_thread({}));
  ASSERT_TRUE(program.wait_for_message("accepted: step 1")) << program.err();
  program.signal(SIGTERM);
  EXPECT_EQ(program.finish().status, 1);
}

TEST_F(TerminationOfACalibration, EndsCheckAndZeroWithStatusOne) {
  const Outcome calibrated =
      run_bridge({"calibrate", "target", "--sensor", path("sensor.yaml"), "--source",
                  "sim:" + path("scenario.yaml"), "--frames", "90"});
  ASSERT_EQ(calibrated.status, 0) << calibrated.err;
  for (const char* verb : {"check", "zero"}) {
    expect_stops(
        {.arguments = {verb, "--sensor", path("sensor.yaml"), "--source", "images:" + path("long")},
         .message = "hands off",
         .status = 1,
         .last_words = "stopped"});
  }
}

TEST_F(Termination, LeavesNothingBehind) {
  const UniqueFd systemd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{AF_UNIX, {}};
  path("notify").copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(systemd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const Verb verb{.arguments = {"run", "--source", "sim", "--profile", "cad", "--output", "jsonl:-",
                                "--output", "csv:" + path("out.csv")},
                  .last_words = " frames in "};
  Surroundings service = with_foreign_thread(verb);
  service.environment.push_back("NOTIFY_SOCKET=" + path("notify"));
  Bridge program(verb.arguments, service);
  ASSERT_NO_FATAL_FAILURE(await(program, verb));
  EXPECT_EQ(sockets().size(), 2u) << "ours and that of `tagwrench control`";
  program.signal_thread(foreign_thread(program), SIGTERM);
  expect_end(program, verb);
  EXPECT_EQ(sockets(), std::vector<std::string>{path("notify")});
  EXPECT_TRUE(read_file(path("out.csv")).ends_with("\n"));
  EXPECT_TRUE(program.out().ends_with("}\n"));
  std::string told;
  char text[1024];
  for (ssize_t size; (size = ::recv(systemd.get(), text, sizeof text, MSG_DONTWAIT)) > 0;)
    told.append(text, static_cast<std::size_t>(size)) += '\n';
  EXPECT_TRUE(told.ends_with("STOPPING=1\n")) << told;
}

TEST_F(Termination, ArrivesThoughTheProgramWasStartedWithItBlocked) {
  const Verb verb{.arguments = {"run", "--source", "sim", "--output", "jsonl:-"},
                  .last_words = " frames in "};
  Bridge program(verb.arguments, Surroundings{.blocked = {SIGINT, SIGTERM, SIGHUP}});
  ASSERT_NO_FATAL_FAILURE(await(program, verb));
  program.signal(SIGTERM);
  expect_end(program, verb);
}

TEST_F(Termination, ArrivesAndFramesGoOnThoughNobodyReadsStandardError) {
  const std::string full = path("full");
  ASSERT_EQ(::mkfifo(full.c_str(), 0600), 0);
  const UniqueFd pipe(::open(full.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  const std::string page(4096, 'x');
  while (::write(pipe.get(), page.data(), page.size()) > 0) continue;
  Bridge program({"run", "--source", "sim", "--output", "jsonl:-"}, Surroundings{.error = full});
  ASSERT_TRUE(program.wait_for_lines(60)) << "of which it has told by then that the rest is known";
  program.signal(SIGTERM);
  EXPECT_EQ(program.finish().status, 0);
}

TEST_F(Termination, HasOneThreadToComeToBesideOpenBlas) {
  Bridge program({"run", "--source", "sim", "--output", "jsonl:-"});
  ASSERT_TRUE(program.wait_for_lines(kLines));
  if (read_file("/proc/" + std::to_string(program.pid()) + "/maps").find("openblas") ==
      std::string::npos)
    GTEST_SKIP() << "OpenBLAS is not what this machine has: apt install libopenblas0-pthread";
  EXPECT_EQ(program.threads().size(), 1u);
}

}  // namespace
}  // namespace tagwrench::test

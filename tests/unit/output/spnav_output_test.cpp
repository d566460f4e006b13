// The output and the daemon that it starts: the real program, killed and stopped.
#include "host/output/spnav_output.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <memory>

#include "host/core/config_error.h"
#include "tests/cli/bridge.h"
#include "tests/unit/output/spnav_rig.h"

namespace tagwrench {
namespace {

using test::BridgeByHand;
using test::SpnavFolder;
using test::SpnavProgramByHand;

Sample pushed(double x, std::uint32_t buttons = 0) {
  Sample sample;
  sample.status = Status::ok;
  sample.deflection[0] = x;
  sample.buttons = buttons;
  return sample;
}

SpnavOptions options_at(const std::string& socket) {
  SpnavOptions options;
  options.socket = socket;
  options.program = TAGWRENCH_PROGRAM;
  return options;
}

pid_t daemon_of(const std::string& socket) {
  const UniqueFd link = connect_spnav_bridge(socket);
  std::array<std::uint8_t, kSpnavLongestMessage> buffer;
  if (!link || !test::readable(link.get())) return 0;
  const auto greeting = spnav_message<SpnavGreeting>(receive_spnav(link.get(), buffer).bytes);
  return greeting ? greeting->daemon_pid : 0;
}

/// Ends the daemon that a test has had started, and waits until it has taken its sockets away.
class SpnavOutputTest : public ::testing::Test {
 protected:
  ~SpnavOutputTest() override {
    const UniqueFd link = connect_spnav_bridge(folder_.socket());
    std::array<std::uint8_t, kSpnavLongestMessage> buffer;
    while (link && test::readable(link.get())) {
      const SpnavReceived received = receive_spnav(link.get(), buffer);
      if (!received.open) return;
      const auto greeting = spnav_message<SpnavGreeting>(received.bytes);
      if (greeting) ::kill(greeting->daemon_pid, SIGTERM);
    }
  }
  SpnavFolder folder_;
};

/// A bridge in a process of its own that pushes until it is killed.
class PushingProcess {
 public:
  explicit PushingProcess(const std::string& socket) : pid_(::fork()) {
    if (pid_ != 0) return;
    try {
      SpnavOutput output(options_at(socket));
      while (true) {
        output.move(pushed(1, 1));
        ::poll(nullptr, 0, 8);
      }
    } catch (const std::exception&) {
      ::_exit(1);
    }
  }
  PushingProcess(const PushingProcess&) = delete;
  PushingProcess& operator=(const PushingProcess&) = delete;
  ~PushingProcess() {
    signal(SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  void signal(int number) const { ::kill(pid_, number); }

 private:
  pid_t pid_;
};

/// Connects as soon as there is somebody.
std::unique_ptr<SpnavProgramByHand> connect_when_served(const std::string& socket) {
  for (int i = 0; i < 2000; ++i) {
    try {
      return std::make_unique<SpnavProgramByHand>(socket);
    } catch (const std::runtime_error&) {
      ::poll(nullptr, 0, 10);
    }
  }
  throw std::runtime_error("nobody serves " + socket);
}

TEST_F(SpnavOutputTest, StartsADaemonAndFeedsIt) {
  SpnavOutput output(options_at(folder_.socket()));
  SpnavProgramByHand program(folder_.socket());
  EXPECT_EQ(output.move(pushed(0.5)), SendStatus::ok);
  EXPECT_TRUE(program.wait_for_motion({250, 0, 0, 0, 0, 0}));
  EXPECT_EQ(output.move(pushed(0)), SendStatus::ok);
  EXPECT_TRUE(program.wait_for_zero());
}

TEST_F(SpnavOutputTest, IsNeutralWithoutNumbers) {
  SpnavOutput output(options_at(folder_.socket()));
  SpnavProgramByHand program(folder_.socket());
  output.move(pushed(1, 0b11));
  EXPECT_TRUE(program.wait_for_motion({500, 0, 0, 0, 0, 0}));
  Sample lost = pushed(1, 0b11);
  lost.status = Status::lost;
  output.move(lost);
  EXPECT_TRUE(program.wait_for_type(2));
  EXPECT_TRUE(program.wait_for_type(2));
  EXPECT_TRUE(program.wait_for_zero());
}

TEST_F(SpnavOutputTest, TellsWhichProgramsAreConnected) {
  SpnavOutput output(options_at(folder_.socket()));
  auto program = std::make_unique<SpnavProgramByHand>(folder_.socket());
  ASSERT_TRUE(test::readable(output.poll_fd()));
  EXPECT_EQ(output.service(),
            "spnav: spnav_test (process " + std::to_string(::getpid()) + ") has connected");
  ASSERT_EQ(output.programs().size(), 1U);
  program.reset();
  ASSERT_TRUE(test::readable(output.poll_fd()));
  EXPECT_NE(output.service().find("has gone"), std::string_view::npos);
  EXPECT_TRUE(output.programs().empty());
  EXPECT_TRUE(output.service().empty());
}

TEST_F(SpnavOutputTest, ASecondBridgeIsRefusedInOneLineThatNamesTheFirst) {
  const SpnavOutput output(options_at(folder_.socket()));
  try {
    const SpnavOutput second(options_at(folder_.socket()));
    FAIL() << "not refused";
  } catch (const ConfigError& e) {
    const std::string line = e.what();
    EXPECT_NE(line.find(std::to_string(::getpid())), std::string::npos) << line;
    EXPECT_NE(line.find(folder_.socket()), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

TEST_F(SpnavOutputTest, AKilledBridgeIsNeutralAndTheNextOneMovesTheSameConnection) {
  std::unique_ptr<SpnavProgramByHand> program;
  {
    const PushingProcess bridge(folder_.socket());
    program = connect_when_served(folder_.socket());
    ASSERT_TRUE(program->wait_for_type(1));
    ASSERT_TRUE(program->wait_for_motion({500, 0, 0, 0, 0, 0}));
  }  // kill -9
  EXPECT_TRUE(program->wait_for_type(2));
  EXPECT_TRUE(program->wait_for_zero());
  SpnavOutput next(options_at(folder_.socket()));
  next.move(pushed(-1));
  EXPECT_TRUE(program->wait_for_motion({-500, 0, 0, 0, 0, 0}));
}

TEST_F(SpnavOutputTest, OfThe80MsUntilAHungBridgeRestsAThirdIsLeftToWakeUp) {
  std::optional<SpnavSockets> sockets = listen_spnav(folder_.socket());
  ASSERT_TRUE(sockets);
  UniqueFd link;
  std::thread daemon([&] {
    link.reset(::accept(sockets->bridge.get(), nullptr, nullptr));
    EXPECT_TRUE(send_spnav(link.get(), SpnavGreeting{}));
  });
  std::uint32_t least_ms = 1000;  // a busy machine's moves are farther apart, and hold longer
  {
    SpnavOutput output(options_at(folder_.socket()));
    daemon.join();
    std::array<std::uint8_t, kSpnavLongestMessage> buffer;
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(output.move(pushed(0.5)), SendStatus::ok);
      std::optional<SpnavUpdate> update;
      while (!update) {  // a hello comes first
        ASSERT_TRUE(test::readable(link.get()));
        update = spnav_message<SpnavUpdate>(receive_spnav(link.get(), buffer).bytes);
      }
      least_ms = std::min(least_ms, update->valid_ms);
    }
  }
  sockets->remove();
  EXPECT_GT(least_ms, 40U) << "ms: a loop may be busy for that long";
  EXPECT_LE(least_ms, 54U) << "ms";
}

TEST_F(SpnavOutputTest, AStoppedBridgeIsNeutralUntilItGoesOn) {
  const PushingProcess bridge(folder_.socket());
  const auto program = connect_when_served(folder_.socket());
  ASSERT_TRUE(program->wait_for_motion({500, 0, 0, 0, 0, 0}));
  bridge.signal(SIGSTOP);
  EXPECT_TRUE(program->wait_for_zero());
  bridge.signal(SIGCONT);
  EXPECT_TRUE(program->wait_for_motion({500, 0, 0, 0, 0, 0}));
}

TEST_F(SpnavOutputTest, AStoppedDaemonIsToldByItsNumber) {
  { const SpnavOutput first(options_at(folder_.socket())); }
  const pid_t daemon = daemon_of(folder_.socket());
  ASSERT_GT(daemon, 0);
  ::kill(daemon, SIGSTOP);
  std::string fault = "none";
  try {
    const SpnavOutput second(options_at(folder_.socket()));
  } catch (const ConfigError& e) {
    fault = e.what();
  }
  ::kill(daemon, SIGCONT);
  EXPECT_NE(fault.find("kill -CONT " + std::to_string(daemon)), std::string::npos) << fault;
}

TEST_F(SpnavOutputTest, AKilledDaemonIsReplaced) {
  SpnavOutput output(options_at(folder_.socket()));
  const pid_t first = daemon_of(folder_.socket());
  ASSERT_GT(first, 0);
  SpnavProgramByHand program(folder_.socket());
  ::kill(first, SIGKILL);
  ASSERT_TRUE(program.closed());
  std::string status_line;
  while (status_line.find("has ended") == std::string::npos) {
    ASSERT_TRUE(test::readable(output.poll_fd()));
    status_line = output.service();
  }
  // As the loop does it: moves, and answers when there is something to answer.
  SendStatus status = SendStatus::skipped;
  for (int i = 0; i < 2000 && status != SendStatus::ok; ++i) {
    status = output.move(pushed(1));
    pollfd entry{output.poll_fd(), POLLIN, 0};
    if (::poll(&entry, 1, 10) > 0) output.service();
  }
  ASSERT_EQ(status, SendStatus::ok);
  EXPECT_NE(daemon_of(folder_.socket()), first);
  SpnavProgramByHand again(folder_.socket());
  output.move(pushed(0.5));
  EXPECT_TRUE(again.wait_for_motion({250, 0, 0, 0, 0, 0}));
}

TEST_F(SpnavOutputTest, ADaemonThatCannotBeStartedIsSaidAtOnce) {
  SpnavOptions options = options_at(folder_.socket());
  options.program = "/no/such/program";
  EXPECT_THROW(SpnavOutput{options}, ConfigError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(SpnavOutputTest, TheVerbServesUntilASignalAndLeavesNothing) {
  test::Bridge daemon({"spnav", "--socket", folder_.socket()});
  ASSERT_TRUE(daemon.wait_for_message("serving " + folder_.socket()));
  SpnavProgramByHand program(folder_.socket());
  {
    SpnavOutput output(options_at(folder_.socket()));
    output.move(pushed(1));
    EXPECT_TRUE(program.wait_for_motion({500, 0, 0, 0, 0, 0}));
  }
  EXPECT_TRUE(program.wait_for_zero());
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.finish().status, 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(SpnavOutputTest, TheVerbIsRefusedWhereOneServesAlready) {
  test::Bridge daemon({"spnav", "--socket", folder_.socket()});
  ASSERT_TRUE(daemon.wait_for_message("serving"));
  const test::Outcome second = test::run_bridge({"spnav", "--socket", folder_.socket()});
  EXPECT_EQ(second.status, 2);
  EXPECT_EQ(test::lines_in(second.err), 1U) << second.err;
  EXPECT_NE(second.err.find(folder_.socket()), std::string::npos) << second.err;
  EXPECT_EQ(second.out, "");
}

}  // namespace
}  // namespace tagwrench

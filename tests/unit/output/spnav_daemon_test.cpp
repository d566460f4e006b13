#include "host/output/spnav_daemon.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "host/core/config_error.h"
#include "tests/unit/output/spnav_rig.h"

namespace tagwrench {
namespace {

using test::BridgeByHand;
using test::DaemonThread;
using test::SpnavFolder;
using test::SpnavProgramByHand;
using test::Words;

class SpnavDaemonTest : public ::testing::Test {
 protected:
  SpnavFolder folder_;
};

Words motion_of(const Words& words) {
  Words six = words;
  six[7] = 0;
  return six;
}

TEST_F(SpnavDaemonTest, PassesOnOneEventForEveryUpdateOffCentreAndOneForRest) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
  bridge.show({});
  for (int i = 0; i < 3; ++i) bridge.show({1, -2, 3, -4, 5, -500});
  for (int i = 0; i < 3; ++i) bridge.show({});
  bridge.show({7, 0, 0, 0, 0, 0});
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(motion_of(program.next().value()), (Words{0, 1, -2, 3, -4, 5, -500}));
  EXPECT_EQ(motion_of(program.next().value()), Words{});
  EXPECT_EQ(motion_of(program.next().value()), (Words{0, 7}));
}

TEST_F(SpnavDaemonTest, TellsPressesAndReleases) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
  bridge.show({}, 0b1000'0000'0000'0001);
  bridge.show({}, 0b1000'0000'0000'0001);
  bridge.show({}, 0b0000'0000'0000'0010);
  bridge.show({}, 0);
  for (const Words& expected :
       {Words{1, 0, 1}, {1, 15, 1}, {2, 0, 0}, {1, 1, 1}, {2, 15, 0}, {2, 1, 0}})
    EXPECT_EQ(program.next().value(), expected);
}

TEST_F(SpnavDaemonTest, ServesAProgramOfVersion0ThatNeverSaysAWord) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand program(folder_.socket(), 0);
  std::optional<Words> event;
  for (int i = 0; i < 2000 && !event; ++i) {  // it has some time to speak, and does not
    bridge.show({0, 0, 9, 0, 0, 0});
    event = program.next(10);
  }
  EXPECT_EQ(motion_of(event.value()), (Words{0, 0, 0, 9}));
}

TEST_F(SpnavDaemonTest, SendsNothingBeforeTheVersionIsSettled) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand first(folder_.socket());
  SpnavProgramByHand late(folder_.socket(), 0);
  bridge.show({5, 0, 0, 0, 0, 0});
  ASSERT_TRUE(first.wait_for_motion({5, 0, 0, 0, 0, 0}));
  const std::uint32_t request = 0x7faa5501;
  late.say(&request, sizeof request);
  std::uint32_t answer = 0;
  ASSERT_TRUE(test::readable(late.fd()));
  ASSERT_EQ(::recv(late.fd(), &answer, sizeof answer, 0), 4);
  EXPECT_EQ(answer, request) << "libspnav takes the first four bytes for the answer";
}

TEST_F(SpnavDaemonTest, ASlowProgramGetsFewOldEventsAndThenTheNewest) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand slow(folder_.socket());
  SpnavProgramByHand prompt(folder_.socket());
  constexpr std::int16_t kUpdates = 400;
  for (std::int16_t i = 1; i <= kUpdates; ++i) {
    bridge.show({i, 0, 0, 0, 0, 0});
    ASSERT_TRUE(prompt.wait_for_motion({i, 0, 0, 0, 0, 0}));
  }
  int seen = 0;
  ASSERT_TRUE(slow.wait_for([&](const Words& words) {
    ++seen;
    return words[1] == kUpdates;
  })) << "the newest comes without a further update";
  EXPECT_LE(seen, 40) << "of " << kUpdates << " events";
  EXPECT_GE(seen, 10);
}

TEST_F(SpnavDaemonTest, NoReleaseIsLostToASlowProgram) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand slow(folder_.socket());
  SpnavProgramByHand prompt(folder_.socket());
  bridge.show({1, 0, 0, 0, 0, 0}, 0b101);
  for (std::int16_t i = 1; i <= 300; ++i) bridge.show({i, 0, 0, 0, 0, 0}, 0b101);
  bridge.show({});
  ASSERT_TRUE(prompt.wait_for_zero());
  int pressed = 0;
  ASSERT_TRUE(slow.wait_for([&](const Words& words) {
    pressed += words[0] == 1 ? 1 : words[0] == 2 ? -1 : 0;
    return words[0] == 0 && motion_of(words) == Words{};
  }));
  EXPECT_EQ(pressed, 0) << "releases come before the zero";
}

TEST_F(SpnavDaemonTest, GarbageHarmsNobodyElse) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand good(folder_.socket());
  SpnavProgramByHand old(folder_.socket(), 0);
  SpnavProgramByHand modern(folder_.socket());
  std::mt19937 random(1);
  for (int i = 0; i < 64; ++i) {
    std::array<std::uint32_t, 64> garbage;
    for (std::uint32_t& word : garbage) word = random();
    old.say(garbage.data(), sizeof garbage);
    // It does not read the answers: what is not taken is left in the kernel.
    ::send(modern.fd(), garbage.data(), sizeof garbage - 3, MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  bridge.show({0, 3, 0, 0, 0, 0});
  EXPECT_TRUE(good.wait_for_motion({0, 3, 0, 0, 0, 0}));
}

TEST_F(SpnavDaemonTest, ServesAHundredProgramsAndSurvivesTheirGoing) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  for (std::int16_t round = 1; round <= 3; ++round) {
    std::vector<std::unique_ptr<SpnavProgramByHand>> programs;
    for (int i = 0; i < 100; ++i)
      programs.push_back(std::make_unique<SpnavProgramByHand>(folder_.socket()));
    bridge.show({round, 0, 0, 0, 0, 0});
    for (const auto& program : programs)
      EXPECT_TRUE(program->wait_for_motion({round, 0, 0, 0, 0, 0}));
  }
}

TEST_F(SpnavDaemonTest, TurnsAwayMoreProgramsThanItWillServe) {
  SpnavDaemonOptions options;
  options.most_programs = 2;
  DaemonThread daemon(folder_.socket(), options);
  SpnavProgramByHand first(folder_.socket());
  SpnavProgramByHand second(folder_.socket());
  SpnavProgramByHand third(folder_.socket(), 0);
  EXPECT_TRUE(third.closed());
  BridgeByHand bridge(folder_.socket());
  bridge.show({1, 0, 0, 0, 0, 0});
  EXPECT_TRUE(first.wait_for_motion({1, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(second.wait_for_motion({1, 0, 0, 0, 0, 0}));
}

TEST_F(SpnavDaemonTest, ABridgeThatFallsSilentIsNeutral) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
  bridge.show({1, 2, 3, 4, 5, 6}, 0b10, 20);
  EXPECT_TRUE(program.wait_for_type(1));
  EXPECT_TRUE(program.wait_for_type(2));
  EXPECT_TRUE(program.wait_for_zero());
  bridge.show({1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(program.wait_for_motion({1, 2, 3, 4, 5, 6})) << "it may come back";
}

TEST_F(SpnavDaemonTest, ProgramsStayConnectedWhenTheBridgeGoesAndComes) {
  DaemonThread daemon(folder_.socket());
  auto bridge = std::make_unique<BridgeByHand>(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
  bridge->show({0, 0, 0, 0, 0, 8}, 1);
  ASSERT_TRUE(program.wait_for_motion({0, 0, 0, 0, 0, 8}));
  bridge.reset();
  EXPECT_EQ(program.next_record().value(), (Words{2, 0, 0}));
  EXPECT_EQ(motion_of(program.next_record().value()), Words{});
  EXPECT_EQ(program.next_record().value(), (Words{3, 1, 0, 0x20c, 0x256f, 0xc62e}))
      << "the device has gone";
  BridgeByHand next(folder_.socket());
  EXPECT_EQ(program.next_record().value(), (Words{3, 0, 0, 0x20c, 0x256f, 0xc62e}))
      << "it is there again";
  next.show({0, 0, 0, 0, 0, 8});
  EXPECT_EQ(motion_of(program.next_record().value()), (Words{0, 0, 0, 0, 0, 0, 8}));
}

TEST_F(SpnavDaemonTest, RefusesASecondBridgeAndKeepsTheFirst) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand first(folder_.socket());
  BridgeByHand second(folder_.socket());
  EXPECT_EQ(first.greeting().refused, 0U);
  EXPECT_EQ(second.greeting().refused, 1U);
  EXPECT_EQ(second.greeting().other_bridge, ::getpid());
  SpnavProgramByHand program(folder_.socket());
  first.show({4, 0, 0, 0, 0, 0});
  EXPECT_TRUE(program.wait_for_motion({4, 0, 0, 0, 0, 0}));
}

TEST_F(SpnavDaemonTest, DropsABridgeThatTalksNonsense) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
  bridge.show({1, 0, 0, 0, 0, 0});
  ASSERT_TRUE(program.wait_for_motion({1, 0, 0, 0, 0, 0}));
  const std::vector<std::uint8_t> nonsense(sizeof(SpnavUpdate), 0x41);
  ASSERT_TRUE(send_spnav_bytes(bridge.fd(), nonsense));
  EXPECT_TRUE(program.wait_for_zero());
  BridgeByHand next(folder_.socket());
  EXPECT_EQ(next.greeting().refused, 0U);
}

TEST_F(SpnavDaemonTest, TellsTheBridgeWhoComesAndGoes) {
  DaemonThread daemon(folder_.socket());
  auto early = std::make_unique<SpnavProgramByHand>(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  const auto there = bridge.hear<SpnavProgram>();
  EXPECT_EQ(there.connected, 1U);
  EXPECT_EQ(there.peer.pid, ::getpid());
  EXPECT_STREQ(there.peer.name.data(), "spnav_test");
  early.reset();
  EXPECT_EQ(bridge.hear<SpnavProgram>().connected, 0U);
}

TEST_F(SpnavDaemonTest, EndsAfterIdlenessAndLeavesNothing) {
  SpnavDaemonOptions options;
  options.idle_end = std::chrono::milliseconds(30);
  DaemonThread daemon(folder_.socket(), options);
  daemon.wait();
  daemon.stop();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(SpnavDaemonTest, LeavesProgramsAtRestWhenItIsStopped) {
  DaemonThread daemon(folder_.socket());
  BridgeByHand bridge(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
  bridge.show({1, 0, 0, 0, 0, 0});
  ASSERT_TRUE(program.wait_for_motion({1, 0, 0, 0, 0, 0}));
  daemon.stop();
  EXPECT_TRUE(program.wait_for_zero());
}

TEST_F(SpnavDaemonTest, ItsSocketsAreForTheOwnerAlone) {
  const auto sockets = listen_spnav(folder_.socket());
  ASSERT_TRUE(sockets.has_value());
  for (const std::string& path : {folder_.socket(), folder_.socket() + ".bridge"}) {
    struct stat file {};
    ASSERT_EQ(::stat(path.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0777, 0600U) << path;
  }
}

TEST_F(SpnavDaemonTest, ReplacesTheSocketsOfOneThatWasKilled) {
  { const auto left_over = listen_spnav(folder_.socket()); }  // closed, not removed
  ASSERT_TRUE(std::filesystem::exists(folder_.socket()));
  DaemonThread daemon(folder_.socket());
  SpnavProgramByHand program(folder_.socket());
}

TEST_F(SpnavDaemonTest, DoesNotTakeThePlaceOfAnotherServer) {
  const UniqueFd other(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_un address = test::unix_address(folder_.socket());
  ASSERT_EQ(::bind(other.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(other.get(), 4), 0);
  EXPECT_THROW(listen_spnav(folder_.socket()), ConfigError);
  SpnavProgramByHand program(folder_.socket(), 0);  // still there
}

TEST_F(SpnavDaemonTest, DoesNotTakeThePlaceOfAFile) {
  std::ofstream(folder_.socket()) << "precious";
  EXPECT_THROW(listen_spnav(folder_.socket()), ConfigError);
  std::ofstream(folder_.socket(), std::ios::trunc);
  EXPECT_TRUE(listen_spnav(folder_.socket()).has_value()) << "an empty file is nothing";
}

TEST_F(SpnavDaemonTest, SaysInOneLineWhyAPathCannotBe) {
  const std::vector<std::string> paths{"/no/such/folder/spnav.sock", "/proc/spnav.sock",
                                       "/tmp/" + std::string(103, 'x')};
  for (const std::string& path : paths) {
    try {
      listen_spnav(spnav_socket_path(path));
      ADD_FAILURE() << path;
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace tagwrench

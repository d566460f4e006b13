// The way to another computer's HID device, with a socket in the node's place: the test is the
// kernel and the other computer, and takes one report after the other, or none.
#include "host/output/gadget_output.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gadget_rig.h"
#include "host/core/config_error.h"
#include "host/output/hid_report.h"
#include "samples.h"

namespace tagwrench {
namespace {

using Report = std::vector<std::uint8_t>;

constexpr int kGadgetPatience_ms = 20'000;  // only ever waited out when the code is wrong

Report motion_report(const Counts6& counts) {
  const SpacemouseReport report = spacemouse_report(counts);
  return {report.begin(), report.end()};
}
Report button_report(std::uint32_t pressed) {
  const SpacemouseButtonReport report = spacemouse_button_report(pressed);
  return {report.begin(), report.end()};
}
Report both(const Counts6& counts, std::uint32_t pressed) {
  Report all = motion_report(counts);
  for (const std::uint8_t byte : button_report(pressed)) all.push_back(byte);
  return all;
}
Report next_of(GadgetReports& reports) {
  const auto bytes = reports.next();
  Report next(bytes.begin(), bytes.end());
  reports.taken();
  return next;
}

TEST(GadgetReports, OnlyTheNewestOfEachKindIsOwedAndButtonsGoFirst) {
  GadgetReports reports(GadgetFace::spacemouse);
  EXPECT_FALSE(reports.owed());
  reports.put(both({1}, 0));
  reports.put(both({2}, 1));
  reports.put(both({300}, 1));
  EXPECT_EQ(next_of(reports), button_report(1));
  EXPECT_EQ(next_of(reports), motion_report({300}));
  EXPECT_FALSE(reports.owed());
}

TEST(GadgetReports, ButtonsAreOwedWhenTheyHaveChangedMotionAlways) {
  GadgetReports reports(GadgetFace::spacemouse);
  reports.put(both({}, 0));
  EXPECT_EQ(next_of(reports), motion_report({}));
  EXPECT_FALSE(reports.owed());
}

TEST(GadgetReports, HeldOffCentreWhatIsTakenChangesEveryTimeAndRestIsExact) {
  GadgetReports reports(GadgetFace::spacemouse);
  Report last;
  for (int i = 0; i < 10; ++i) {
    reports.put(both({0, -200}, 0));
    reports.put(both({0, -200}, 0));  // one that is never taken does not count
    const Report taken = next_of(reports);
    EXPECT_NE(taken, last);
    last = taken;
  }
  for (int i = 0; i < 3; ++i) {
    reports.put(both({}, 0));
    EXPECT_EQ(next_of(reports), motion_report({}));
  }
}

TEST(GadgetReports, WhatIsNoReportOfThisFaceIsDropped) {
  GadgetReports reports(GadgetFace::spacemouse);
  reports.put(Report{0x20, 1, 2, 3});
  reports.put(Report{1, 2, 3});  // too short
  reports.put(Report{});
  EXPECT_FALSE(reports.owed());
}

TEST(GadgetReports, AComputerThatHasSeenNothingIsOwedAll) {
  GadgetReports reports(GadgetFace::spacemouse);
  reports.put(both({5}, 2));
  while (reports.owed()) next_of(reports);
  reports.renew();
  EXPECT_EQ(next_of(reports), button_report(2));
  EXPECT_EQ(reports.next()[0], 1);  // motion
}

/// The other computer, and the kernel's end of the node.
class OtherComputer {
 public:
  OtherComputer() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends), 0);
    ours_.reset(ends[0]);
    node_.reset(ends[1]);
    const int little = 1;  // room for a few reports only, as /dev/hidg has
    setsockopt(node_.get(), SOL_SOCKET, SO_SNDBUF, &little, sizeof little);
  }

  GadgetPort port(GadgetFace face, bool spnav_order = false) {
    GadgetPort port;
    port.face = face;
    port.spnav_order = spnav_order;
    port.places.devices = testing::TempDir();
    port.node.fd = std::move(node_);
    port.node.path = "/dev/hidg-of-this-test";
    port.function = "/no/such/gadget";
    port.program = TAGWRENCH_PROGRAM;
    return port;
  }
  /// For a daemon in this program.
  OpenedNode node(const std::string& path) { return {std::move(node_), path}; }

  /// The next report; empty once everybody at the other end has gone.
  Report take() {
    pollfd waiting{ours_.get(), POLLIN, 0};
    EXPECT_EQ(poll(&waiting, 1, kGadgetPatience_ms), 1) << "silence";
    Report report(256);
    const ssize_t got = recv(ours_.get(), report.data(), report.size(), 0);
    report.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return report;
  }
  /// Takes until this one comes.
  bool take_until(const Report& wanted) {
    for (Report got = take(); !got.empty(); got = take()) {
      if (got == wanted) return true;
    }
    return false;
  }
  /// What comes last of all: when everybody at the other end has gone.
  Report last(std::uint8_t id) {
    Report last;
    for (Report got = take(); !got.empty(); got = take()) {
      if (got[0] == id) last = got;
    }
    return last;
  }
  void write(const Report& report) {
    EXPECT_EQ(send(ours_.get(), report.data(), report.size(), 0),
              static_cast<ssize_t>(report.size()));
  }

 private:
  UniqueFd ours_, node_;
};

/// The next line for people.
std::string news_of(GadgetOutput& output) {
  pollfd waiting{output.poll_fd(), POLLIN, 0};
  if (poll(&waiting, 1, kGadgetPatience_ms) != 1) return "(silence)";
  return std::string(output.service());
}

TEST(GadgetSpacemouse, BeginsAtRestAndMovesWithSigns) {
  OtherComputer other;
  GadgetOutput output(other.port(GadgetFace::spacemouse));
  EXPECT_EQ(other.take(), button_report(0));
  EXPECT_EQ(other.take(), motion_report({}));
  EXPECT_EQ(news_of(output), "gadget: the other computer takes reports");
  Sample s = test::ok_sample();
  s.deflection << 0.1, 0.2, 0.3, -0.1, -0.2, -0.3;
  s.buttons = 2;
  EXPECT_EQ(output.move(s), SendStatus::ok);
  EXPECT_EQ(other.take(), button_report(2));
  EXPECT_EQ(other.take(), motion_report({35, 70, 105, -35, -70, -105}));
  EXPECT_EQ(output.send(s), SendStatus::ok);  // is for data, not for pucks
  s.status = Status::lost;
  EXPECT_EQ(output.move(s), SendStatus::ok);
  EXPECT_EQ(other.take(), button_report(0));
  EXPECT_EQ(other.take(), motion_report({}));
}

TEST(GadgetSpacemouse, OfAnotherVendorHasSpnavsAxes) {
  OtherComputer other;
  GadgetOutput output(other.port(GadgetFace::spacemouse, true));
  Sample s = test::ok_sample();
  s.deflection << 0, 0, 1, 0, 0, 0;  // down
  output.move(s);
  EXPECT_TRUE(other.take_until(motion_report({0, -350, 0, 0, 0, 0})));
}

TEST(GadgetWrench, SendsEverySampleWholeAndLeavesAsLost) {
  OtherComputer other;
  const WrenchReport neutral = neutral_wrench_report();
  {
    GadgetOutput output(other.port(GadgetFace::wrench));
    EXPECT_EQ(other.take(), Report(neutral.begin(), neutral.end()));
    const Sample s = test::ok_sample();
    EXPECT_EQ(output.move(s), SendStatus::ok);
    EXPECT_EQ(output.send(s), SendStatus::ok);
    const WrenchReport expected = wrench_report(s);
    EXPECT_EQ(other.take(), Report(expected.begin(), expected.end()));
  }
  EXPECT_EQ(other.last(kWrenchReportId), Report(neutral.begin(), neutral.end()));
}

TEST(GadgetSpacemouse, AComputerThatTakesNothingGetsTheNewestLater) {
  OtherComputer other;
  GadgetOutput output(other.port(GadgetFace::spacemouse));
  other.take_until(motion_report({}));
  for (int i = 1; i <= 300; ++i) {
    while (output.move(test::moving(i / 350.0)) == SendStatus::skipped) {
      pollfd room{output.poll_fd(), POLLOUT, 0};
      ASSERT_EQ(poll(&room, 1, kGadgetPatience_ms), 1);
    }
  }
  int taken = 0;
  Report report;
  const Report newest = motion_report({300, 0, 0, 0, 0, 0});
  while (report != newest && taken < 300) {
    report = other.take();
    ++taken;
  }
  EXPECT_EQ(report, newest);
  EXPECT_LT(taken, 200);  // what the sockets hold, and not what was sent
}

TEST(GadgetSpacemouse, TheEndOfTheBridgeIsRestForAComputerThatWasNotAsking) {
  OtherComputer other;
  auto output = std::make_unique<GadgetOutput>(other.port(GadgetFace::spacemouse));
  Sample pushed = test::moving(1);
  pushed.buttons = 1;
  for (int i = 0; i < 400; ++i) output->move(pushed);
  output.reset();
  Report motion, buttons;
  for (Report got = other.take(); !got.empty(); got = other.take())
    (got[0] == 1 ? motion : buttons) = got;
  EXPECT_EQ(motion, motion_report({}));
  EXPECT_EQ(buttons, button_report(0));
}

TEST(GadgetSpacemouse, TheWatchdogsBytesAreRest) {
  OtherComputer other;
  GadgetOutput output(other.port(GadgetFace::spacemouse));
  std::vector<WatchdogDevice> devices;
  output.add_to(devices);
  ASSERT_EQ(devices.size(), 1u);
  output.move(test::moving(1));
  EXPECT_TRUE(other.take_until(motion_report({350})));
  for (const auto& bytes : devices[0].neutral)
    EXPECT_EQ(::write(devices[0].fd, bytes.data(), bytes.size()),
              static_cast<ssize_t>(bytes.size()));
  EXPECT_TRUE(other.take_until(motion_report({})));
}

TEST(GadgetSpacemouse, TheLedArrivesAndNonsenseDoesNot) {
  OtherComputer other;
  GadgetOutput output(other.port(GadgetFace::spacemouse));
  EXPECT_EQ(news_of(output), "gadget: the other computer takes reports");
  other.write(Report(200, 0xff));
  other.write({4});
  other.write({4, 1});
  EXPECT_EQ(news_of(output), "gadget: LED on");
  other.write({4, 1});
  other.write({4, 0});
  EXPECT_EQ(news_of(output), "gadget: LED off");
}

/// A second node, that a process which keeps no files can open.
class SecondNode {
 public:
  explicit SecondNode(const std::string& path) {
    path.copy(address_.sun_path, sizeof address_.sun_path - 1);
    server_.reset(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    EXPECT_EQ(bind(server_.get(), generic(address_), sizeof address_), 0) << path;
    EXPECT_EQ(listen(server_.get(), 1), 0);
    be_patient(server_.get());
  }
  ~SecondNode() { ::unlink(address_.sun_path); }

  OpenGadgetNode opener() const {
    return [address = address_] {
      OpenedNode node;
      node.path = "hidg1";
      node.fd.reset(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
      if (connect(node.fd.get(), generic(address), sizeof address) != 0) return OpenedNode();
      return node;
    };
  }
  /// Its first report of the buttons.
  Report take_buttons() const {
    const UniqueFd node(accept(server_.get(), nullptr, nullptr));
    be_patient(node.get());
    Report report(64);
    while (true) {
      const ssize_t got = recv(node.get(), report.data(), report.size(), 0);
      if (got <= 0) return {};
      const Report taken(report.begin(), report.begin() + got);
      if (taken[0] == 3) return taken;
    }
  }

 private:
  /// And not for ever.
  static void be_patient(int fd) {
    const timeval patience{kGadgetPatience_ms / 1000, 0};
    EXPECT_EQ(setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience), 0);
  }
  static const sockaddr* generic(const sockaddr_un& address) {
    return reinterpret_cast<const sockaddr*>(&address);
  }

  sockaddr_un address_{AF_UNIX, {}};
  UniqueFd server_;
};

/// A daemon in a thread, with a bridge by hand: what it opens by itself is no real node.
class DaemonByHand {
 public:
  DaemonByHand(const std::string& folder, OpenedNode node, OpenGadgetNode open) {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends), 0);
    bridge_.reset(ends[0]);
    thread_ = std::thread([link = ends[1], folder, node = std::move(node), open]() mutable {
      run_gadget_daemon(GadgetFace::spacemouse, UniqueFd(link), watch_nodes(folder),
                        std::move(node), open);
    });
  }
  ~DaemonByHand() {
    bridge_.reset();
    thread_.join();
  }
  void put(const Report& report) {
    EXPECT_EQ(send(bridge_.get(), report.data(), report.size(), 0),
              static_cast<ssize_t>(report.size()));
  }
  GadgetEvent status_line() {
    GadgetEvent status_line{};
    pollfd waiting{bridge_.get(), POLLIN, 0};
    if (poll(&waiting, 1, kGadgetPatience_ms) != 1) return {};
    EXPECT_EQ(recv(bridge_.get(), &status_line, sizeof status_line, 0), 1);
    return status_line;
  }

 private:
  UniqueFd bridge_;
  std::thread thread_;
};

TEST(GadgetDaemon, ANodeThatGoesIsLeftAtRestAndTheNextOneIsToldHowThingsAre) {
  const test::TemporaryTree folder;
  const SecondNode second(folder / "socket");
  OtherComputer first;
  std::ofstream(folder / "hidg0") << "";
  DaemonByHand daemon(folder.path(), first.node(folder / "hidg0"), second.opener());
  EXPECT_EQ(daemon.status_line(), GadgetEvent::ready);
  EXPECT_EQ(daemon.status_line(), GadgetEvent::taken);
  daemon.put(both({350}, 1));
  EXPECT_TRUE(first.take_until(button_report(1)));
  ::unlink((folder / "hidg0").c_str());
  EXPECT_TRUE(first.take_until(button_report(0)));
  EXPECT_EQ(daemon.status_line(), GadgetEvent::gone);
  std::ofstream(folder / "hidg1") << "";
  EXPECT_EQ(second.take_buttons(), button_report(1));  // told to the first one only, until now
  EXPECT_EQ(daemon.status_line(), GadgetEvent::taken);
}

/// Of this process, by its name.
pid_t child_named(const std::string& name) {
  std::ifstream children("/proc/self/task/" + std::to_string(::getpid()) + "/children");
  for (pid_t child; children >> child;) {
    std::string its;
    std::getline(std::ifstream("/proc/" + std::to_string(child) + "/comm"), its);
    if (its == name) return child;
  }
  return 0;
}

TEST(GadgetSpacemouse, NoSignalEndsItsDaemonInAnyThread) {
#ifdef TAGWRENCH_FOREIGN_THREAD
  ::setenv("LD_PRELOAD", TAGWRENCH_FOREIGN_THREAD, 1);  // a library's thread that takes them
#endif
  OtherComputer other;
  GadgetOutput output(other.port(GadgetFace::spacemouse));
  const pid_t daemon = child_named("tw-gadget");
  ASSERT_GT(daemon, 0);
  EXPECT_EQ(::getsid(daemon), daemon);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGALRM, SIGPIPE}) {
    EXPECT_EQ(::kill(daemon, number), 0);
    const std::string tasks = "/proc/" + std::to_string(daemon) + "/task";
    for (const auto& task : std::filesystem::directory_iterator(tasks))
      EXPECT_EQ(::tgkill(daemon, std::stoi(task.path().filename()), number), 0);
  }
  output.move(test::moving(1));
  EXPECT_TRUE(other.take_until(motion_report({350})));
}

TEST(GadgetSpacemouse, ADaemonThatCannotBeStartedSaysSo) {
  for (const char* program : {"/no/such/program", "/bin/true"}) {
    OtherComputer other;
    GadgetPort port = other.port(GadgetFace::spacemouse);
    port.program = program;
    try {
      const GadgetOutput output(std::move(port));
      FAIL() << program;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("process"), std::string::npos) << error.what();
    }
  }
}

TEST(Gadgets, ThatAreNotUpNameTheCommand) {
  GadgetOptions options;
  options.name = "left";
  options.face = GadgetFace::wrench;
  options.places.configfs = testing::TempDir() + "nowhere";
  try {
    find_gadget(options);
    FAIL();
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("sudo tagwrench gadget up --face wrench --name left"), std::string::npos);
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace tagwrench

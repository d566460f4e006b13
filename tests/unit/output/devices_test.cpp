// The uhid devices against a kernel made of a socket pair: one message is one event, as on
// /dev/uhid.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "host/core/config_error.h"
#include "host/output/hid_outputs.h"
#include "samples.h"

namespace tagwrench {
namespace {

using Bytes = std::vector<std::uint8_t>;

class FakeKernel {
 public:
  FakeKernel() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends), 0);
    kernel_.reset(ends[0]);
    bridge_.reset(ends[1]);
  }
  UniqueFd bridge_end() { return std::move(bridge_); }
  void start() {
    say(UHID_START, [](uhid_event&) {});
  }

  template <typename Fill>
  void say(std::uint32_t type, Fill fill) {
    auto event = std::make_unique<uhid_event>();
    std::memset(event.get(), 0, sizeof *event);
    event->type = type;
    fill(*event);
    EXPECT_GT(::write(kernel_.get(), event.get(), sizeof *event), 0);
  }

  /// The next thing that the bridge wrote, zero-filled as the kernel does it.
  std::unique_ptr<uhid_event> next() {
    auto event = std::make_unique<uhid_event>();
    std::memset(event.get(), 0, sizeof *event);
    if (::read(kernel_.get(), event.get(), sizeof *event) <= 0) return nullptr;
    return event;
  }

  std::optional<Bytes> next_input() {
    while (const auto event = next()) {
      if (event->type != UHID_INPUT2) continue;
      return Bytes(event->u.input2.data, event->u.input2.data + event->u.input2.size);
    }
    return std::nullopt;
  }

 private:
  UniqueFd kernel_, bridge_;
};

Bytes bytes_of(const SpacemouseReport& report) { return {report.begin(), report.end()}; }
Bytes axes(const Counts6& counts) { return bytes_of(spacemouse_report(counts)); }

class SpacemouseDevice : public ::testing::Test {
 protected:
  void SetUp() override {
    kernel_.start();
    out_ = std::make_unique<SpacemouseOutput>(SpacemouseOptions{}, kernel_.bridge_end());
    created_ = kernel_.next();
    EXPECT_EQ(kernel_.next_input(), axes({}));  // zero on creation
  }
  FakeKernel kernel_;
  std::unique_ptr<SpacemouseOutput> out_;
  std::unique_ptr<uhid_event> created_;
};

TEST_F(SpacemouseDevice, IsCreatedWithTheIdentityThatClientsLookFor) {
  ASSERT_EQ(created_->type, static_cast<std::uint32_t>(UHID_CREATE2));
  const uhid_create2_req& c = created_->u.create2;
  EXPECT_STREQ(reinterpret_cast<const char*>(c.name), "tagwrench SpaceMouse");
  EXPECT_EQ(c.bus, 3);  // BUS_USB
  EXPECT_EQ(c.vendor, 0x256fu);
  EXPECT_EQ(c.product, 0xc62eu);
  EXPECT_EQ(c.rd_size, 100);
}

TEST_F(SpacemouseDevice, SendsHidAxesWithoutSignChanges) {
  Sample s = test::ok_sample();
  s.deflection << 0.1, 0.2, 0.3, -0.1, -0.2, -0.3;
  EXPECT_EQ(out_->move(s), SendStatus::ok);
  EXPECT_EQ(kernel_.next_input(), axes({35, 70, 105, -35, -70, -105}));
}

TEST_F(SpacemouseDevice, HeldOffCentreEverySampleChangesAndReleaseIsExactZeroAgainAndAgain) {
  std::optional<Bytes> last;
  for (int i = 0; i < 20; ++i) {
    out_->move(test::moving(0.5));
    const auto report = kernel_.next_input();
    ASSERT_TRUE(report);
    EXPECT_NE(report, last);
    last = report;
  }
  for (int i = 0; i < 4; ++i) {
    out_->move(test::moving(0));
    EXPECT_EQ(kernel_.next_input(), axes({}));
  }
}

TEST_F(SpacemouseDevice, EveryStatusWithoutNumbersIsZeroAtOnce) {
  for (const Status status : {Status::acquiring, Status::lost, Status::doubtful}) {
    out_->move(test::moving(1));
    kernel_.next_input();
    Sample s = test::moving(1);
    s.status = status;
    out_->move(s);
    EXPECT_EQ(kernel_.next_input(), axes({}));
  }
}

TEST_F(SpacemouseDevice, NanIsZero) {
  out_->move(test::moving(1));
  kernel_.next_input();
  out_->move(test::moving(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_EQ(kernel_.next_input(), axes({}));
}

TEST_F(SpacemouseDevice, TheClientsLedArrives) {
  EXPECT_FALSE(out_->led());
  const auto led = [this](std::uint8_t state) {
    kernel_.say(UHID_OUTPUT, [state](uhid_event& e) {
      e.u.output.size = 2;
      e.u.output.rtype = UHID_OUTPUT_REPORT;
      e.u.output.data[0] = 4;
      e.u.output.data[1] = state;
    });
  };
  led(1);
  pollfd ready{out_->poll_fd(), POLLIN, 0};
  EXPECT_EQ(poll(&ready, 1, 0), 1);
  EXPECT_EQ(out_->service(), "spacemouse: LED on");
  EXPECT_TRUE(out_->led());
  led(0);
  EXPECT_EQ(out_->service(), "spacemouse: LED off");
  EXPECT_EQ(out_->service(), "");
  EXPECT_FALSE(out_->led());
}

TEST_F(SpacemouseDevice, AnOutputReportWithALyingSizeIsHarmless) {
  kernel_.say(UHID_OUTPUT, [](uhid_event& e) {
    e.u.output.size = 0xffff;
    e.u.output.rtype = UHID_OUTPUT_REPORT;
    std::memset(e.u.output.data, 0xff, sizeof e.u.output.data);
  });
  out_->service();
  EXPECT_FALSE(out_->led());
}

TEST_F(SpacemouseDevice, GetReportIsAnsweredWithTheLastInputAndElseRefused) {
  out_->move(test::moving(1));
  kernel_.next_input();
  const auto ask = [this](std::uint8_t report) {
    kernel_.say(UHID_GET_REPORT, [report](uhid_event& e) {
      e.u.get_report = {77, report, UHID_INPUT_REPORT};
    });
    out_->service();
    return kernel_.next();
  };
  const auto known = ask(1);
  ASSERT_TRUE(known);
  EXPECT_EQ(known->type, static_cast<std::uint32_t>(UHID_GET_REPORT_REPLY));
  EXPECT_EQ(known->u.get_report_reply.id, 77u);
  EXPECT_EQ(known->u.get_report_reply.err, 0);
  EXPECT_EQ(known->u.get_report_reply.size, 13);
  EXPECT_EQ(known->u.get_report_reply.data[1], 0x5e);
  const auto unknown = ask(9);
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->u.get_report_reply.err, EIO);
}

TEST_F(SpacemouseDevice, SetReportOfTheLedIsTakenAndAnswered) {
  kernel_.say(UHID_SET_REPORT, [](uhid_event& e) {
    e.u.set_report.id = 5;
    e.u.set_report.rtype = UHID_OUTPUT_REPORT;
    e.u.set_report.size = 2;
    e.u.set_report.data[0] = 4;
    e.u.set_report.data[1] = 1;
  });
  out_->service();
  EXPECT_TRUE(out_->led());
  const auto reply = kernel_.next();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->type, static_cast<std::uint32_t>(UHID_SET_REPORT_REPLY));
  EXPECT_EQ(reply->u.set_report_reply.id, 5u);
  EXPECT_EQ(reply->u.set_report_reply.err, 0);
}

TEST_F(SpacemouseDevice, GoesAwayWithZerosThenDestroy) {
  out_->move(test::moving(1));
  kernel_.next_input();
  out_.reset();
  const auto zeros = kernel_.next();
  ASSERT_TRUE(zeros);
  EXPECT_EQ(Bytes(zeros->u.input2.data, zeros->u.input2.data + 13), axes({}));
  const auto destroy = kernel_.next();
  ASSERT_TRUE(destroy);
  EXPECT_EQ(destroy->type, static_cast<std::uint32_t>(UHID_DESTROY));
}

TEST_F(SpacemouseDevice, AFullQueueLosesTheSampleAndNothingComesLate) {
  SendStatus status = SendStatus::ok;
  int sent = 0;
  while (status == SendStatus::ok && sent < 100000) {
    status = out_->move(test::moving(0.5));
    if (status == SendStatus::ok) ++sent;
  }
  EXPECT_EQ(status, SendStatus::skipped);
  while (kernel_.next_input()) --sent;
  EXPECT_EQ(sent, 0);
  EXPECT_EQ(out_->move(test::moving(0.25)), SendStatus::ok);
  EXPECT_EQ(kernel_.next_input(), axes({88, 0, 0, 0, 0, 0}));
}

TEST_F(SpacemouseDevice, ButtonsAreSentWhenTheyChangeAndOnlyThoseThatItHas) {
  Sample s = test::moving(0);
  s.buttons = 0b110;
  out_->move(s);
  EXPECT_EQ(kernel_.next_input(), axes({}));
  EXPECT_EQ(kernel_.next_input(), (Bytes{3, 0b10, 0}));
  out_->move(s);
  EXPECT_EQ(kernel_.next_input(), axes({}));
  s.status = Status::lost;  // whoever pressed it, nobody knows how it goes on
  out_->move(s);
  EXPECT_EQ(kernel_.next_input(), axes({}));
  EXPECT_EQ(kernel_.next_input(), (Bytes{3, 0, 0}));
}

TEST_F(SpacemouseDevice, WatchdogBytesAreNeutralThenDestroy) {
  std::vector<WatchdogDevice> devices;
  out_->add_to(devices);
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].fd, out_->poll_fd());
  const Bytes rest = {12, 0, 0, 0,  // UHID_INPUT2
                      13, 0,        // size
                      1,  0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const Bytes released = {12, 0, 0, 0, 3, 0, 3, 0, 0};
  EXPECT_EQ(devices[0].neutral, (std::vector<Bytes>{rest, released}));
  EXPECT_EQ(devices[0].destroy, (Bytes{1, 0, 0, 0}));  // UHID_DESTROY
}

TEST_F(SpacemouseDevice, NeedsNoAdviceForSpacenavd) { EXPECT_EQ(out_->spacenavd_advice(), ""); }

TEST(Spacemouse, OwnIdSendsSpnavOrderAndSaysTheLineToAdd) {
  FakeKernel kernel;
  kernel.start();
  SpacemouseOptions options;
  options.vendor = 0x1209;
  options.product = 0x0001;
  SpacemouseOutput out(options, kernel.bridge_end());
  EXPECT_NE(out.spacenavd_advice().find("device-id = 1209:0001"), std::string::npos);
  kernel.next_input();
  Sample s = test::ok_sample();
  s.deflection << 0, 0, 1, 0, 0, 0;  // down
  out.move(s);
  EXPECT_EQ(kernel.next_input(), axes({0, -350, 0, 0, 0, 0}));  // spnav y is up
}

TEST(Spacemouse, LogitechsVendorIdIsRefused) {
  FakeKernel kernel;
  SpacemouseOptions options;
  options.vendor = 0x046d;
  options.product = 0xc626;
  EXPECT_THROW(SpacemouseOutput(options, kernel.bridge_end()), ConfigError);
}

TEST(Uhid, ADeviceThatTheKernelDoesNotStartIsAnErrorOfOneLine) {
  FakeKernel kernel;
  try {
    UhidDevice({kernel.bridge_end()}, {"x", "", 1, 2}, spacemouse_descriptor(),
               std::chrono::milliseconds(1));
    FAIL();
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("/dev/uhid"), std::string::npos);
    EXPECT_NE(text.find("modprobe"), std::string::npos);
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}

TEST(Uhid, ANameThatDoesNotFitIsRefused) {
  for (const std::string& name : {std::string(), std::string(128, 'a'), std::string("a\nb")}) {
    FakeKernel kernel;
    kernel.start();
    EXPECT_THROW(UhidDevice(kernel.bridge_end(), {name, "", 1, 2}, spacemouse_descriptor()),
                 ConfigError);
  }
}

TEST(Uhid, WithoutTheNodeSetUpThrows) {
  if (::access("/dev/uhid", F_OK) == 0) GTEST_SKIP() << "/dev/uhid is there";
  EXPECT_THROW(SpacemouseOutput{SpacemouseOptions{}}, ConfigError);
}

TEST(Joystick, WithoutTheNodeSetUpThrows) {
  if (::access("/dev/uinput", F_OK) == 0) GTEST_SKIP() << "/dev/uinput is there";
  EXPECT_THROW(JoystickOutput{JoystickOptions{}}, ConfigError);
}

TEST(Joystick, OneFrameIsSixAxesEightButtonsAndASync) {
  const JoystickEvents events = joystick_events({1, -2, 3, -4, 32767, -32767}, 0b101);
  const int values[] = {1, -2, 3, -4, 32767, -32767};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(events[i].type, EV_ABS);
    EXPECT_EQ(events[i].code, i);  // ABS_X is 0, ABS_RZ is 5
    EXPECT_EQ(events[i].value, values[i]);
  }
  for (std::size_t i = 0; i < kJoystickButtons; ++i) {
    EXPECT_EQ(events[6 + i].type, EV_KEY);
    EXPECT_EQ(events[6 + i].code, BTN_TRIGGER + i);
    EXPECT_EQ(events[6 + i].value, i == 0 || i == 2 ? 1 : 0);
  }
  EXPECT_EQ(events.back().type, EV_SYN);
}

TEST(WrenchDevice, SendsOneFullReportForEverySampleAndNeutralAtTheEnd) {
  FakeKernel kernel;
  kernel.start();
  auto out = std::make_unique<WrenchHidOutput>(WrenchHidOptions{}, kernel.bridge_end());
  EXPECT_EQ(kernel.next()->u.create2.rd_size, wrench_descriptor().size());
  for (const Status status : {Status::ok, Status::lost, Status::saturated}) {
    Sample s = test::ok_sample();
    s.status = status;
    EXPECT_EQ(out->send(s), SendStatus::ok);
    const WrenchReport expected = wrench_report(s);
    EXPECT_EQ(kernel.next_input(), Bytes(expected.begin(), expected.end()));
  }
  out.reset();
  const WrenchReport neutral = neutral_wrench_report();
  EXPECT_EQ(kernel.next_input(), Bytes(neutral.begin(), neutral.end()));
}

}  // namespace
}  // namespace tagwrench

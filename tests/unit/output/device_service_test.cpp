// What of a connection to the service of devices reaches the kernel. The service itself on a real
// kernel: tests/kernel/checks/device_service.py.
#include "host/output/device_service.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>

#include "host/core/config_error.h"
#include "host/output/hid_outputs.h"
#include "samples.h"

namespace tagwrench {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <typename Event>
Bytes bytes_of(const Event& event, std::size_t size = sizeof(Event)) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&event);
  return {bytes, bytes + size};
}

Bytes creation(const UhidIdentity& identity, std::span<const std::uint8_t> descriptor) {
  return bytes_of(*uhid_creation(identity, descriptor));
}

bool is_made(const UhidIdentity& identity, std::span<const std::uint8_t> descriptor) {
  return UhidGate().passes(creation(identity, descriptor));
}

Bytes end() { return bytes_of(std::uint32_t{UHID_DESTROY}); }

class Puck : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(gate_.passes(creation(puck_, spacemouse_descriptor()))); }
  SpacemouseOptions puck_;
  UhidGate gate_;
};

TEST(UhidGate, PassesThePuckAndTheWrenchSensorAsTheBridgeMakesThem) {
  SpacemouseOptions puck;
  puck.serial = "tagwrench-left";
  EXPECT_TRUE(is_made(puck, spacemouse_descriptor()));
  EXPECT_TRUE(is_made(WrenchHidOptions{}, wrench_descriptor()));
  puck.vendor = 0x1209;  // pid.codes: an id of one's own
  puck.product = 0x1234;
  EXPECT_TRUE(is_made(puck, spacemouse_descriptor()));
}

TEST(UhidGate, PassesNoOtherIdentity) {
  const auto with = [](auto change) {
    SpacemouseOptions puck;
    change(puck);
    return is_made(puck, spacemouse_descriptor());
  };
  EXPECT_FALSE(with([](auto& puck) { puck.product = 0xc635; }));  // clients know it, the user's?
  EXPECT_FALSE(with([](auto& puck) { puck.vendor = 0x046d; }));
  EXPECT_FALSE(with([](auto& puck) { puck.name = "3Dconnexion SpaceMouse"; }));
  EXPECT_FALSE(with([](auto& puck) { puck.serial = "another"; }));
  EXPECT_FALSE(with([](auto& puck) { puck.serial = "tagwrench-a\u202eb"; }));
  EXPECT_FALSE(is_made(SpacemouseOptions{}, wrench_descriptor()));
  EXPECT_FALSE(is_made(WrenchHidOptions{}, spacemouse_descriptor()));
}

TEST(UhidGate, ACreationThatDiffersInAnyByteThatMattersToTheKernelIsRefused) {
  const Bytes ours = creation(SpacemouseOptions{}, spacemouse_descriptor());
  const std::size_t serial = offsetof(uhid_event, u) + offsetof(uhid_create2_req, uniq);
  const std::size_t end_of_creation = offsetof(uhid_event, u) + sizeof(uhid_create2_req);
  for (std::size_t i = 0; i < end_of_creation; ++i) {
    if (i >= serial + 10 && i < serial + 63) continue;  // behind "tagwrench-" all are free
    Bytes other = ours;
    other[i] ^= 0x01;
    ASSERT_FALSE(UhidGate().passes(other)) << "byte " << i;
  }
}

TEST(UhidGate, TakesNoReportBeforeThereIsADeviceAndNothingAfterItsEnd) {
  UhidGate gate;
  EXPECT_FALSE(gate.passes(uhid_input(spacemouse_report({}))));
  EXPECT_FALSE(gate.passes(end()));
  ASSERT_TRUE(gate.passes(creation(SpacemouseOptions{}, spacemouse_descriptor())));
  EXPECT_TRUE(gate.passes(end()));
  EXPECT_TRUE(gate.ended());
  EXPECT_FALSE(gate.passes(uhid_input(spacemouse_report({}))));
}

TEST_F(Puck, ItsReportsAndAnswersPass) {
  EXPECT_TRUE(gate_.passes(uhid_input(spacemouse_report({1, 2, 3, 4, 5, 6}))));
  EXPECT_TRUE(gate_.passes(uhid_input(spacemouse_button_report(1))));
  auto answer = std::make_unique<uhid_event>();
  answer->type = UHID_GET_REPORT_REPLY;
  EXPECT_TRUE(gate_.passes(bytes_of(*answer)));
  answer->type = UHID_SET_REPORT_REPLY;
  EXPECT_TRUE(gate_.passes(bytes_of(*answer)));
}

TEST_F(Puck, AReportWhoseSizeIsNotWhatItSaysOrMoreThan64BytesIsRefused) {
  Bytes report = uhid_input(spacemouse_report({}));
  report.push_back(0);
  EXPECT_FALSE(gate_.passes(report));
  auto whole = std::make_unique<uhid_event>();
  whole->type = UHID_INPUT2;
  whole->u.input2.size = 65;
  EXPECT_FALSE(gate_.passes(bytes_of(*whole, 6 + 65)));
}

TEST_F(Puck, AnotherDeviceOrAnEventOfTheKernelIsRefused) {
  EXPECT_FALSE(gate_.passes(creation(puck_, spacemouse_descriptor())));
  EXPECT_FALSE(gate_.passes(bytes_of(std::uint32_t{UHID_START})));
  EXPECT_FALSE(gate_.passes({}));
}

TEST_F(Puck, AtRestItsAxesAndButtonsAreZero) {
  ASSERT_EQ(gate_.neutral().size(), 2u);
  EXPECT_EQ(gate_.neutral()[0], uhid_input(spacemouse_report({})));
  EXPECT_EQ(gate_.neutral()[1], uhid_input(spacemouse_button_report(0)));
}

TEST(Joystick, IsLentUnderItsOwnNamesAndIdAlone) {
  JoystickOptions options;
  EXPECT_TRUE(lent_joystick(bytes_of(joystick_setup(options))));
  options.name += " left";
  EXPECT_TRUE(lent_joystick(bytes_of(joystick_setup(options))));
  JoystickOptions other;
  other.name = "keyboard";
  EXPECT_FALSE(lent_joystick(bytes_of(joystick_setup(other))));
  other.name = "tagwrench joystick \u202e";
  EXPECT_FALSE(lent_joystick(bytes_of(joystick_setup(other))));
  other = {};
  other.product = 1;
  EXPECT_FALSE(lent_joystick(bytes_of(joystick_setup(other))));
  EXPECT_FALSE(lent_joystick({}));
}

TEST(Joystick, AFrameIsWhatTheBridgeWritesAndNoOtherEvent) {
  const JoystickEvents frame = joystick_events({1, -2, 3, 32767, -32767, 0}, 0b1001'0001);
  EXPECT_TRUE(is_joystick_frame(bytes_of(frame)));
  for (std::size_t i = 0; i < frame.size(); ++i) {
    JoystickEvents other = frame;
    other[i].type = EV_KEY;
    other[i].code = KEY_A;
    EXPECT_FALSE(is_joystick_frame(bytes_of(other))) << "event " << i;
  }
  JoystickEvents beyond = frame;
  beyond[0].value = kJoystickLimit_counts + 1;
  EXPECT_FALSE(is_joystick_frame(bytes_of(beyond)));
  EXPECT_FALSE(is_joystick_frame(bytes_of(frame, sizeof frame - sizeof(input_event))));
}

TEST(DeviceService, ItsRefusalNamesTheGroup) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
  const UniqueFd client(ends[0]), service(ends[1]);
  const DeviceAnswer refusal = EACCES;
  ASSERT_GT(::send(service.get(), &refusal, sizeof refusal, 0), 0);
  EXPECT_EQ(device_answer(client.get()), EACCES);
  ASSERT_GT(::send(service.get(), "x", 1, 0), 0);
  EXPECT_EQ(device_answer(client.get()), EPIPE) << "an answer has four bytes";
}

TEST(DeviceService, ADeviceThatItRefusesIsAnErrorOfOneLine) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends), 0);
  UniqueFd client(ends[0]), service(ends[1]);
  ::shutdown(service.get(), SHUT_WR);
  try {
    SpacemouseOutput(SpacemouseOptions{}, std::move(client));
    FAIL();
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("service of devices"), std::string::npos) << text;
    EXPECT_NE(text.find("71-tagwrench-direct.rules"), std::string::npos) << text;
  }
}

TEST(DeviceService, ANodeThatDoesNotOpenSaysPathAndRemedy) {
  EXPECT_EQ(cannot_open_node(kUhidNode, ENOENT),
            "/dev/uhid: not there; load the kernel module: sudo modprobe uhid");
  const std::string denied = cannot_open_node(kUinputNode, EACCES);
  EXPECT_NE(denied.find("/dev/uinput"), std::string::npos);
  EXPECT_NE(denied.find("install the package"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench

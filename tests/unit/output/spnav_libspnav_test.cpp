// The real libspnav as the program on the socket.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "tests/unit/output/spnav_rig.h"

// Last, because it brings the macros of X11.
#include <spnav.h>

namespace tagwrench {
namespace {

using test::BridgeByHand;
using test::DaemonThread;
using test::SpnavFolder;

/// It has one connection a process.
class Libspnav : public ::testing::Test {
 protected:
  Libspnav() : daemon_(folder_.socket()), bridge_(folder_.socket()) {
    ::setenv("SPNAV_SOCKET", folder_.socket().c_str(), 1);
    open_ = ::spnav_open() == 0;
  }
  ~Libspnav() override {
    if (open_) ::spnav_close();
  }
  void SetUp() override {
    ASSERT_TRUE(open_);
    ASSERT_EQ(bridge_.hear<SpnavProgram>().connected, 1U);
  }

  spnav_event next() {
    spnav_event event{};
    if (test::readable(::spnav_fd())) ::spnav_wait_event(&event);
    return event;
  }
  spnav_event next_input() {
    spnav_event event = next();
    while (event.type == SPNAV_EVENT_DEV) event = next();
    return event;
  }

  SpnavFolder folder_;
  DaemonThread daemon_;
  BridgeByHand bridge_;
  bool open_ = false;
};

TEST_F(Libspnav, SpeaksVersion1WithTheDaemon) { EXPECT_EQ(::spnav_protocol(), 1); }

TEST_F(Libspnav, SeesEveryAxisInItsPlaceAndWithItsSign) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    for (const std::int16_t value : {std::int16_t{321}, std::int16_t{-500}}) {
      Counts6 counts{};
      counts[axis] = value;
      bridge_.show(counts);
      const spnav_event event = next_input();
      ASSERT_EQ(event.type, SPNAV_EVENT_MOTION);
      const int got[6] = {event.motion.x,  event.motion.y,  event.motion.z,
                          event.motion.rx, event.motion.ry, event.motion.rz};
      for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(got[i], i == axis ? value : 0) << axis;
    }
  }
}

TEST_F(Libspnav, SeesButtons) {
  bridge_.show({}, 2);
  spnav_event event = next_input();
  EXPECT_EQ(event.type, SPNAV_EVENT_BUTTON);
  EXPECT_EQ(event.button.press, 1);
  EXPECT_EQ(event.button.bnum, 1);
  bridge_.show({}, 0);
  event = next_input();
  EXPECT_EQ(event.type, SPNAV_EVENT_BUTTON);
  EXPECT_EQ(event.button.press, 0);
}

TEST_F(Libspnav, LearnsWhatTheDeviceIs) {
  char text[128] = "";
  EXPECT_EQ(::spnav_client_name("a name that is longer than one record can hold"), 0);
  EXPECT_EQ(::spnav_dev_name(text, sizeof text), 39);
  EXPECT_STREQ(text, "a puck with a name of thirty-nine bytes");
  EXPECT_EQ(::spnav_dev_path(text, sizeof text), static_cast<int>(folder_.socket().size()));
  EXPECT_EQ(text, folder_.socket());
  EXPECT_EQ(::spnav_dev_axes(), 6);
  EXPECT_EQ(::spnav_dev_buttons(), 16);
  unsigned vendor = 0;
  unsigned product = 0;
  EXPECT_EQ(::spnav_dev_usbid(&vendor, &product), 0);
  EXPECT_EQ(vendor, 0x256fU);
  EXPECT_EQ(product, 0xc62eU);
  EXPECT_EQ(::spnav_dev_type(), SPNAV_DEV_SMW);
}

TEST_F(Libspnav, IsRefusedTheSettingsThatAProfileHas) {
  EXPECT_EQ(::spnav_cfg_set_sens(2), -1);
  EXPECT_EQ(::spnav_cfg_set_led(1), -1);
  ::spnav_cfg_set_serial("/dev/a/serial/port/with/a/name/of/two/records");
  EXPECT_EQ(::spnav_cfg_save(), -1);
  EXPECT_EQ(::spnav_dev_axes(), 6) << "and hears the next answer all the same";
}

TEST_F(Libspnav, MasksEvents) {
  ASSERT_EQ(::spnav_evmask(SPNAV_EVMASK_BUTTON), 0);
  bridge_.show({1, 0, 0, 0, 0, 0});
  bridge_.show({1, 0, 0, 0, 0, 0}, 1);
  EXPECT_EQ(next_input().type, SPNAV_EVENT_BUTTON);
}

TEST_F(Libspnav, IsNotSilencedByItsOwnWayOfSendingASensitivity) {
  ::spnav_sensitivity(1.0);
  bridge_.show({100, 0, 0, 0, 0, 0});
  EXPECT_EQ(next_input().motion.x, 100);
}

TEST_F(Libspnav, KeepsItsConnectionOverARestartOfTheBridge) {
  bridge_.show({1, 0, 0, 0, 0, 0});
  EXPECT_EQ(next_input().motion.x, 1);
  bridge_.leave();
  EXPECT_EQ(next_input().motion.x, 0);
  spnav_event event = next();
  EXPECT_EQ(event.type, SPNAV_EVENT_DEV);
  EXPECT_EQ(event.dev.op, SPNAV_DEV_RM);
  BridgeByHand again(folder_.socket());
  event = next();
  EXPECT_EQ(event.type, SPNAV_EVENT_DEV);
  EXPECT_EQ(event.dev.op, SPNAV_DEV_ADD);
  again.show({2, 0, 0, 0, 0, 0});
  EXPECT_EQ(next_input().motion.x, 2);
}

}  // namespace
}  // namespace tagwrench

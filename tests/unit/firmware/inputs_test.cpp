// Buttons and the ADC.
#include "tests/unit/firmware/firmware_test.h"

namespace tagwrench::firmware {
namespace {

class FirmwareInputs : public Firmware {
 protected:
  /// The contact opens and closes for 4 ms before it is what it shall be.
  std::uint32_t bounce(unsigned button, bool pressed) {
    const std::uint32_t first_us = board.now_us;
    for (int i = 0; i < 8; ++i) {
      board.change(button, pressed == (i % 2 == 0), board.now_us);
      run(kPollUs);
    }
    board.change(button, pressed, board.now_us);
    return first_us;
  }
};

TEST_P(FirmwareInputs, AButtonThatBouncesIsOneEventOfItsFirstEdge) {
  greet();
  const std::uint32_t pressed_us = bounce(1, true);
  run(8000);
  EXPECT_TRUE(all<link::ButtonEvent>().empty()) << "it may still bounce";
  run(50000);
  const std::uint32_t released_us = bounce(1, false);
  run(50000);
  ASSERT_EQ(all<link::ButtonEvent>().size(), 2u);
  const link::ButtonEvent press = all<link::ButtonEvent>()[0];
  EXPECT_EQ(press.button, 1);
  EXPECT_TRUE(press.pressed);
  EXPECT_EQ(press.time_us, pressed_us);
  EXPECT_EQ(press.sequence, 0);
  const link::ButtonEvent release = all<link::ButtonEvent>()[1];
  EXPECT_FALSE(release.pressed);
  EXPECT_EQ(release.time_us, released_us);
  EXPECT_EQ(release.sequence, 1);
}

TEST_P(FirmwareInputs, ASpikeOnAButtonsLineIsNoEvent) {
  greet();
  board.change(0, true, board.now_us);
  board.change(0, false, board.now_us + 3);
  run(100000);
  EXPECT_TRUE(all<link::ButtonEvent>().empty());
  const std::uint32_t pressed_us = bounce(0, true);
  run(50000);
  ASSERT_EQ(all<link::ButtonEvent>().size(), 1u);
  EXPECT_EQ(all<link::ButtonEvent>().front().time_us, pressed_us) << "not the spike's";
}

TEST_P(FirmwareInputs, AnEventThatFoundNoRoomShowsInTheNumberOfTheNext) {
  greet();
  board.room = 0;
  bounce(0, true);
  run(50000);
  bounce(0, false);
  run(50000);
  board.room = 255;
  run(5000);
  ASSERT_EQ(all<link::ButtonEvent>().size(), 1u);
  EXPECT_FALSE(all<link::ButtonEvent>().front().pressed);
  EXPECT_EQ(all<link::ButtonEvent>().front().sequence, 1);
}

TEST_P(FirmwareInputs, AdcSamplesAreNumberedByChannelLostOnesIncluded) {
  greet();
  ASSERT_EQ(ask(configuration()), link::Result::ok);
  EXPECT_EQ(board.adc_mask, 3);
  EXPECT_EQ(board.adc_rate_hz, 100);
  const std::uint32_t trigger_us = board.now_us;
  board.measurements.push_back({0, 512, trigger_us, 0});
  board.measurements.push_back({1, 1023, trigger_us + 5000, 0});
  board.measurements.push_back({0, 513, trigger_us + 40000, 3});
  run(5000);
  ASSERT_EQ(all<link::AdcSample>().size(), 3u);
  EXPECT_EQ(all<link::AdcSample>()[0].counts, 512);
  EXPECT_EQ(all<link::AdcSample>()[0].time_us, trigger_us);
  EXPECT_EQ(all<link::AdcSample>()[0].sequence, 0);
  EXPECT_EQ(all<link::AdcSample>()[1].channel, 1);
  EXPECT_EQ(all<link::AdcSample>()[1].sequence, 0);
  EXPECT_EQ(all<link::AdcSample>()[2].sequence, 4);
}

INSTANTIATE_TEST_SUITE_P(Clock, FirmwareInputs, kClockStarts);

}  // namespace
}  // namespace tagwrench::firmware

#include <gtest/gtest.h>

#include "host/motion/profile_manager.h"

namespace tagwrench {
namespace {

LiveReading some_reading() {
  LiveReading reading;
  reading.status = Status::saturated;
  reading.wrench << 0.123456, -1e-9, 3, -4e3, 0, 6e-6;
  reading.motion << -1, 1, 0, 0.5, -0.25, 0.125;
  reading.buttons = 0x80000001U;
  reading.on_trial = true;
  return reading;
}

TEST(LiveText, IsReadBackToSixDigits) {
  const LiveReading reading = some_reading();
  const auto read = parse_live(live_text(reading));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->status, reading.status);
  EXPECT_TRUE(read->wrench.isApprox(reading.wrench, 1e-6));
  EXPECT_TRUE(read->motion.isApprox(reading.motion, 1e-6));
  EXPECT_EQ(read->buttons, reading.buttons);
  EXPECT_TRUE(read->on_trial);
}

TEST(LiveText, WithoutItsEndOrWithMoreIsNone) {
  const std::string text = live_text(some_reading());
  for (std::size_t size = 0; size < text.size(); ++size)
    EXPECT_FALSE(parse_live(text.substr(0, size))) << size;
  EXPECT_FALSE(parse_live(text.substr(0, text.size() - 1) + " 1\n"));
  EXPECT_FALSE(parse_live("ok: fine" + text.substr(text.find(' ', 4))));
  std::string not_a_number = text;
  not_a_number.replace(text.find("0.123456"), 8, "nan");
  EXPECT_FALSE(parse_live(not_a_number));
}

}  // namespace
}  // namespace tagwrench

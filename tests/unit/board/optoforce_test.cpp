#include "host/board/optoforce.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "host/core/config_error.h"
#include "optoforce_frames.h"

namespace tagwrench::link {
namespace {

std::vector<OptoforceFrame> parse(OptoforceParser& parser, const Bytes& bytes) {
  std::vector<OptoforceFrame> out;
  parser.take(bytes, [&](const OptoforceFrame& f) { out.push_back(f); });
  return out;
}

TEST(OptoforceTest, SixAxisFrameOf22BytesIsRead) {
  OptoforceParser parser;
  const Bytes bytes = optoforce_frame(513, 0, {100, -200, 300, -1, 32767, -32768});
  ASSERT_EQ(bytes.size(), 22u);
  EXPECT_EQ(bytes[3], 0x10);
  const auto frames = parse(parser, bytes);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].counter, 513);
  EXPECT_EQ(frames[0].axes, 6);
  EXPECT_EQ(frames[0].counts[1], -200);
  EXPECT_EQ(frames[0].counts[4], 32767);
  EXPECT_EQ(frames[0].counts[5], -32768);
}

TEST(OptoforceTest, ThreeAxisAndFourSensorFramesAreRead) {
  OptoforceParser parser;
  EXPECT_EQ(optoforce_frame(1, 0, {1, 2, 3}).size(), 16u);
  EXPECT_EQ(parse(parser, optoforce_frame(1, 0, {1, 2, 3}))[0].axes, 3);
  const Bytes four = optoforce_frame(2, 0, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  EXPECT_EQ(four.size(), 34u);
  const auto frames = parse(parser, four);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].axes, 12);
  EXPECT_EQ(frames[0].counts[11], 12);
}

TEST(OptoforceTest, AnyFlippedBitIsSeenAndTheNextFrameIsRead) {
  const Bytes good = optoforce_frame(7, 0, {10, 20, 30, 40, 50, 60});
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bytes = optoforce_frame(6, 0, {1, 1, 1, 1, 1, 1});
    Bytes hit = good;
    hit[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    bytes.insert(bytes.end(), hit.begin(), hit.end());
    for (std::uint16_t after = 8; after < 11; ++after) {  // a hit size byte may swallow one more
      const Bytes next = optoforce_frame(after, 0, {2, 2, 2, 2, 2, 2});
      bytes.insert(bytes.end(), next.begin(), next.end());
    }
    OptoforceParser parser;
    const auto frames = parse(parser, bytes);
    ASSERT_EQ(frames.size(), 4u) << bit;
    EXPECT_EQ(frames[1].counter, 8);
    EXPECT_EQ(frames[1].lost_before, 1);
    EXPECT_EQ(parser.counters().interruptions, 1u);
  }
}

TEST(OptoforceTest, AFrameCutOrStuffedAtAnyByteCostsItselfAlone) {
  const Bytes good = optoforce_frame(7, 0, {10, 20, 30, 40, 50, 60});
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const bool cut : {true, false}) {
      Bytes hit = good;
      const auto place = hit.begin() + static_cast<std::ptrdiff_t>(at);
      if (cut) {
        hit.erase(place);
      } else {
        hit.insert(place, 0xAA);
      }
      Bytes bytes = optoforce_frame(6, 0, {1, 1, 1, 1, 1, 1});
      bytes.insert(bytes.end(), hit.begin(), hit.end());
      for (std::uint16_t after = 8; after < 11; ++after) {
        const Bytes next = optoforce_frame(after, 0, {2, 2, 2, 2, 2, 2});
        bytes.insert(bytes.end(), next.begin(), next.end());
      }
      OptoforceParser parser;
      const auto frames = parse(parser, bytes);
      // One more header byte before the header leaves the frame whole.
      ASSERT_EQ(frames.size(), !cut && at <= 1 ? 5u : 4u) << at << (cut ? " cut" : " stuffed");
      EXPECT_EQ(frames.back().counter, 10);
    }
  }
}

TEST(OptoforceTest, NoiseNeverStopsTheParser) {
  std::mt19937 random(3);
  Bytes noise(20'000);
  for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
  OptoforceParser parser;
  parse(parser, noise);
  parse(parser, Bytes(40, 0));
  const auto frames = parse(parser, optoforce_frame(99, 0, {1, 2, 3}));
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].counter, 99);
}

TEST(OptoforceTest, CounterGapsAreLostFramesAcrossItsWrap) {
  OptoforceParser parser;
  parse(parser, optoforce_frame(65534, 0, {0, 0, 0}));
  parse(parser, optoforce_frame(65535, 0, {0, 0, 0}));
  EXPECT_EQ(parse(parser, optoforce_frame(0, 0, {0, 0, 0}))[0].lost_before, 0);
  EXPECT_EQ(parse(parser, optoforce_frame(5, 0, {0, 0, 0}))[0].lost_before, 4);
  EXPECT_EQ(parser.counters().lost_frames, 4u);
  EXPECT_EQ(parser.counters().interruptions, 0u) << "no byte was foreign";
}

TEST(OptoforceTest, OverloadAndErrorBitsAreNamed) {
  EXPECT_EQ(status_text(0), "");
  EXPECT_EQ(status_text(0b000'000'100000'0'001), "overload Fx");
  EXPECT_EQ(status_text(0b000'000'001001'0'001), "overload Fz Tz");
  EXPECT_EQ(status_text(0b010'000'000000'0'000), "DAQ error 2");
  EXPECT_EQ(status_text(0b001'111'000000'1'010), "DAQ error 1; sensor error 7");
  EXPECT_EQ(split_status(0b000'000'000000'1'010).sensor, 2u);
  EXPECT_TRUE(split_status(0b000'000'000000'1'010).several);
}

TEST(OptoforceTest, ConfigurationCommandIsThePublishedOne) {
  const std::array<std::uint8_t, 9> published{0xAA, 0x00, 0x32, 0x03,  // header, payload of 3
                                              0x0A,                    // 100 Hz
                                              0x04,                    // 15 Hz filter
                                              0x00,                    // zero left alone
                                              0x00, 0xED};             // sum
  EXPECT_EQ(optoforce_command(100, 15, false), published);
  EXPECT_EQ(optoforce_command(1000, 0, true)[6], 255);
  EXPECT_THROW(optoforce_command(50, 15, false), ConfigError);
  EXPECT_THROW(optoforce_command(100, 20, false), ConfigError);
}

TEST(OptoforceTest, AReplyIsNoInterruption) {
  OptoforceParser parser;
  Bytes bytes = optoforce_frame(1, 0, {0, 0, 0});
  const Bytes reply{0xAA, 0x00, 0x50, 0x01, 0x02, 0x00, 0xFD};
  bytes.insert(bytes.end(), reply.begin(), reply.end());
  const Bytes next = optoforce_frame(2, 0, {0, 0, 0});
  bytes.insert(bytes.end(), next.begin(), next.end());
  EXPECT_EQ(parse(parser, bytes).size(), 2u);
  EXPECT_EQ(parser.counters().replies, 1u);
  EXPECT_EQ(parser.reply(), 2);
  EXPECT_EQ(parser.counters().interruptions, 0u);
  EXPECT_EQ(parser.counters().skipped_bytes, 0u);
}

TEST(OptoforceTest, TheRecordedDumpHas34320FramesAnd54Interruptions) {
  const char* data = std::getenv("TAGWRENCH_DATA");
  if (data == nullptr) GTEST_SKIP() << "TAGWRENCH_DATA is not set";
  std::ifstream in(std::string(data) + "/optoforce/omd45_16byte_frames.bin", std::ios::binary);
  ASSERT_TRUE(in) << "no optoforce/omd45_16byte_frames.bin in " << data;
  const Bytes bytes{std::istreambuf_iterator<char>(in), {}};
  OptoforceParser parser;
  std::size_t of_three_axes = 0;
  parser.take(bytes, [&](const OptoforceFrame& f) { of_three_axes += f.axes == 3 ? 1 : 0; });
  EXPECT_EQ(parser.counters().frames, 34'320u);
  EXPECT_EQ(of_three_axes, 34'320u);
  EXPECT_EQ(parser.counters().interruptions, 54u);
  EXPECT_EQ(parser.counters().lost_frames, 54u) << "each of them spoilt one frame";
}

}  // namespace
}  // namespace tagwrench::link

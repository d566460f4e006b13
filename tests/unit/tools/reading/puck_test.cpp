#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "host/output/hid_report.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {
namespace {

using Change = PuckState::Change;
using Counts = std::array<std::int16_t, 6>;

Change take(PuckState& puck, const std::vector<std::uint8_t>& report) { return puck.take(report); }

TEST(Puck, ACombinedReportHasSixAxes) {
  PuckState puck;
  const Change change = take(puck, {1, 0x5e, 0x01, 0xa2, 0xfe, 1, 0, 0xff, 0xff, 0, 0, 0, 1});
  EXPECT_EQ(change, Change::motion);
  EXPECT_EQ(puck.counts, (Counts{350, -350, 1, -1, 0, 256}));
}

TEST(Puck, WhatTheBridgesOwnSpaceMouseSendsIsRead) {
  const Counts sent{1, -2, 3, -4, 5, -350};
  PuckState puck;
  EXPECT_EQ(puck.take(spacemouse_report(sent)), Change::motion);
  EXPECT_EQ(puck.counts, sent);
}

TEST(Puck, SplitReportsKeepTheOtherHalf) {
  PuckState puck;
  EXPECT_EQ(take(puck, {1, 10, 0, 20, 0, 30, 0}), Change::motion);
  EXPECT_EQ(take(puck, {2, 0xff, 0xff, 0xfe, 0xff, 0xfd, 0xff}), Change::motion);
  EXPECT_EQ(puck.counts, (Counts{10, 20, 30, -1, -2, -3}));
  EXPECT_EQ(take(puck, {1, 0, 0, 0, 0, 0, 0}), Change::motion);
  EXPECT_EQ(puck.counts, (Counts{0, 0, 0, -1, -2, -3}));
}

TEST(Puck, ButtonsOfOneToFourBytesAreBits) {
  PuckState puck;
  EXPECT_EQ(take(puck, {3, 0x02}), Change::buttons);
  EXPECT_EQ(puck.buttons, 0x02u);
  EXPECT_EQ(take(puck, {3, 0x01, 0x80}), Change::buttons);
  EXPECT_EQ(puck.buttons, 0x8001u);
  EXPECT_EQ(take(puck, {3, 0, 0, 0, 0x80, 0xff, 0xff}), Change::buttons);
  EXPECT_EQ(puck.buttons, 0x80000000u);
}

TEST(Puck, ShortReportsChangeNothing) {
  PuckState puck;
  take(puck, {1, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0});
  for (const auto& report : {std::vector<std::uint8_t>{}, {1}, {1, 9, 9, 9, 9, 9}, {2, 9}, {3}}) {
    EXPECT_EQ(take(puck, report), Change::stranger);
  }
  EXPECT_EQ(puck.counts, (Counts{1, 2, 3, 4, 5, 6}));
}

TEST(Puck, OtherReportsAreNone) {
  PuckState puck;
  EXPECT_EQ(take(puck, {23, 80, 1}), Change::none);  // the battery
  EXPECT_EQ(puck.counts, Counts{});
}

TEST(Puck, AnyBytesMayCome) {
  std::mt19937 random(8);
  PuckState puck;
  int motions = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::vector<std::uint8_t> report(random() % 20);
    for (std::uint8_t& byte : report) byte = static_cast<std::uint8_t>(random());
    if (!report.empty()) report[0] %= 5;
    motions += puck.take(report) == Change::motion ? 1 : 0;
  }
  EXPECT_GT(motions, 100);
}

TEST(Puck, ModelsAreKnownByTheirId) {
  ASSERT_NE(puck_model(0x046d, 0xc626), nullptr);
  EXPECT_EQ(puck_model(0x046d, 0xc626)->name, "SpaceNavigator");
  EXPECT_EQ(puck_model(0x046d, 0xc626)->layout, "split");
  EXPECT_EQ(puck_model(0x256f, 0xc62e)->layout, "combined");
  EXPECT_EQ(puck_model(0x256f, 0xc650), nullptr);  // a mouse
}

}  // namespace
}  // namespace tagwrench

#include "host/output/hid_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hid_parser.h"
#include "samples.h"

namespace tagwrench {
namespace {

using test::HidReportType;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Counts, FullScaleIsTheLimitAndBeyondIsClamped) {
  Vector6 motion;
  motion << 1, -1, 1.5, -1e300, 0.5, -0.0014;
  EXPECT_EQ(to_counts(motion, 350), (Counts6{350, -350, 350, -350, 175, 0}));
}

TEST(Counts, ANumberThatIsNotFiniteMakesAllAxesNeutral) {
  Vector6 motion = Vector6::Constant(0.5);
  motion[4] = kNan;
  EXPECT_EQ(to_counts(motion, 350), Counts6{});
  motion[4] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(to_counts(motion, 350), Counts6{});
}

TEST(Spacemouse, DescriptorDeclaresSixAxesTwoButtonsAndALed) {
  const test::HidDescriptor d = test::parse_hid(spacemouse_descriptor());
  EXPECT_EQ(d.open_collections, 0u);
  EXPECT_EQ(d.report_size(HidReportType::input, 1), sizeof(SpacemouseReport));
  EXPECT_EQ(d.report_size(HidReportType::input, 3), 3u);  // PrusaSlicer drops other sizes
  EXPECT_EQ(d.report_size(HidReportType::output, 4), 2u);
  unsigned offset_bits = 8;
  for (std::uint32_t usage = 0x10030; usage <= 0x10035; ++usage, offset_bits += 16) {  // X ... RZ
    const auto axis = d.find(usage);
    ASSERT_TRUE(axis) << std::hex << usage;
    EXPECT_EQ(axis->application, 0x10008u);  // Multi-axis Controller
    EXPECT_EQ(axis->offset_bits, offset_bits);
    EXPECT_EQ(axis->logical_min, -350);
    EXPECT_EQ(axis->logical_max, 350);
    EXPECT_FALSE(axis->relative);
  }
  EXPECT_TRUE(d.find(0x90001));
  EXPECT_TRUE(d.find(0x90002));
  EXPECT_FALSE(d.find(0x90003));
  EXPECT_EQ(d.find(0x8004b)->type, HidReportType::output);
}

TEST(Spacemouse, ReportBytes) {
  const SpacemouseReport expected = {0x01,         // report id
                                     0x5e, 0x01,   // X 350
                                     0xa2, 0xfe,   // Y -350
                                     0x01, 0x00,   // Z 1
                                     0xff, 0xff,   // RX -1
                                     0x00, 0x00,   // RY 0
                                     0x00, 0x01};  // RZ 256
  EXPECT_EQ(spacemouse_report({350, -350, 1, -1, 0, 256}), expected);
}

TEST(Spacemouse, SpnavOrderIsRightUpAway) {
  // HID Z points down and Y toward the user: pushing down is spnav -y, pulling toward the user is
  // spnav -z.
  EXPECT_EQ(to_spnav_order({1, 2, 3, 4, 5, 6}), (Counts6{1, -3, -2, 4, -6, -5}));
}

TEST(Dither, AChangeGoesOutAsItIs) {
  EXPECT_EQ(dithered({10, 0, 0, 0, 0, 0}, {9, 0, 0, 0, 0, 0}), (Counts6{10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(dithered({}, {9, 0, 0, 0, 0, 0}), Counts6{});
}

TEST(Dither, ZeroStaysExactlyZero) { EXPECT_EQ(dithered({}, {}), Counts6{}); }

TEST(Dither, HoldingStillChangesOneAxisByOneCountAndNeverCrossesZeroNorTheLimit) {
  for (const std::int16_t held : {1, -1, 2, -2, 100, -100, 350, -350}) {
    Counts6 last{};
    for (int i = 0; i < 10; ++i) {
      const Counts6 wanted{0, held, 0, 0, 0, 0};
      const Counts6 sent = dithered(wanted, last);
      EXPECT_NE(sent, last) << held;
      EXPECT_LE(std::abs(sent[1] - held), 1);
      EXPECT_GT(sent[1] * held, 0);
      EXPECT_LE(std::abs(sent[1]), kSpacemouseLimit_counts);
      last = sent;
    }
  }
}

TEST(Wrench, ReportBytes) {
  Sample s = test::ok_sample();
  s.capture_time = TimePoint(std::chrono::microseconds(7'000'250));
  const WrenchReport expected = {0x20,                    // report id
                                 0xa0, 0x86, 0x01, 0x00,  // Fx 0.1 N = 100000 uN
                                 0x70, 0x2f, 0xfc, 0xff,  // Fy -0.25 N = -250000 uN
                                 0xc0, 0xc6, 0x2d, 0x00,  // Fz 3 N = 3000000 uN
                                 0xe8, 0x03, 0x00, 0x00,  // Mx 0.001 N m = 1000 uN m
                                 0x30, 0xf8, 0xff, 0xff,  // My -0.002 N m = -2000 uN m
                                 0x00, 0x00, 0x00, 0x00,  // Mz 0
                                 0x10, 0x27, 0x00, 0x00,  // sigma Fx 0.01 N = 10000 uN
                                 0x20, 0x4e, 0x00, 0x00,  // sigma Fy 20000
                                 0x30, 0x75, 0x00, 0x00,  // sigma Fz 30000
                                 0x64, 0x00, 0x00, 0x00,  // sigma Mx 1e-4 N m = 100 uN m
                                 0xc8, 0x00, 0x00, 0x00,  // sigma My 200
                                 0x2c, 0x01, 0x00, 0x00,  // sigma Mz 300
                                 0x07, 0x00, 0x00, 0x00,  // capture time 7 s
                                 0xfa, 0x00, 0x00, 0x00,  // + 250 us
                                 0x29, 0x00, 0x00, 0x00,  // sequence 41
                                 0x02, 0x00,              // 2 frames lost
                                 0x00};                   // status ok
  EXPECT_EQ(wrench_report(s), expected);
}

class WrenchFields : public ::testing::Test {
 protected:
  const std::vector<std::uint8_t> bytes_ = wrench_descriptor();
  const test::HidDescriptor d_ = test::parse_hid(bytes_);
  const std::vector<test::HidField> force_ = d_.with(test::kNewton);
  const std::vector<test::HidField> torque_ = d_.with(test::kNewtonMetre);
  const std::vector<test::HidField> time_ = d_.with(test::kSecond);
};

TEST_F(WrenchFields, DescriptorDeclaresAllFieldsInAVendorCollection) {
  ASSERT_EQ(force_.size(), 6u);  // force, then its sigma
  ASSERT_EQ(torque_.size(), 6u);
  ASSERT_EQ(time_.size(), 2u);
  EXPECT_EQ(d_.open_collections, 0u);
  EXPECT_EQ(d_.report_size(HidReportType::input, kWrenchReportId), kWrenchReportSize);
  for (const test::HidField& field : d_.fields) {
    EXPECT_EQ(field.application >> 16, 0xff00u);  // any other page makes an evdev node
    EXPECT_EQ(field.report_id, kWrenchReportId);
  }
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(force_[axis].usage, 0x10030 + axis);   // X Y Z
    EXPECT_EQ(torque_[axis].usage, 0x10033 + axis);  // RX RY RZ
  }
}

TEST_F(WrenchFields, AnyParserRecoversNewtonsAndNewtonMetres) {
  constexpr double kHalfCount = 0.5e-6 * 1.000001;  // N and N m
  std::mt19937 random(5);
  std::uniform_real_distribution<double> force_N(-200, 200), torque_Nm(-20, 20), sigma(0, 2);
  for (int trial = 0; trial < 1000; ++trial) {
    Sample s = test::ok_sample();
    for (int i = 0; i < 6; ++i) {
      s.wrench[i] = i < 3 ? force_N(random) : torque_Nm(random);
      s.wrench_sigma[i] = sigma(random);
    }
    const WrenchReport report = wrench_report(s);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      EXPECT_NEAR(force_[i].si(report), s.wrench[k], kHalfCount);
      EXPECT_NEAR(torque_[i].si(report), s.wrench[k + 3], kHalfCount);
      EXPECT_NEAR(force_[i + 3].si(report), s.wrench_sigma[k], kHalfCount);
      EXPECT_NEAR(torque_[i + 3].si(report), s.wrench_sigma[k + 3], kHalfCount);
    }
  }
}

TEST_F(WrenchFields, CaptureTimeIsSecondsSinceTheClocksEpoch) {
  Sample s = test::ok_sample();
  s.capture_time = TimePoint(std::chrono::microseconds(86'400'123'456));
  const WrenchReport report = wrench_report(s);
  EXPECT_NEAR(time_[0].si(report) + time_[1].si(report), 86400.123456, 1e-9);
}

TEST_F(WrenchFields, StatusWithoutNumbersIsZerosAndStillTellsTimeAndSequence) {
  for (const Status status : {Status::acquiring, Status::lost, Status::doubtful}) {
    Sample s = test::ok_sample();
    s.status = status;
    const WrenchReport report = wrench_report(s);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_EQ(force_[i].raw(report), 0);
      EXPECT_EQ(torque_[i].raw(report), 0);
    }
    EXPECT_EQ(d_.find(0xff000033)->raw(report), 41);
    EXPECT_EQ(d_.find(0xff000035)->raw(report), static_cast<int>(status));
  }
}

TEST_F(WrenchFields, SaturatedCarriesNumbers) {
  Sample s = test::ok_sample();
  s.status = Status::saturated;
  EXPECT_NEAR(force_[2].si(wrench_report(s)), 3, 1e-6);
}

TEST_F(WrenchFields, NanIsDoubtfulAndZero) {
  for (int i = 0; i < 12; ++i) {
    Sample s = test::ok_sample();
    (i < 6 ? s.wrench[i] : s.wrench_sigma[i - 6]) = kNan;
    const WrenchReport report = wrench_report(s);
    EXPECT_EQ(d_.find(0xff000035)->raw(report), static_cast<int>(Status::doubtful));
    EXPECT_EQ(force_[2].raw(report), 0);
  }
}

TEST_F(WrenchFields, WhatIsTooLargeStaysAtTheEndOfItsRange) {
  Sample s = test::ok_sample();
  s.wrench << 1e9, -1e9, 0, 1e9, -1e9, 0;
  s.wrench_sigma.setConstant(1e9);
  s.sequence = (std::uint64_t{1} << 31) + 5;
  s.dropped = 70000;
  const WrenchReport report = wrench_report(s);
  EXPECT_EQ(force_[0].raw(report), 2147483647);
  EXPECT_EQ(force_[1].raw(report), -2147483647);
  EXPECT_EQ(torque_[1].raw(report), -2147483647);
  EXPECT_EQ(force_[3].raw(report), 2147483647);
  EXPECT_EQ(d_.find(0xff000033)->raw(report), 5);
  EXPECT_EQ(d_.find(0xff000034)->raw(report), 65535);
}

TEST_F(WrenchFields, NeutralIsLostAndZero) {
  const WrenchReport report = neutral_wrench_report();
  EXPECT_EQ(force_[0].raw(report), 0);
  EXPECT_EQ(d_.find(0xff000035)->raw(report), static_cast<int>(Status::lost));
}

}  // namespace
}  // namespace tagwrench

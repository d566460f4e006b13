#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "golden.h"
#include "host/output/hid_report.h"
#include "host/tools/reading/tagwrench_hid.h"

namespace tagwrench {
namespace {

using test::golden_reports;

void expect_equal(const tagwrench_sample& got, const nlohmann::json& wanted) {
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(got.force_n[i], wanted["force_n"][i]);
    EXPECT_DOUBLE_EQ(got.torque_nm[i], wanted["torque_nm"][i]);
    EXPECT_DOUBLE_EQ(got.force_sigma_n[i], wanted["force_sigma_n"][i]);
    EXPECT_DOUBLE_EQ(got.torque_sigma_nm[i], wanted["torque_sigma_nm"][i]);
  }
  EXPECT_EQ(got.capture_time_ns, wanted["capture_time_ns"]);
  EXPECT_EQ(got.sequence, wanted["sequence"]);
  EXPECT_EQ(got.lost, wanted["lost"]);
  EXPECT_EQ(tagwrench_status_name(got.status), wanted["status"].get<std::string>());
  EXPECT_EQ(got.has_numbers, wanted["has_numbers"]);
}

/// The sample that the bridge would have sent.
Sample bridge_sample(const nlohmann::json& from) {
  Sample sample;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    sample.wrench[i] = from["force_n"][k];
    sample.wrench[i + 3] = from["torque_nm"][k];
    sample.wrench_sigma[i] = from["force_sigma_n"][k];
    sample.wrench_sigma[i + 3] = from["torque_sigma_nm"][k];
  }
  sample.capture_time = TimePoint(std::chrono::nanoseconds(from["capture_time_ns"]));
  sample.sequence = from["sequence"];
  sample.dropped = from["lost"];
  for (const Status status : {Status::ok, Status::lost, Status::saturated}) {
    if (from["status"] == name(status)) sample.status = status;
  }
  return sample;
}

TEST(ClientDecode, GoldenReports) {
  for (const test::GoldenReport& golden : golden_reports()) {
    SCOPED_TRACE(golden.what);
    tagwrench_sample got{};
    ASSERT_EQ(tagwrench_decode(golden.bytes.data(), golden.bytes.size(), &got), 1);
    expect_equal(got, golden.sample);
  }
}

TEST(ClientDecode, TheBridgeSendsTheGoldenBytes) {
  for (const test::GoldenReport& golden : golden_reports()) {
    SCOPED_TRACE(golden.what);
    const WrenchReport sent = wrench_report(bridge_sample(golden.sample));
    EXPECT_EQ(std::vector<std::uint8_t>(sent.begin(), sent.end()), golden.bytes);
  }
}

TEST(ClientDecode, WhatTheBridgeSendsComesBackToHalfAMicronewton) {
  constexpr double kHalfCount = 0.5e-6 * 1.000001;  // N and N m
  std::mt19937 random(11);
  std::uniform_real_distribution<double> force_N(-200, 200), torque_Nm(-20, 20), sigma(0, 2);
  for (int trial = 0; trial < 1000; ++trial) {
    Sample s;
    s.status = trial % 2 == 0 ? Status::ok : Status::saturated;
    for (int i = 0; i < 6; ++i) {
      s.wrench[i] = i < 3 ? force_N(random) : torque_Nm(random);
      s.wrench_sigma[i] = sigma(random);
    }
    s.sequence = random();
    s.capture_time = TimePoint(std::chrono::microseconds(random()));
    const WrenchReport report = wrench_report(s);
    tagwrench_sample got{};
    ASSERT_EQ(tagwrench_decode(report.data(), report.size(), &got), 1);
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_NEAR(got.force_n[i], s.wrench[i], kHalfCount);
      EXPECT_NEAR(got.torque_nm[i], s.wrench[i + 3], kHalfCount);
      EXPECT_NEAR(got.force_sigma_n[i], s.wrench_sigma[i], kHalfCount);
      EXPECT_NEAR(got.torque_sigma_nm[i], s.wrench_sigma[i + 3], kHalfCount);
    }
    EXPECT_EQ(got.sequence, s.sequence % (std::uint64_t{1} << 31));
    EXPECT_EQ(TimePoint(std::chrono::nanoseconds(got.capture_time_ns)), s.capture_time);
    EXPECT_STREQ(tagwrench_status_name(got.status), name(s.status));
  }
}

TEST(ClientDecode, EverySizeButSixtyFourBytesIsRefusedAndTheSampleLeftAlone) {
  const std::vector<std::uint8_t> bytes = golden_reports().front().bytes;
  std::vector<std::uint8_t> padded = bytes;
  padded.resize(130);
  for (std::size_t size = 0; size <= padded.size(); ++size) {
    if (size == bytes.size()) continue;
    tagwrench_sample got{};
    got.sequence = 12345;
    // A copy of exactly this size, so that a sanitizer sees a byte read beyond it.
    const std::vector<std::uint8_t> cut(padded.begin(),
                                        padded.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(tagwrench_decode(cut.data(), cut.size(), &got), TAGWRENCH_ERROR_SIZE) << size;
    EXPECT_EQ(got.sequence, 12345u);
  }
}

TEST(ClientDecode, AnotherReportIdIsRefused) {
  std::vector<std::uint8_t> bytes = golden_reports().front().bytes;
  for (const int id : {0, 1, 0x1f, 0x21, 0xff}) {
    bytes[0] = static_cast<std::uint8_t>(id);
    tagwrench_sample got{};
    EXPECT_EQ(tagwrench_decode(bytes.data(), bytes.size(), &got), TAGWRENCH_ERROR_REPORT);
  }
}

TEST(ClientDecode, AFieldOutsideItsDeclaredRangeIsRefused) {
  struct Change {
    const char* what;
    std::size_t at;
    std::vector<std::uint8_t> bytes;
  };
  const Change changes[] = {
      {"force below -(2^31 - 1)", 1, {0, 0, 0, 0x80}},
      {"torque below -(2^31 - 1)", 21, {0, 0, 0, 0x80}},
      {"force sigma above 2^31 - 1", 25, {0, 0, 0, 0x80}},
      {"torque sigma above 2^31 - 1", 45, {0xff, 0xff, 0xff, 0xff}},
      {"seconds above 2^31 - 1", 49, {0, 0, 0, 0x80}},
      {"a million microseconds", 53, {0x40, 0x42, 0x0f, 0}},
      {"sequence above 2^31 - 1", 57, {0, 0, 0, 0x80}},
      {"status 5", 63, {5}},
      {"status 255", 63, {255}},
  };
  for (const Change& change : changes) {
    std::vector<std::uint8_t> bytes = golden_reports().front().bytes;
    std::copy(change.bytes.begin(), change.bytes.end(),
              bytes.begin() + static_cast<std::ptrdiff_t>(change.at));
    tagwrench_sample got{};
    EXPECT_EQ(tagwrench_decode(bytes.data(), bytes.size(), &got), TAGWRENCH_ERROR_FIELD)
        << change.what;
  }
}

TEST(ClientDecode, AStatusWithoutNumbersHasNoneWhateverTheBytesSay) {
  for (const std::uint8_t status : {1, 2, 3}) {
    std::vector<std::uint8_t> bytes = golden_reports().front().bytes;
    bytes[63] = status;
    tagwrench_sample got{};
    ASSERT_EQ(tagwrench_decode(bytes.data(), bytes.size(), &got), 1);
    EXPECT_FALSE(got.has_numbers);
    EXPECT_EQ(got.force_n[2], 0);
    EXPECT_EQ(got.torque_nm[0], 0);
    EXPECT_EQ(got.force_sigma_n[0], 0);
    EXPECT_EQ(got.torque_sigma_nm[2], 0);
    EXPECT_EQ(got.sequence, 41u);
  }
}

TEST(ClientDecode, AnyBytesAreRefusedOrGiveNumbersInRange) {
  std::mt19937 random(3);
  int decoded = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::array<std::uint8_t, 64> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    bytes[0] = TAGWRENCH_REPORT_ID;
    for (const std::size_t high : {28, 32, 36, 40, 44, 48, 52, 60}) bytes[high] &= 0x7f;
    bytes[55] &= 0x07, bytes[56] = 0, bytes[63] &= 0x07;
    tagwrench_sample got{};
    if (tagwrench_decode(bytes.data(), bytes.size(), &got) <= 0) continue;
    ++decoded;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_LE(std::abs(got.force_n[i]), 2147.483647);
      EXPECT_LE(std::abs(got.torque_nm[i]), 2147.483647);
      EXPECT_GE(got.force_sigma_n[i], 0);
      EXPECT_GE(got.torque_sigma_nm[i], 0);
    }
    EXPECT_GE(got.capture_time_ns, 0);
    EXPECT_LE(got.lost, 65535u);
  }
  EXPECT_GT(decoded, 1000);
}

TEST(ClientDecode, StatusesHaveTheBridgesNames) {
  for (const Status status :
       {Status::ok, Status::acquiring, Status::lost, Status::doubtful, Status::saturated}) {
    const auto same = static_cast<tagwrench_status>(status);
    EXPECT_STREQ(tagwrench_status_name(same), name(status));
  }
}

TEST(ClientSequence, FramesBetweenTwoSamplesAreCountedAcrossTheTurnover) {
  EXPECT_EQ(tagwrench_missing(7, 8), 0u);
  EXPECT_EQ(tagwrench_missing(7, 7), 0u);
  EXPECT_EQ(tagwrench_missing(7, 10), 2u);
  EXPECT_EQ(tagwrench_missing(0x7fffffff, 0), 0u);
  EXPECT_EQ(tagwrench_missing(0x7ffffffe, 1), 2u);
  EXPECT_EQ(tagwrench_missing(1000, 3), 0u) << "a bridge that started again";
}

}  // namespace
}  // namespace tagwrench

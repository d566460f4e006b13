#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "golden.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {
namespace {

using namespace std::chrono_literals;

TimePoint at(Duration time) { return TimePoint(1h + time); }

TEST(ReadingStats, RateAndJitterAreThoseOfTheIntervals) {
  ReadingStats stats;
  for (const Duration time : {0ms, 40ms, 70ms, 120ms, 160ms}) stats.arrived(at(time));
  EXPECT_EQ(stats.reports, 5u);
  EXPECT_NEAR(stats.rate_hz(), 25, 1e-9);
  EXPECT_EQ(stats.interval_mean(), 40ms);
  EXPECT_NEAR(static_cast<double>(stats.interval_std().count()), std::sqrt(50.0) * 1e6, 1);  // ns
  EXPECT_EQ(stats.interval_max, 50ms);
}

TEST(ReadingStats, OneReportHasNoRate) {
  ReadingStats stats;
  stats.arrived(at(0ms));
  EXPECT_EQ(stats.rate_hz(), 0);
  EXPECT_EQ(stats.interval_std(), 0ms);
}

TEST(ReadingStats, MissingFramesAndGapsAreCountedApart) {
  ReadingStats stats;
  for (const std::uint32_t sequence : {7u, 8u, 12u, 13u, 15u}) {
    stats.sampled(sequence, std::nullopt);
  }
  EXPECT_EQ(stats.missing, 4u);
  EXPECT_EQ(stats.gaps, 2u);
}

TEST(ReadingStats, AnInterruptionIsNoIntervalAndNoGap) {
  ReadingStats stats;
  stats.arrived(at(0ms));
  stats.sampled(5, std::nullopt);
  stats.interrupted();
  stats.arrived(at(10s));
  stats.sampled(900, std::nullopt);
  EXPECT_EQ(stats.interval_max, 0ms);
  EXPECT_EQ(stats.missing, 0u);
}

TEST(ReadingStats, BetweenTwoSpansNothingIsLost) {
  ReadingStats stats;
  stats.arrived(at(0ms));
  stats.sampled(5, std::nullopt);
  stats.next_span();
  EXPECT_EQ(stats.reports, 0u);
  stats.arrived(at(40ms));
  stats.sampled(7, std::nullopt);
  EXPECT_EQ(stats.interval_max, 40ms);
  EXPECT_EQ(stats.missing, 1u);
}

TEST(ReadingStats, QuantilesAreWithinTwoPercent) {
  std::mt19937 random(2);
  std::lognormal_distribution<double> latency_us(7, 1);
  DurationHistogram histogram;
  std::vector<double> all;
  for (int i = 0; i < 5000; ++i) {
    all.push_back(std::max(1.0, latency_us(random)));
    histogram.add(std::chrono::duration_cast<Duration>(
        std::chrono::duration<double, std::micro>(all.back())));
  }
  std::sort(all.begin(), all.end());
  for (const double part : {0.5, 0.99}) {
    const double wanted = all[static_cast<std::size_t>(part * 5000) - 1];
    const double got = 1e-3 * static_cast<double>(histogram.quantile(part).count());
    EXPECT_NEAR(got, wanted, 0.02 * wanted) << part;
  }
  EXPECT_LE(histogram.quantile(1), histogram.max());
}

TEST(ReadingStats, DurationsOutsideTheHistogramAreInItsEndClasses) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0ns);
  histogram.add(0ns);
  EXPECT_LE(histogram.quantile(0.5), 2us);
  histogram.add(24h * 365);
  EXPECT_EQ(histogram.max(), 24h * 365);
}

Reading golden_reading(std::size_t index = 0) {
  Reading reading;
  const auto golden = test::golden_reports().at(index);
  tagwrench_decode(golden.bytes.data(), golden.bytes.size(), &reading.wrench);
  reading.time = TimePoint(std::chrono::nanoseconds(reading.wrench.capture_time_ns) + 1500us);
  reading.missing = 3;
  return reading;
}

Reading puck_reading() {
  Reading reading;
  reading.kind = HidKind::puck;
  reading.time = at(0ms);
  reading.puck = {{1, -2, 350, -350, 0, 6}, 3};
  return reading;
}

TEST(ReadingText, JsonHasTheBridgesKeysAndTheTimeOfReading) {
  ReadingBuffer buffer;
  const auto line = nlohmann::json::parse(json_line(buffer, golden_reading()));
  EXPECT_EQ(line["host_ns"], 7001750000);
  EXPECT_EQ(line["seq"], 41);
  EXPECT_EQ(line["t_ns"], 7000250000);
  EXPECT_EQ(line["status"], "ok");
  EXPECT_EQ(line["f_n"], (std::vector<double>{0.1, -0.25, 3}));
  EXPECT_EQ(line["m_nm"], (std::vector<double>{0.001, -0.002, 0}));
  EXPECT_EQ(line["w_sigma"], (std::vector<double>{0.01, 0.02, 0.03, 1e-4, 2e-4, 3e-4}));
  EXPECT_EQ(line["dropped"], 2);
  EXPECT_EQ(line["missing"], 3);
  EXPECT_EQ(line["latency_us"], 1500);
}

TEST(ReadingText, ALatencyOfAnotherClockIsNone) {
  ReadingBuffer buffer;
  Reading reading = golden_reading();
  for (const Duration off : {Duration(-1ms), Duration(10s)}) {
    reading.time = TimePoint(std::chrono::nanoseconds(reading.wrench.capture_time_ns)) + off;
    EXPECT_TRUE(nlohmann::json::parse(json_line(buffer, reading))["latency_us"].is_null());
    EXPECT_TRUE(csv_line(buffer, reading).ends_with(",2,3,\n"));
  }
}

TEST(ReadingText, ASampleOfNoPictureHasNoLatency) {
  const Reading neutral = golden_reading(2);
  ASSERT_EQ(neutral.wrench.capture_time_ns, 0);
  EXPECT_FALSE(latency_of(neutral));
}

TEST(ReadingText, CsvRowsHaveTheColumnsOfTheirHeader) {
  ReadingBuffer buffer;
  for (const Reading& reading : {golden_reading(0), golden_reading(1), puck_reading()}) {
    const std::string_view header = csv_header(reading.kind);
    const auto columns = std::count(header.begin(), header.end(), ',');
    const std::string_view row = csv_line(buffer, reading);
    EXPECT_EQ(std::count(row.begin(), row.end(), ','), columns) << row;
    EXPECT_TRUE(row.ends_with("\n"));
  }
}

TEST(ReadingText, PucksHaveCountsAndButtons) {
  ReadingBuffer buffer;
  const auto line = nlohmann::json::parse(json_line(buffer, puck_reading()));
  EXPECT_EQ(line["counts"], (std::vector<int>{1, -2, 350, -350, 0, 6}));
  EXPECT_EQ(line["buttons"], 3);
  EXPECT_EQ(csv_line(buffer, puck_reading()), "3600000000000,1,-2,350,-350,0,6,3\n");
}

TEST(ReadingText, TheLiveLineSaysNewtonsRateJitterMissingFramesAndLatency) {
  ReadingStats stats;
  for (const Duration time : {0ms, 40ms, 80ms}) stats.arrived(at(time));
  ReadingBuffer buffer;
  EXPECT_EQ(live_line(buffer, golden_reading(), stats, 3),
            "ok        F  +0.100  -0.250  +3.000 N  M  +0.0010  -0.0020  +0.0000 N m   25.0/s, "
            "jitter 0.00 ms, longest 40.0, missing 3, latency 1.5 ms");
  EXPECT_EQ(live_line(buffer, puck_reading(), stats, 0),
            "X   +1 Y   -2 Z +350 RX -350 RY   +0 RZ   +6  buttons 3   25.0/s, jitter 0.00 ms, "
            "longest 40.0");
}

TEST(ReadingText, TheSummaryHasWhatWasMissedAndWhatWasNotUnderstood) {
  ReadingStats stats;
  for (int i = 0; i < 3; ++i) {
    stats.arrived(at(i * 40ms));
    stats.sampled(static_cast<std::uint32_t>(2 * i), 1ms);
  }
  ++stats.strangers;
  const HidNode node{HidKind::wrench, 0x1209, 0x7a6e, "/dev/hidraw3", "bench", ""};
  const std::string text = summary(node, stats, 80ms);
  EXPECT_EQ(text,
            "1209:7a6e bench (/dev/hidraw3): 3 reports in 0.1 s, 25.00/s, interval 40.00 ms, "
            "standard deviation 0.00, longest 40.0; 2 frames missing in 2 gaps; latency median "
            "1.00 ms, p99 1.00, max 1.00; not understood: 1");
  ReadingStats simulated;
  simulated.arrived(at(0ms));
  simulated.sampled(1, std::nullopt);
  EXPECT_NE(summary(node, simulated, 80ms).find("another clock"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench

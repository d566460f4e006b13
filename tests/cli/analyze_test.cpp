// `tagwrench analyze` as its users run it.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/recording/writer.h"
#include "tests/cli/bridge.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class Analyze : public ::testing::Test {
 protected:
  /// Two columns of readings that are twice the loads Fx and Mz, in mm and degrees, semicolons.
  fs::path readings(int rows = 400) const {
    const fs::path file = folder_ / "other.csv";
    std::ofstream out(file);
    out << "t;x;turn;fx;mz\n";
    for (int i = 0; i < rows; ++i) {
      const double t = 0.02 * i;
      const double fx = std::sin(3.1 * t) + 0.4 * std::cos(7.7 * t);
      const double mz = 20 * std::sin(4.3 * t + 1);
      // A reading that wavers by its own rule, not by chance.
      out << 1000 * t << ';' << 2 * fx + 1e-3 * std::sin(1e4 * t) << ';' << 0.05 * mz << ';' << fx
          << ';' << mz << '\n';
    }
    return file;
  }
  std::vector<std::string> mapped(const fs::path& file) const {
    return {"analyze",     "--readings", file,         "--reading-time", "t",
            "--time-unit", "ms",         "--features", "x:mm",           "--features",
            "turn:deg",    "--load",     "fx:N",       "--load",         "mz:mNm:axes=Mz"};
  }
  static Outcome run(std::vector<std::string> arguments,
                     const std::vector<std::string>& more = {}) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Bridge(arguments).finish();
  }

  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
};

void expect_refused(const Outcome& outcome, const std::string& part) {
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST_F(Analyze, OtherPeoplesFileGivesATableAndJson) {
  const fs::path file = readings();
  const Outcome text = run(mapped(file));
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("each of 5 blocks in time"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("warning: Fy Fz Mx My: not calibrated: never loaded"), std::string::npos)
      << text.out;

  const Outcome structured = run(mapped(file), {"--json", "-", "--series"});
  ASSERT_EQ(structured.status, 0) << structured.err;
  const json root = json::parse(structured.out);
  EXPECT_EQ(root["format"], "tagwrench-analysis-1");
  EXPECT_GT(root["axes"][0]["r2"].get<double>(), 0.999);
  EXPECT_TRUE(root["axes"][0]["calibrated"].get<bool>());
  EXPECT_FALSE(root["axes"][1]["calibrated"].get<bool>());
  EXPECT_NEAR(root["matrix"][0][0].get<double>(), 500, 1) << "N/m: 1 N is 2 mm";
  EXPECT_EQ(root["held_out"]["t_s"].size(), root["held_out"]["predicted"].size());
  EXPECT_GT(root["held_out"]["t_s"].size(), 390U);
}

TEST_F(Analyze, WhatWasMappedCanBeKeptAndAnalyzedAgain) {
  const fs::path kept = folder_ / "kept.data.csv";
  const Outcome first = run(mapped(readings()), {"--data", kept, "--json", "-"});
  ASSERT_EQ(first.status, 0) << first.err;
  const fs::path file = folder_ / "again.json";
  const Outcome second = run({"analyze", kept, "--json", file});
  ASSERT_EQ(second.status, 0) << second.err;
  EXPECT_NE(second.out.find("axis"), std::string::npos);
  std::ifstream in(file);
  EXPECT_EQ(json::parse(in)["axes"], json::parse(first.out)["axes"]);
}

/// 20 s of a platform moved every way, with a reference that feels 500 times what is seen.
fs::path recorded(const fs::path& file, int axes = 6) {
  record::Head head;
  head.width = 64;
  head.height = 48;
  head.period = std::chrono::milliseconds(20);
  head.keep = record::Keep::none;
  record::WriterOptions options;
  options.path = file;
  options.lossless = true;
  record::RecordingWriter writer(options, head);
  const auto moved = [](double t) {
    Vector6 d;
    for (int k = 0; k < 6; ++k) d[k] = 1e-3 * std::sin((2 + 0.7 * k) * t + k);
    return d;
  };
  const TimePoint origin{std::chrono::seconds(100)};
  const auto at = [&](double t) {
    return origin + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(t));
  };
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.02 * i;
    Frame frame;
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.capture_time = frame.latency_origin = at(t);
    frame.image.width = 64;
    frame.image.height = 48;
    writer.frame(frame, {}, {});
    Track track;
    track.status = i % 100 == 99 ? Status::lost : Status::ok;
    track.displacement = moved(t - 0.03) + Vector6::Constant(1e-6 * std::sin(1e5 * t));
    track.covariance = 1e-12 * Matrix6::Identity();
    writer.track(track);
    for (const double half : {0.0, 0.01}) {
      record::ReferenceRecord reading;
      reading.time = at(t + half);
      reading.axes = axes;
      const Vector6 felt = 500 * moved(t + half);
      for (std::size_t k = 0; k < 6; ++k) {
        reading.value[k] = felt[static_cast<Eigen::Index>(k)];
        reading.sigma[k] = 1e-3;
      }
      writer.reference(reading);
    }
  }
  EXPECT_EQ(writer.finish(), "");
  return file;
}

TEST_F(Analyze, ARecordingWithASixAxisReference) {
  const Outcome outcome = run({"analyze", recorded(folder_ / "a.twr"), "--json", "-"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const json root = json::parse(outcome.out);
  EXPECT_NEAR(root["lag"]["s"].get<double>(), 0.03, 1e-3) << "s";
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_GT(root["axes"][k]["r2"].get<double>(), 0.999);
    EXPECT_NEAR(root["matrix"][k][k].get<double>(), 500, 2);
  }
  EXPECT_NE(root["warnings"].dump().find("10 frames without the target"), std::string::npos);
  expect_refused(run({"analyze", recorded(folder_ / "b.twr", 1)}), "no six-axis reference");
}

TEST_F(Analyze, WrongUseIsRefusedInOneLine) {
  const fs::path file = readings();
  expect_refused(run({"analyze"}), "name a data file");
  expect_refused(run({"analyze", file}), "tagwrench-data-1");
  expect_refused(run({"analyze", folder_ / "none.data.csv"}), "cannot be read");
  expect_refused(run({"analyze", "--readings", file}), "--features");
  expect_refused(run(mapped(file), {"--features", "nothing"}), "no column 'nothing'");
  expect_refused(run(mapped(file), {"--separator", ","}), "--separator");
  expect_refused(run(mapped(file), {"--hold-out", "2"}), "--hold-out");
  expect_refused(run(mapped(file), {"--json", folder_ / "no" / "such.json"}), "such.json");
  expect_refused(run(mapped(readings(3))), "record more");
}

TEST_F(Analyze, WhatIsReadIsNotWrittenOver) {
  const fs::path file = readings();
  const auto size = fs::file_size(file);
  for (const char* option : {"--json", "--data"}) {
    expect_refused(run(mapped(file), {option, file}), "is what is to be read");
    expect_refused(run(mapped(file), {option, folder_ / "." / "other.csv"}),
                   "is what is to be read");
    EXPECT_EQ(fs::file_size(file), size);
  }
}

TEST_F(Analyze, FilesThatAreThereAreReplacedOnlyByForce) {
  const fs::path file = readings();
  const fs::path there = folder_ / "there";
  for (const char* option : {"--json", "--data"}) {
    std::ofstream(there) << "somebody's";
    expect_refused(run(mapped(file), {option, there}), "there: is there already; name another");
    EXPECT_EQ(read_file(there), "somebody's");
    const Outcome forced = run(mapped(file), {option, there, "--force"});
    EXPECT_EQ(forced.status, 0) << forced.err;
    EXPECT_GT(read_file(there).size(), 100U);
  }
  fs::remove(there);
  expect_refused(run(mapped(file), {"--json", there, "--data", there}), "is where --json goes");
  EXPECT_FALSE(fs::exists(there));
}

TEST_F(Analyze, TheSameDataTwiceAreNamedByTheirFiles) {
  const fs::path one = folder_ / "one.data.csv";
  const fs::path other = folder_ / "other.data.csv";
  ASSERT_EQ(run(mapped(readings()), {"--data", one}).status, 0);
  fs::copy_file(one, other);
  expect_refused(run({"analyze", one, other}),
                 one.string() + " and " + other.string() + ": are the same data twice");
}

TEST_F(Analyze, ABrokenRowIsNamed) {
  const fs::path file = readings();
  std::ofstream(file, std::ios::app) << "8000;1;NaN;1;1\n";
  expect_refused(run(mapped(file)), "other.csv:402: column 3 (turn) is 'NaN'");
  std::ofstream(readings(), std::ios::app) << "8000;1;1;1e308;1\n";
  expect_refused(run(mapped(file)), "other.csv:402: column 4 (fx) is '1e308', which no");
}

}  // namespace
}  // namespace tagwrench::test

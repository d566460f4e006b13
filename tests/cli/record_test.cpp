// Recording as users do it: record, replay, export; and what is left when the program is killed.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "host/recording/database.h"
#include "host/recording/reader.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

namespace fs = std::filesystem;

/// Small pictures: this is about files.
constexpr const char* kSmall =
    "camera: {width: 320, height: 240, fx: 402.5, fy: 402.5, cx: 159.75, cy: 119.75}\n"
    "trajectory: {motion: compound, rest_s: 1.1}\n";

class Record : public testing::Test {
 protected:
  Record() { write_file(folder_ / "small.yaml", kSmall); }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  std::string small() const { return "sim:" + file("small.yaml"); }
  Outcome record(const std::string& source, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"record",
                                       "--out",
                                       file("r.twr"),
                                       "--source",
                                       source,
                                       "--output",
                                       "jsonl:" + file("live.jsonl"),
                                       "--fast"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  }
  Outcome replay(const std::vector<std::string>& more = {"--fast"}) {
    std::vector<std::string> arguments{"run", "--source", "recording:" + file("r.twr"), "--output",
                                       "jsonl:" + file("replay.jsonl")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  }
  void expect_replay_is_the_same(std::size_t frames) {
    const Outcome ran = replay();
    EXPECT_EQ(ran.status, 0) << ran.err;
    const std::string live = read_file(file("live.jsonl"));
    EXPECT_EQ(lines_in(live), frames);
    EXPECT_NE(live.find("\"status\":\"ok\""), std::string::npos) << "the target was never held";
    EXPECT_TRUE(live == read_file(file("replay.jsonl"))) << "not the same bytes";
  }

  TemporaryFolder folder_;
};

TEST_F(Record, AReplayPrintsTheSameBytes) {
  for (const char* keep : {"raw", "region"}) {
    fs::remove(file("r.twr"));
    const Outcome made = record(small(), {"--frames", "60", "--keep", keep});
    ASSERT_EQ(made.status, 0) << made.err;
    EXPECT_NE(made.err.find("60 frames"), std::string::npos) << made.err;
    expect_replay_is_the_same(60);
    if (std::string(keep) == "region") continue;
    const Outcome paced = replay({"--frames", "12"});
    EXPECT_EQ(paced.status, 0) << paced.err;
  }
}

TEST_F(Record, AReplayOfALiveSourcePrintsTheSameBytes) {
  const Outcome made = run_bridge({"record", "--out", file("r.twr"), "--source", small(),
                                   "--output", "jsonl:" + file("live.jsonl"), "--frames", "30"});
  ASSERT_EQ(made.status, 0) << made.err;
  expect_replay_is_the_same(lines_in(read_file(file("live.jsonl"))));
}

TEST_F(Record, JpegFilesAreKeptAsTheyAreAndReplayedToTheSameBytes) {
  write_file(folder_ / "jpeg.yaml",
             std::string(kSmall) + "compression: {file: jpeg, jpeg_quality: 85}\n");
  const Outcome sim = run_bridge(
      {"sim", "--scenario", file("jpeg.yaml"), "--out", file("frames"), "--frames", "40"});
  ASSERT_EQ(sim.status, 0) << sim.err;
  ASSERT_EQ(record("images:" + file("frames")).status, 0);
  expect_replay_is_the_same(40);
  const Outcome exported = run_bridge({"export", file("r.twr"), "--frames", file("out")});
  ASSERT_EQ(exported.status, 0) << exported.err;
  for (const char* name : {"000000.jpg", "000039.jpg", "frames.csv", "sensor.yaml"})
    EXPECT_EQ(read_file(folder_ / "out" / name), read_file(folder_ / "frames" / name)) << name;
}

/// Without the latency, which is that of the run.
std::string without_latency(const std::string& jsonl) {
  std::string out;
  std::istringstream lines(jsonl);
  for (std::string line; std::getline(lines, line);)
    out += line.substr(0, line.find("\"dropped\""));
  return out;
}

TEST_F(Record, ExportedFramesAreAFolderThatRunsTheSame) {
  ASSERT_EQ(record(small(), {"--frames", "40"}).status, 0);
  ASSERT_EQ(run_bridge({"export", file("r.twr"), "--frames", file("out/")}).status, 0);
  const Outcome ran =
      run_bridge({"run", "--source", "images:" + file("out"), "--fast", "--output", "jsonl:-"});
  EXPECT_EQ(without_latency(ran.out), without_latency(read_file(file("live.jsonl"))));
  const Outcome again = run_bridge({"export", file("r.twr"), "--frames", file("out")});
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("exists"), std::string::npos);
}

TEST_F(Record, ASensorYamlThatNamesItsCalibrationIsRecordedWithIt) {
  ASSERT_EQ(run_bridge({"sim", "--scenario", file("small.yaml"), "--out", file("frames"),
                        "--frames", "40"})
                .status,
            0);
  const std::string sensor = file("frames/sensor.yaml");
  const std::string text = read_file(sensor);
  const auto number = [&](const std::string& key) {
    return std::stoi(text.substr(text.find(key) + key.size()));
  };
  std::string rows;
  for (int r = 0; r < 6; ++r) {
    rows += r == 0 ? "[" : "],[";
    for (int c = 0; c < 6; ++c) rows += std::string(c == 0 ? "" : ",") + (r == c ? "777" : "0");
  }
  write_file(file("frames/old.json"),
             R"({"format":"tagwrench-calibration-1","sensor":{"family":"aruco_original",)"
             R"("tag_ids":[5,2],"tag_size_mm":3.8,"image_px":[)" +
                 std::to_string(number("width: ")) + "," + std::to_string(number("height: ")) +
                 R"(]},"K":[)" + rows + R"(]],"B":[0,0,0,0,0,0],"range":[1,1,1,1,1,1]})");
  write_file(sensor, std::string(text).replace(text.find("wrench:\n"), 8,
                                               "wrench:\n  calibration: old.json\n"));
  const Outcome live = record("images:" + file("frames"), {"--frames", "40"});
  ASSERT_EQ(live.status, 0) << live.err;
  ASSERT_EQ(run_bridge({"export", file("r.twr"), "--frames", file("out")}).status, 0);
  fs::remove_all(file("frames"));
  for (const std::string& source : {"recording:" + file("r.twr"), "images:" + file("out")}) {
    const Outcome again = run_bridge({"run", "--source", source, "--fast", "--output", "jsonl:-"});
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_EQ(without_latency(again.out), without_latency(read_file(file("live.jsonl")))) << source;
    EXPECT_EQ(again.err.find("sensor.yaml's springs"), std::string::npos) << again.err;
  }
}

TEST_F(Record, ExportedFramesRunWithTheAppearanceOfTheirSensor) {
  write_file(folder_ / "moving.yaml", std::string(kSmall) + "seed: 3\n");
  ASSERT_EQ(run_bridge({"sim", "--scenario", file("moving.yaml"), "--out", file("frames"),
                        "--frames", "90"})
                .status,
            0);
  const std::string sensor = file("frames/sensor.yaml");
  const Outcome learned = run_bridge(
      {"calibrate", "target", "--sensor", sensor, "--source", "images:" + file("frames")});
  ASSERT_EQ(learned.status, 0) << learned.err;
  const std::string appearance = read_file(file("frames/measured/rest.png"));
  ASSERT_EQ(record("images:" + file("frames"), {"--frames", "30"}).status, 0);
  const Outcome exported =
      run_bridge({"export", file("r.twr"), "--frames", file("out"), "--csv", file("out.csv")});
  ASSERT_EQ(exported.status, 0) << exported.err;
  EXPECT_NE(exported.err.find("30 frames in " + file("out")), std::string::npos) << exported.err;
  EXPECT_NE(exported.err.find("30 samples in " + file("out.csv")), std::string::npos)
      << exported.err;
  EXPECT_EQ(read_file(file("out/measured/rest.png")), appearance);
  EXPECT_EQ(read_file(file("out/measured/target.yaml")),
            read_file(file("frames/measured/target.yaml")));
  EXPECT_EQ(read_file(file("out/sensor.yaml")), read_file(sensor));
  // The recording has them, whatever becomes of the folder.
  fs::remove_all(file("frames/measured"));
  const Outcome replayed = run_bridge(
      {"run", "--source", "recording:" + file("r.twr"), "--fast", "--output", "jsonl:-"});
  EXPECT_EQ(replayed.status, 0) << replayed.err;
  EXPECT_EQ(replayed.out.find("acquiring"), std::string::npos) << "its rest is known";
  EXPECT_NE(replayed.err.find("target: measured/target.yaml"), std::string::npos) << replayed.err;
  const Outcome ran = run_bridge({"run", "--source", "images:" + file("out"), "--fast", "--frames",
                                  "5", "--output", "jsonl:-"});
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_EQ(lines_in(ran.out), 5U) << ran.err;
  EXPECT_NE(ran.out.find("\"status\":\"ok\""), std::string::npos) << ran.out;
  // A picture without a time is still refused.
  fs::copy_file(file("out/000000.png"), file("out/appearance.png"));
  const Outcome refused = run_bridge({"run", "--source", "images:" + file("out"), "--fast"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("has no time for appearance.png"), std::string::npos) << refused.err;
}

TEST_F(Record, ExportedSamplesAreTheBytesOfTheCsvOutput) {
  ASSERT_EQ(
      record(small(), {"--frames", "40", "--output", "csv:" + file("live.csv"), "--keep", "none"})
          .status,
      0);
  ASSERT_EQ(run_bridge({"export", file("r.twr"), "--csv", file("out.csv"), "--events",
                        file("events.csv"), "--references", file("references.csv")})
                .status,
            0);
  EXPECT_EQ(read_file(file("out.csv")), read_file(file("live.csv")));
  EXPECT_NE(read_file(file("events.csv")).find("rest pose learned"), std::string::npos);
  EXPECT_EQ(lines_in(read_file(file("references.csv"))), 1U) << "no reference was there";
  const Outcome again = run_bridge({"export", file("r.twr"), "--csv", file("out.csv")});
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("--force"), std::string::npos);
  const Outcome refused = replay();
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("--keep none"), std::string::npos);
}

TEST_F(Record, ThePapersColumnsHoldTheMotionOfBothTags) {
  ASSERT_EQ(record(small(), {"--frames", "60"}).status, 0);
  const Outcome exported = run_bridge({"export", file("r.twr"), "--paper", file("p")});
  ASSERT_EQ(exported.status, 0) << exported.err;
  EXPECT_FALSE(fs::exists(file("p_optoforceData.csv"))) << "there was no reference";
  // The mean position of both tags is that of the platform's origin but for its turning, which
  // moves the two in opposite directions.
  record::RecordingReader reader(file("r.twr"));
  std::vector<Vector6> moved;
  for (record::TrackRecord r; reader.next(r);) {
    if (r.track.status == Status::ok) moved.push_back(r.track.displacement);
  }
  std::ifstream in(file("p_arucotagData.csv"));
  std::size_t rows = 0;
  for (std::string line; std::getline(in, line); ++rows) {
    std::vector<std::string> fields;
    std::istringstream text(line);
    for (std::string field; std::getline(text, field, ';');) fields.push_back(field);
    ASSERT_EQ(fields.size(), 21U) << line;
    EXPECT_EQ(std::stod(fields[20]), 0.2);
    ASSERT_LT(rows, moved.size());
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(std::stod(fields[static_cast<std::size_t>(14 + i)]) + 0.05,
                  moved[rows][i] - moved[0][i], 20e-6)
          << "m, row " << rows;
    }
  }
  EXPECT_EQ(rows, moved.size());
  EXPECT_GT(rows, 20U);
}

TEST_F(Record, ExportedEventsHaveNothingThatATerminalWouldObey) {
  ASSERT_EQ(record(small(), {"--frames", "40", "--keep", "none"}).status, 0);
  record::Database(file("r.twr"), record::Database::Mode::write)
      .run("UPDATE events SET text = 'a' || char(27) || ']0;b' || char(8238) WHERE kind = 'note'");
  const Outcome got = run_bridge({"export", file("r.twr"), "--events", "-"});
  EXPECT_EQ(got.status, 0) << got.err;
  EXPECT_NE(got.out.find("a\\x1b]0;b\\xe2\\x80\\xae"), std::string::npos) << got.out;
  EXPECT_EQ(got.out.find('\x1b'), std::string::npos);
}

TEST_F(Record, ARecordingIsNotOverwrittenAndNonsenseIsRefused) {
  write_file(folder_ / "r.twr", "somebody's");
  const Outcome refused = record(small(), {"--frames", "3"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("choose another name"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(file("live.jsonl"))) << "refused before anything else is made";
  const Outcome replayed = replay();
  EXPECT_EQ(replayed.status, 2);
  EXPECT_NE(replayed.err.find("is not a recording"), std::string::npos) << replayed.err;
  EXPECT_EQ(lines_in(replayed.err), 1U) << replayed.err;
  EXPECT_EQ(run_bridge({"export", file("r.twr")}).status, 2);
}

TEST_F(Record, AFullDiskEndsItWithOneAndTheRestIsReadable) {
  // The shell's limit stands in for the disk.
  const std::string command = std::string("ulimit -f 20000; exec ") + TAGWRENCH_PROGRAM +
                              " record --fast --source " + small() + " --out " + file("r.twr");
  const Outcome ended = Bridge({"-c", command}, "/dev/null", "/bin/bash").finish();
  EXPECT_EQ(ended.status, 1) << ended.err;
  EXPECT_NE(ended.err.find("the file could not grow: files may have 20.5 MB here (ulimit -f)"),
            std::string::npos)
      << ended.err;
  const Outcome ran = replay();
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_NE(ran.err.find("was not closed: its last seconds may be missing"), std::string::npos)
      << ran.err;
  const std::size_t kept = lines_in(read_file(file("replay.jsonl")));
  EXPECT_GT(kept, 5U);
  EXPECT_NE(ended.err.find("its first " + std::to_string(kept) + " frames, "), std::string::npos)
      << kept << " frames; " << ended.err;
  const Outcome exported = run_bridge({"export", file("r.twr"), "--csv", file("out.csv")});
  EXPECT_EQ(exported.status, 0);
  EXPECT_NE(exported.err.find("was not closed"), std::string::npos) << exported.err;
}

class DamagedRecord : public Record {
 protected:
  /// A recording with some pages in the middle, where its frames are, written over.
  DamagedRecord() {
    EXPECT_EQ(record(small(), {"--frames", "60"}).status, 0);
    std::string bytes = read_file(file("r.twr"));
    const std::size_t middle = bytes.size() / 2 / 4096 * 4096;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(middle), 3 * 4096, 'x');
    write_file(folder_ / "r.twr", bytes);
    fs::remove(file("live.jsonl"));
  }
  void expect_refused(const Outcome& outcome) const {
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_EQ(lines_in(outcome.err), 1U) << outcome.err;
    EXPECT_NE(outcome.err.find("r.twr: is damaged: "), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find(" of 60 frames, "), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("--despite-damage"), std::string::npos) << outcome.err;
  }
};

TEST_F(DamagedRecord, EndsWithOneAndNothingIsMadeOfIt) {
  expect_refused(replay());
  expect_refused(run_bridge({"export", file("r.twr"), "--csv", file("out.csv"), "--frames",
                             file("frames"), "--events", file("events.csv")}));
  ASSERT_EQ(
      run_bridge({"sim", "--scenario", file("small.yaml"), "--out", file("sim"), "--frames", "1"})
          .status,
      0);
  expect_refused(run_bridge({"calibrate", "target", "--sensor", file("sim/sensor.yaml"), "--source",
                             "recording:" + file("r.twr")}));
  expect_refused(run_bridge({"analyze", file("r.twr")}));
  for (const char* made : {"replay.jsonl", "out.csv", "events.csv", "frames", "sim/measured"})
    EXPECT_FALSE(fs::exists(file(made))) << made;
}

TEST_F(DamagedRecord, IsTakenAsFarAsItGoesWhenThatIsAskedFor) {
  const Outcome ran = replay({"--fast", "--despite-damage"});
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_NE(ran.err.find(" of 60 frames were read"), std::string::npos) << ran.err;
  const std::size_t read = lines_in(read_file(file("replay.jsonl")));
  EXPECT_GT(read, 5U);
  EXPECT_LT(read, 60U);
  const Outcome exported =
      run_bridge({"export", file("r.twr"), "--frames", file("frames"), "--despite-damage"});
  EXPECT_EQ(exported.status, 0) << exported.err;
  EXPECT_EQ(lines_in(read_file(file("frames/frames.csv"))), read + 1);
}

TEST_F(Record, PixelsThatCannotBeDecodedEndItWithOne) {
  write_file(folder_ / "jpeg.yaml", std::string(kSmall) + "compression: {file: jpeg}\n");
  ASSERT_EQ(
      run_bridge({"sim", "--scenario", file("jpeg.yaml"), "--out", file("jpegs"), "--frames", "40"})
          .status,
      0);
  ASSERT_EQ(record("images:" + file("jpegs")).status, 0);
  {
    record::Database database(file("r.twr"), record::Database::Mode::write);
    database.run(
        "UPDATE frames SET bytes = zeroblob(length(bytes)) WHERE id = (SELECT max(id) FROM "
        "frames)");
  }
  const Outcome ran = replay();
  EXPECT_EQ(ran.status, 1) << ran.err;
  EXPECT_NE(ran.err.find("1 of 40 frames cannot be decoded"), std::string::npos) << ran.err;
  EXPECT_EQ(replay({"--fast", "--despite-damage"}).status, 0);
  EXPECT_EQ(run_bridge({"export", file("r.twr"), "--frames", file("out")}).status, 1);
  EXPECT_FALSE(fs::exists(file("out")));
}

TEST_F(Record, ALimitThatLetsNothingBeginLeavesNoFile) {
  // KiB: shorter than the head, at one write and in the middle of one.
  for (const char* limit : {"16", "60", "100"}) {
    const std::string command = std::string("ulimit -f ") + limit + "; exec " + TAGWRENCH_PROGRAM +
                                " record --fast --source " + small() + " --out " + file("r.twr");
    const Outcome ended = Bridge({"-c", command}, "/dev/null", "/bin/bash").finish();
    EXPECT_EQ(ended.status, 2) << limit << ended.err;
    EXPECT_NE(ended.err.find("(ulimit -f); nothing was recorded"), std::string::npos) << ended.err;
    for (const char* part : {"", "-wal", "-shm"})
      EXPECT_FALSE(fs::exists(file("r.twr") + part)) << limit << part;
  }
}

TEST_F(Record, OneFrameIsOneFrame) {
  const Outcome made = record(small(), {"--frames", "1"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.err.find("r.twr: 1 frame, "), std::string::npos) << made.err;
  const Outcome ran = replay();
  EXPECT_NE(ran.err.find("r.twr: 1 frame in "), std::string::npos) << ran.err;
  EXPECT_EQ(ran.err.find("was not closed"), std::string::npos) << ran.err;
}

/// In memory where that is possible: a kill is about the program, not about the disk.
fs::path roomy() {
  return ::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : fs::temp_directory_path();
}

struct Killed {
  fs::path file;
  TimePoint at{};
};

TEST_F(Record, KilledAHundredTimesItLosesAtMostTheLastSecond) {
  constexpr int kAtOnce = 20;
  constexpr int kRounds = 5;
  const fs::path folder = roomy() / fs::path(folder_.path()).filename();
  fs::create_directories(folder);
  std::minstd_rand random(20200531);
  int long_lived = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::unique_ptr<Bridge>> bridges;
    std::vector<Killed> killed;
    std::vector<std::pair<int, std::size_t>> order;  // ms after the start, number
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      killed.push_back({folder / (std::to_string(round) + "-" + std::to_string(i)), {}});
      bridges.push_back(std::make_unique<Bridge>(
          std::vector<std::string>{"record", "--source", small(), "--keep", "region", "--out",
                                   killed.back().file, "--output", "jsonl:-"}));
      order.emplace_back(static_cast<int>(random() % 1600), i);
    }
    // From when they all run, so that the first to go has something to lose.
    for (const auto& bridge : bridges) ASSERT_TRUE(bridge->wait_for_lines(1)) << bridge->err();
    const auto start = std::chrono::steady_clock::now();
    std::sort(order.begin(), order.end());
    for (const auto& [ms, i] : order) {
      std::this_thread::sleep_until(start + std::chrono::milliseconds(ms));
      killed[i].at = std::chrono::steady_clock::now();
      bridges[i]->signal(SIGKILL);
    }
    for (const auto& bridge : bridges) EXPECT_EQ(bridge->finish().status, 128 + SIGKILL);
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      // What the program said before the second that may be lost.
      record::RecordingReader reader(killed[i].file);
      EXPECT_FALSE(reader.head().closed);
      TimePoint last{};
      for (Sample sample; reader.next(sample);) last = sample.output_time;
      if (killed[i].at - start > std::chrono::seconds(1)) {
        ++long_lived;
        EXPECT_GT(last, killed[i].at - std::chrono::seconds(1)) << killed[i].file;
      }
      record::Database database(killed[i].file, record::Database::Mode::read);
      record::Statement check(database, "PRAGMA integrity_check");
      ASSERT_TRUE(check.step());
      EXPECT_EQ(check.text(0), "ok");
      const auto count = [&](const char* sql) { return database.number(sql); };
      const auto frames = count("SELECT count(*) FROM frames");
      EXPECT_EQ(count("SELECT count(*) FROM tracks"), frames);
      EXPECT_EQ(count("SELECT count(*) FROM samples WHERE id IN (SELECT id FROM frames)"), frames);
      EXPECT_EQ(count("SELECT count(*) FROM frames WHERE bytes IS NULL"), 0);
    }
  }
  EXPECT_GT(long_lived, 20) << "else nothing was shown";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace tagwrench::test

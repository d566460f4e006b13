// `tagwrench board` as its users run it, against a model of a board.
#include <sys/resource.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <set>

#include "board_cli.h"
#include "tests/unit/board/optoforce_frames.h"

namespace tagwrench::test {
namespace {

using link::BoardModel;
using link::ServedBoard;
using nlohmann::json;

TEST_F(BoardCliTest, InfoPrintsTheIdentity) {
  ServedBoard board;
  const Outcome got = run_bridge({"board", "info", "--port", board.path()});
  EXPECT_EQ(got.status, 0) << got.err;
  for (const char* part : {"model, firmware 0.1.0, protocol 1.", "0102030405060708", "power on",
                           "4 load cells, 2 analogue (10 bits), 2 buttons", "5.02 V", "ppm"}) {
    EXPECT_NE(got.out.find(part), std::string::npos) << part << " in\n" << got.out;
  }
  const json about =
      json::parse(run_bridge({"board", "info", "--json", "--port", board.path()}).out);
  EXPECT_EQ(about["board"], "model");
  EXPECT_EQ(about["id"], "0102030405060708");
  EXPECT_NEAR(about["skew_ppm"].get<double>(), 300, 3000);
}

TEST_F(BoardCliTest, WatchPrintsFourCellsInNewtonsWithTimes) {
  ServedBoard board;
  board.set_counts(2500);
  Bridge bridge({"board", "watch", "--json", "--port", board.path(), "--cells", cells_file()});
  ASSERT_TRUE(bridge.wait_for_lines(100));
  board.press();
  ASSERT_TRUE(bridge.wait_for_lines(200));
  bridge.signal(SIGINT);
  const Outcome got = bridge.finish();
  EXPECT_EQ(got.status, 0) << got.err;
  std::set<int> channels;
  std::int64_t last[4] = {};
  bool pressed = false;
  for (const std::string& text : lines_of(got.out)) {
    const json line = json::parse(text);
    if (line["kind"] == "button") pressed = line["button"] == 1 && line["pressed"] == true;
    if (line["kind"] != "cell") continue;
    const int channel = line["channel"];
    channels.insert(channel);
    EXPECT_NEAR(line["f_n"].get<double>(), 2.5 + 0.01 * channel, 0.0011);
    EXPECT_GT(line["f_sigma_n"].get<double>(), 0.001);
    EXPECT_GT(line["t_ns"].get<std::int64_t>(), last[channel]);
    EXPECT_GT(line["t_sigma_ns"].get<std::int64_t>(), 0);
    last[channel] = line["t_ns"];
  }
  EXPECT_EQ(channels.size(), 4u);
  EXPECT_TRUE(pressed);
}

TEST_F(BoardCliTest, WatchForPeopleShowsNewtonsCountsAndWhatIsNotWired) {
  ServedBoard board(/*wired=*/0b1011);
  board.set_counts(-1234);
  std::string cells = kCells;  // without channel 3
  cells = cells.substr(0, cells.find(R"(,{"channel":3)")) + "]}";
  write_file(folder / "three.json", cells);
  Bridge bridge({"board", "watch", "--every", "0.05", "--port", board.path(), "--cells",
                 (folder / "three.json").string()});
  ASSERT_TRUE(bridge.wait_for_lines(10)) << bridge.err();
  bridge.signal(SIGTERM);
  const Outcome got = bridge.finish();
  EXPECT_EQ(got.status, 0);
  const std::string line = lines_of(got.out)[8];
  EXPECT_NE(line.find("cell 0   -1.23"), std::string::npos) << line;
  EXPECT_NE(line.find("cell 2 is not wired"), std::string::npos) << line;
  EXPECT_NE(line.find("cell 3     -12"), std::string::npos) << line;
  EXPECT_NE(line.find("counts"), std::string::npos) << line;
  EXPECT_NE(got.err.find("load cell 2 does not answer"), std::string::npos) << got.err;
}

double processor_seconds_of_children() {
  rusage used{};
  ::getrusage(RUSAGE_CHILDREN, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

TEST_F(BoardCliTest, WatchingWaitsAndDoesNotSpin) {
  for (const char* style : {"--json", "--every=0.1"}) {
    ServedBoard board;
    const double before = processor_seconds_of_children();
    run_bridge({"board", "watch", style, "--seconds", "3", "--port", board.path()});
    EXPECT_LT(processor_seconds_of_children() - before, 0.8) << style << ", of 3 s";
  }
}

TEST_F(BoardCliTest, LogWritesWholeLinesOfCsv) {
  ServedBoard board;
  const std::string file = (folder / "log.csv").string();
  const Outcome got =
      run_bridge({"board", "log", "--out", file, "--seconds", "0.5", "--port", board.path()});
  EXPECT_EQ(got.status, 0) << got.err;
  const std::string text = read_file(file);
  const std::vector<std::string> lines = lines_of(text);
  ASSERT_GT(lines.size(), 20u);
  EXPECT_EQ(lines[0], "kind,channel,t_ns,t_sigma_ns,counts,value,sigma,sequence,lost_before");
  EXPECT_EQ(text.back(), '\n');
  for (const std::string& line : lines) EXPECT_EQ(std::count(line.begin(), line.end(), ','), 8);
  const std::string count = std::to_string(lines.size() - 1);
  EXPECT_NE(got.err.find(count + " samples and events written to " + file), std::string::npos)
      << got.err;
  EXPECT_EQ(got.err.find("Ctrl-C"), std::string::npos) << got.err;
}

TEST_F(BoardCliTest, ALogWithoutEndSaysHowItEnds) {
  ServedBoard board;
  Bridge bridge({"board", "log", "--out", (folder / "log.csv").string(), "--port", board.path()});
  EXPECT_TRUE(bridge.wait_for_message("log.csv; Ctrl-C ends it")) << bridge.err();
  bridge.signal(SIGINT);
  EXPECT_EQ(bridge.finish().status, 0);
}

TEST_F(BoardCliTest, WhatIsNoVerbIsNamedAndTheVerbsAreListed) {
  const Outcome wrong = run_bridge({"board", "infos"});
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find("`tagwrench board` has no subcommand 'infos' but info, watch, led"),
            std::string::npos)
      << wrong.err;
  const Outcome bare = run_bridge({"board"});
  EXPECT_EQ(bare.status, 2);
  EXPECT_NE(bare.err.find("`tagwrench board` needs a subcommand: info, watch, led"),
            std::string::npos)
      << bare.err;
  const Outcome option = run_bridge({"board", "flash", "--bord", "uno"});
  EXPECT_EQ(option.status, 2);
  EXPECT_NE(option.err.find("`tagwrench board flash --help`"), std::string::npos) << option.err;
  for (const std::string& line : {wrong.err, bare.err, option.err}) EXPECT_EQ(lines_in(line), 1u);
}

TEST_F(BoardCliTest, AFullDiskIsOneLineAndExit1) {
  ServedBoard board;
  const Outcome got = run_bridge({"board", "log", "--out", "/dev/full", "--port", board.path()});
  EXPECT_EQ(got.status, 1);
  EXPECT_NE(got.err.find("/dev/full: cannot be written: No space left"), std::string::npos)
      << got.err;
}

TEST_F(BoardCliTest, LedStaysUntilCtrlCAndThenGoesOut) {
  ServedBoard board;
  Bridge bridge({"board", "led", "20%", "--port", board.path()});
  EXPECT_TRUE(bridge.wait_for_message("the light stays until Ctrl-C"));
  EXPECT_TRUE(board.wait_for([](const BoardModel& m) { return m.leds.size() >= 3; }))
      << "it is repeated";
  bridge.signal(SIGINT);
  EXPECT_EQ(bridge.finish().status, 0);
  EXPECT_TRUE(board.wait_for([](const BoardModel& m) {
    return m.leds.front().mode == link::LedMode::steady && m.leds.front().level_permille == 200 &&
           m.leds.back().mode == link::LedMode::off;
  }));
}

TEST_F(BoardCliTest, StrobeBeginsAtAMultipleOfItsPeriod) {
  ServedBoard board;
  Bridge bridge({"board", "led", "strobe", "40000", "500", "1000", "--port", board.path()});
  ASSERT_TRUE(board.wait_for([](const BoardModel& m) { return !m.leds.empty(); }));
  bridge.signal(SIGINT);
  bridge.finish();
  EXPECT_TRUE(board.wait_for([](const BoardModel& m) {
    const link::Led& led = m.leds.front();
    return led.mode == link::LedMode::strobe && led.period_us == 40'000 && led.width_us == 500;
  }));
}

TEST_F(BoardCliTest, ALightBeyondTheLimitsIsRefusedHereOrByTheBoard) {
  EXPECT_EQ(run_bridge({"board", "led", "101%", "--port", "/dev/null"}).status, 2);
  EXPECT_EQ(run_bridge({"board", "led", "nan%", "--port", "/dev/null"}).status, 2);
  EXPECT_EQ(run_bridge({"board", "led", "strobe", "5", "--port", "/dev/null"}).status, 2);
  ServedBoard board(0xF, [](BoardModel& m) { m.led_result = link::Result::out_of_range; });
  const Outcome got = run_bridge({"board", "led", "strobe", "10", "5", "--port", board.path()});
  EXPECT_EQ(got.status, 2);
  EXPECT_NE(got.err.find("beyond its limits"), std::string::npos) << got.err;
  EXPECT_EQ(got.err.find("stays until"), std::string::npos) << got.err;
}

TEST_F(BoardCliTest, PulsesBeyondTheLimitsAreRefusedWithTheLimits) {
  ServedBoard board(0xF, [](BoardModel& m) {
    m.capabilities.strobe_width_min_us = 100;
    m.capabilities.strobe_width_max_us = 20'000;
    m.capabilities.strobe_period_min_us = 2000;
    m.capabilities.strobe_period_max_us = 1'000'000;
  });
  const auto refusal = [&](std::vector<std::string> light) {
    std::vector<std::string> words{"board", "led", "--port", board.path()};
    words.insert(words.end(), light.begin(), light.end());
    const Outcome got = run_bridge(words);
    EXPECT_EQ(got.status, 2);
    return got.err;
  };
  EXPECT_EQ(refusal({"strobe", "50", "10"}),
            "tagwrench: period 50 us: this board does 2000 to 1000000 us\n");
  EXPECT_EQ(refusal({"strobe", "4000", "10"}),
            "tagwrench: width 10 us: this board does 100 to 20000 us\n");
  EXPECT_EQ(refusal({"strobe", "4000", "3950"}),
            "tagwrench: width 3950 us: this board does 100 to 3900 us with a period of 4000 us\n");
  EXPECT_EQ(refusal({"pattern", "1999"}),
            "tagwrench: bit 1999 us: this board does 2000 to 1000000 us\n");
  EXPECT_TRUE(board.wait_for([](const BoardModel& m) { return m.leds.empty(); }));
}

TEST_F(BoardCliTest, AnotherVersionSaysWhichSideToUpdate) {
  ServedBoard old(0xF, [](BoardModel& m) { m.hello.protocol_major = 0; });
  const Outcome board_old = run_bridge({"board", "info", "--port", old.path()});
  EXPECT_EQ(board_old.status, 2);
  EXPECT_NE(board_old.err.find("update the board"), std::string::npos) << board_old.err;
  ServedBoard recent(0xF, [](BoardModel& m) { m.hello.protocol_major = 9; });
  const Outcome host_old = run_bridge({"board", "info", "--port", recent.path()});
  EXPECT_EQ(host_old.status, 2);
  EXPECT_NE(host_old.err.find("update tagwrench"), std::string::npos) << host_old.err;
}

TEST_F(BoardCliTest, ASecondHostIsToldWhoHasThePort) {
  ServedBoard board;
  Bridge first({"board", "watch", "--json", "--port", board.path()});
  ASSERT_TRUE(first.wait_for_lines(5)) << first.err();
  const Outcome second = run_bridge({"board", "info", "--port", board.path()});
  EXPECT_EQ(second.status, 2);
  EXPECT_NE(second.err.find("in use by tagwrench (process "), std::string::npos) << second.err;
  first.signal(SIGINT);
  EXPECT_EQ(first.finish().status, 0);
}

TEST_F(BoardCliTest, WhatIsNoBoardIsSaid) {
  ServedBoard silent(0xF, [](BoardModel& m) { m.answers = false; });
  const Outcome got = run_bridge({"board", "info", "--port", silent.path()});
  EXPECT_EQ(got.status, 2);
  EXPECT_NE(got.err.find("nothing answers"), std::string::npos) << got.err;
}

TEST_F(BoardCliTest, APortWithoutOptoforceSensorEndsWith1) {
  link::Pty device;
  const Outcome got = run_bridge(
      {"board", "optoforce", "--port", device.path(), "--counts-per-unit", "100,100,20"});
  EXPECT_EQ(got.status, 1);
  EXPECT_NE(got.err.find("nothing comes"), std::string::npos) << got.err;
}

TEST_F(BoardCliTest, AnOptoforceSensorIsShownInNewtons) {
  link::Pty device;
  Bridge bridge({"board", "optoforce", "--json", "--port", device.path(), "--counts-per-unit",
                 "100,100,20,5000,5000,8000"});
  ASSERT_TRUE(link::readable(device.fd(), 20'000)) << "it is configured";
  std::uint16_t counter = 0;
  while (!bridge.has_lines(20)) {
    device.write(link::optoforce_frame(counter++, 1 << 9, {150, 0, 0, 0, 0, 0}));
    ::poll(nullptr, 0, 10);  // the sensor's own pace
  }
  bridge.signal(SIGINT);
  const Outcome got = bridge.finish();
  EXPECT_EQ(got.status, 0) << got.err;
  const json line = json::parse(lines_of(got.out)[5]);
  EXPECT_DOUBLE_EQ(line["values"][0].get<double>(), 1.5);
  EXPECT_EQ(line["trouble"], "overload Fx");
  EXPECT_EQ(run_bridge({"board", "optoforce", "--port", device.path(), "--counts-per-unit", "1,2"})
                .status,
            2);
}

class FlashTest : public BoardCliTest {
 protected:
  FlashTest() {
    write_file(folder / "image.hex", ":100000000C9434000C943E000C943E000C943E0082\n:00000001FF\n");
    path_before = std::getenv("PATH");
    ::setenv("PATH", (folder.path() + ":" + path_before).c_str(), 1);
  }
  ~FlashTest() override { ::setenv("PATH", path_before.c_str(), 1); }

  /// What stands for avrdude: keeps its arguments and ends as told.
  void avrdude(const std::string& last_line) const {
    write_file(folder / "avrdude", "#!/bin/sh\nprintf '%s\\n' \"$@\" > '" +
                                       (folder / "arguments").string() + "'\n" + last_line + "\n");
    std::filesystem::permissions(folder / "avrdude", std::filesystem::perms::owner_all);
  }
  std::string image() const { return (folder / "image.hex").string(); }
  std::string path_before;
};

TEST_F(FlashTest, ADryRunPrintsTheArgumentsAndRunsNothing) {
  avrdude("exit 0");
  const Outcome got = run_bridge({"board", "flash", "--board", "nano-old", "--port", "/dev/ttyX",
                                  "--image", image(), "--dry-run"});
  EXPECT_EQ(got.status, 0) << got.err;
  EXPECT_EQ(got.out,
            "avrdude -p m328p -c arduino -b 57600 -P /dev/ttyX -D -U flash:w:" + image() + ":i\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "arguments"));
}

TEST_F(FlashTest, TheBoardIsAskedForItsVersionAfterwards) {
  avrdude("exit 0");
  ServedBoard board;
  const Outcome got =
      run_bridge({"board", "flash", "--board", "uno", "--port", board.path(), "--image", image()});
  EXPECT_EQ(got.status, 0) << got.err;
  EXPECT_NE(got.err.find("firmware 0.1.0"), std::string::npos) << got.err;
  EXPECT_EQ(read_file(folder / "arguments"), "-p\nm328p\n-c\narduino\n-b\n115200\n-P\n" +
                                                 board.path() + "\n-D\n-U\nflash:w:" + image() +
                                                 ":i\n");
}

TEST_F(FlashTest, AnotherChipIsRefusedByAvrdudeAndSaid) {
  avrdude("echo 'Expected signature for ATmega328P is 1E 95 0F' >&2; exit 1");
  ServedBoard board;
  const Outcome got =
      run_bridge({"board", "flash", "--board", "uno", "--port", board.path(), "--image", image()});
  EXPECT_EQ(got.status, 1);
  EXPECT_NE(got.err.find("is it a uno with an ATmega328P?"), std::string::npos) << got.err;
}

TEST_F(FlashTest, WhatIsNoWholeImageIsRefused) {
  const std::string record = ":100000000C9434000C943E000C943E000C943E0082\n";
  std::string wrong_digit = record;
  wrong_digit[12] = 'G';
  std::string wrong_sum = record;
  wrong_sum[12] = '0';
  for (const std::string& content : {std::string("\x7f", 1) + "ELF and so on", std::string(),
                                     record, record.substr(0, 30) + "\n:00000001FF\n",
                                     wrong_digit + ":00000001FF\n", wrong_sum + ":00000001FF\n"}) {
    write_file(folder / "image.hex", content);
    const Outcome got =
        run_bridge({"board", "flash", "--board", "uno", "--image", image(), "--dry-run"});
    EXPECT_EQ(got.status, 2) << content;
    EXPECT_NE(got.err.find("not an Intel HEX file"), std::string::npos) << got.err;
  }
}

}  // namespace
}  // namespace tagwrench::test

// A program with what the real one has: verbs below verbs, lists of values, hidden ones.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench::test {

struct SampleApp {
  SampleApp() {
    command_line::Command run = app.add_subcommand("run", "track the tags");
    run.add_option("--source", text,
                   "where frames come from:\n"
                   "  sim | sim:SCENARIO.yaml       the simulated sensor\n"
                   "  v4l2:/dev/videoN[,WxH]\n"
                   "Without it: a camera");
    run.add_option("--output", many,
                   "where samples go:\n"
                   "  jsonl:FILE, csv:FILE          - is standard output\n"
                   "  spnav[:PATH]                  the socket");
    run.add_option("--profile", many, "how pushes become motion");
    run.add_option("--sensor", text, "sensor.yaml of this sensor");
    run.add_option("-f,--frames", number, "end after N frames").required();
    run.add_option("--secret", text, "for programs").hidden();
    run.add_flag("--fast", fast, "with a \\ and\n.a dot");
    command_line::Command board = app.add_subcommand("board", "the board");
    board.require_subcommand();
    command_line::Command led = board.add_subcommand("led", "its light");
    led.add_option("state", text, "on or off")
        .check(command_line::one_of({"on", "off"}))
        .required();
    app.add_subcommand("hidden", "for programs").hidden();
  }

  command_line::Program app{"tagwrench: a camera"};
  std::string text;
  std::vector<std::string> many;
  int number = 0;
  bool fast = false;
};

}  // namespace tagwrench::test

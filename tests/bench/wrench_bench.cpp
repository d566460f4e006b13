// Newtons: the paper's experiment in the simulated rig, its real recording, and what calibration
// and recording cost. Standard output carries the tables.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "tests/bench/table.h"
#include "tests/bench/wrench_experiment.h"
#include "tests/bench/wrench_real.h"
#include "tests/bench/wrench_recording.h"

namespace tagwrench::bench {
namespace {

constexpr int kMovingFrames = 2500;  // 100 s

struct NamedPart {
  const char* name;
  std::function<void(Table&)> bench;
};

const std::vector<NamedPart>& parts() {
  static const std::vector<NamedPart> all = {
      {"simulated", [](Table& t) { bench_experiment(kMovingFrames, t); }},
      {"real", bench_real_recording},
      {"recording", bench_recording},
  };
  return all;
}

/// Empty, or why this cannot be run.
std::string problem(const std::vector<std::string>& names) {
  std::string known;
  for (const NamedPart& part : parts())
    known += (known.empty() ? "" : ", ") + std::string(part.name);
  for (const std::string& name : names) {
    const auto same = [&](const NamedPart& part) { return part.name == name; };
    if (std::none_of(parts().begin(), parts().end(), same))
      return fmt::format("no part '{}'; choose among {}", name, known);
  }
  return {};
}

void bench(const std::vector<std::string>& names) {
  Table table;
  fmt::print(
      "Held out: five blocks in time, each predicted by a fit to the others; the lag is found\n"
      "inside each fit. Every method sees the same frames in the same run, one thread; times are\n"
      "processor time of the thread.\n");
  for (const NamedPart& part : parts()) {
    if (names.empty() || std::find(names.begin(), names.end(), part.name) != names.end())
      part.bench(table);
  }
  table.close();
}

}  // namespace
}  // namespace tagwrench::bench

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  const std::vector<std::string> names(argv + 1, argv + argc);
  if (const std::string wrong = tagwrench::bench::problem(names); !wrong.empty()) {
    fmt::print(stderr, "bench wrench: {}\n", wrong);
    return 2;
  }
  try {
    tagwrench::bench::bench(names);
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench wrench: {}\n", e.what());
    return 1;
  }
}

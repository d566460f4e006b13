// The input device: rest, cross-talk, stopping, latency, rate, processor time, slow readers. Parts
// by name as arguments; none: all of them.
#include <array>
#include <cstdio>
#include <cstring>

#include "tests/bench/hid_desk.h"
#include "tests/bench/hid_guest.h"
#include "tests/bench/hid_live.h"

namespace tagwrench::bench {
namespace {

struct Part {
  const char* name;
  void (*run)(Table&);
};

constexpr std::array<Part, 8> kParts = {{{"rest", bench_rest},
                                         {"stop", bench_stop},
                                         {"crosstalk", bench_crosstalk},
                                         {"filter", bench_filter},
                                         {"socket", bench_socket},
                                         {"slow", bench_slow},
                                         {"cpu", bench_cpu},
                                         {"guest", bench_guest}}};

bool asked_for(const char* name, int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], name) == 0) return true;
  }
  return argc == 1;
}

bool known(const char* name) {
  for (const Part& part : kParts) {
    if (std::strcmp(part.name, name) == 0) return true;
  }
  return false;
}

int measure(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (known(argv[i])) continue;
    std::fprintf(stderr, "no part '%s'; there are:", argv[i]);
    for (const Part& part : kParts) std::fprintf(stderr, " %s", part.name);
    std::fprintf(stderr, "\n");
    return 2;
  }
  Table table;
  for (const Part& part : kParts) {
    if (asked_for(part.name, argc, argv)) part.run(table);
  }
  table.close();
  return 0;
}

}  // namespace
}  // namespace tagwrench::bench

int main(int argc, char** argv) { return tagwrench::bench::measure(argc, argv); }

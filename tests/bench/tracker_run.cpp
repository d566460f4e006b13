#include "tests/bench/tracker_run.h"

#include <ctime>

namespace tagwrench::bench {
namespace {

constexpr std::size_t kChunk = 50;  // frames in memory at a time

}  // namespace

double thread_time_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

Records run(ShotSource& source, const Methods& methods) {
  Records records(methods.size());
  std::vector<Shot> chunk(kChunk);
  for (bool more = true; more;) {
    std::size_t count = 0;
    while (count < kChunk && (more = source.next(chunk[count]))) ++count;
    for (std::size_t m = 0; m < methods.size(); ++m) {
      for (std::size_t i = 0; i < count; ++i) {
        const Shot& shot = chunk[i];
        const double begin = thread_time_us();
        const Reading reading = methods[m]->track(shot);
        const double end = thread_time_us();
        records[m].push_back({shot.phase, shot.pose, shot.truth, reading, end - begin, shot.time});
      }
    }
  }
  return records;
}

}  // namespace tagwrench::bench

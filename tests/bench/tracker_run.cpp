#include "tests/bench/tracker_run.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

#include "host/core/robust_statistics.h"

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

double found_again_us(ShotSource& source, Method& method) {
  constexpr int kEvery = 6;
  constexpr int kLooks = 20;
  constexpr std::uint8_t kGrey = 90;
  std::vector<double> times;
  int moving = 0, looks = 0;
  for (Shot shot; looks < kLooks && source.next(shot);) {
    if (shot.phase == Phase::moving) ++moving;
    const bool covered = moving % kEvery == kEvery - 1;
    const bool looked = moving >= kEvery && moving % kEvery == 0;
    if (covered) std::fill(shot.pixels.begin(), shot.pixels.end(), kGrey);
    const double begin = thread_time_us();
    const Reading reading = method.track(shot);
    const double end = thread_time_us();
    if (!looked) continue;
    ++looks;
    if (reading.ok) times.push_back(end - begin);
  }
  return 2 * times.size() < static_cast<std::size_t>(looks) || times.empty() ? NAN : median(times);
}

}  // namespace tagwrench::bench

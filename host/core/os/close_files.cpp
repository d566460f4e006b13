#include "host/core/os/close_files.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <climits>

namespace tagwrench {
namespace {

void close_gap(unsigned first, unsigned last) noexcept {
  if (first > last || close_range(first, last, 0) == 0) return;
  rlimit files{};  // kernels before 5.9
  getrlimit(RLIMIT_NOFILE, &files);
  const rlim_t limit = std::min<rlim_t>(files.rlim_cur, 65536);
  for (unsigned fd = first; fd <= last && fd < limit; ++fd) {
    ::close(static_cast<int>(fd));
  }
}

}  // namespace

void close_all_but(const std::vector<int>& kept) noexcept {
  unsigned next = 0;
  for (const int fd : kept) {
    const auto number = static_cast<unsigned>(fd);
    if (number > next) close_gap(next, number - 1);
    next = std::max(next, number + 1);
  }
  close_gap(next, UINT_MAX);
}

}  // namespace tagwrench

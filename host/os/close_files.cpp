#include "host/os/close_files.h"

#include <unistd.h>

#include <algorithm>
#include <climits>

namespace tagwrench {
namespace {

void close_gap(unsigned first, unsigned last) noexcept {
  if (first > last || close_range(first, last, 0) == 0) return;
  const long limit = std::min<long>(sysconf(_SC_OPEN_MAX), 65536);  // kernels before 5.9
  for (unsigned fd = first; fd <= last && static_cast<long>(fd) < limit; ++fd) {
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

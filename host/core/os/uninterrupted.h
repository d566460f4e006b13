// A system call that a signal does not cut short.
#pragma once

#include <cerrno>

namespace tagwrench {

/// Makes the call again as long as it ends with EINTR. A timeout begins anew then: signals that are
/// caught end the program and come once or twice. For what must be done in spite of them; loops
/// that poll for termination_fd() need none of this, they just look again.
template <typename Call>
auto uninterrupted(Call call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

}  // namespace tagwrench

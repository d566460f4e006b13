// How a fuzz target says that an invariant does not hold.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace tagwrench {

/// Aborts with `invariant` unless `holds`.
inline void expect(bool holds, const char* invariant) {
  if (holds) return;
  std::fprintf(stderr, "invariant broken: %s\n", invariant);
  std::abort();
}

}  // namespace tagwrench

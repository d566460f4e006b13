// For a process that keeps only what it needs of what it was forked with.
#pragma once

#include <vector>

namespace tagwrench {

/// Closes every file descriptor but those `kept`, which are in rising order. Safe after a fork from
/// a process with threads: no allocation, no lock.
void close_all_but(const std::vector<int>& kept) noexcept;

}  // namespace tagwrench

// Counts every allocation of the process: glibc's malloc family, which operator new, Eigen and C
// libraries go through.
#pragma once

namespace tagwrench::test {

void start_counting_allocations() noexcept;
/// Allocations since the start.
long stop_counting_allocations() noexcept;

}  // namespace tagwrench::test

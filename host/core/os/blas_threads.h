// OpenBLAS, which apt may choose as OpenCV's LAPACK, starts a thread for every core beyond the
// first when it is loaded, for sums that this program does not ask it for. Its variable of the
// environment would have to be set before: libc forgets what a function of .preinit_array sets.
#pragma once

namespace tagwrench {

/// Ends OpenBLAS's threads, where it is there, and lets it start no others.
void end_blas_threads() noexcept;

}  // namespace tagwrench

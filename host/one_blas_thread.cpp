// OpenBLAS, which apt may choose as OpenCV's LAPACK, starts a thread for every core when it is
// loaded, for sums that this program does not ask it for. It must be told before: a function of
// .preinit_array runs before the constructors of all libraries but libc's.
#include <cstdlib>

namespace {

void one_blas_thread(int, char**, char**) { ::setenv("OPENBLAS_NUM_THREADS", "1", 1); }

[[gnu::section(".preinit_array"),
  gnu::used]] void (*const before_libraries)(int, char**, char**) = one_blas_thread;

}  // namespace

#include "host/core/os/blas_threads.h"

#include <dlfcn.h>

namespace tagwrench {
namespace {

template <typename Function>
Function* library_function(const char* name) noexcept {
  return reinterpret_cast<Function*>(::dlsym(RTLD_DEFAULT, name));
}

}  // namespace

void end_blas_threads() noexcept {
  if (auto* set_threads = library_function<void(int)>("openblas_set_num_threads")) set_threads(1);
  if (auto* end_threads = library_function<int()>("blas_thread_shutdown_")) end_threads();
}

}  // namespace tagwrench

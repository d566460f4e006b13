#include "tests/support/heap_count.h"

#include <atomic>
#include <cerrno>
#include <cstddef>

namespace {

constinit std::atomic<bool> counting{false};
constinit std::atomic<long> allocations{0};

void tick() noexcept {
  if (counting.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

namespace tagwrench::test {

void start_counting_allocations() noexcept {
  allocations = 0;
  counting = true;
}

long stop_counting_allocations() noexcept {
  counting = false;
  return allocations;
}

}  // namespace tagwrench::test

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  tick();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  tick();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  tick();
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  tick();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  tick();
  *block = __libc_memalign(alignment, size);
  return *block != nullptr ? 0 : ENOMEM;
}

}  // extern "C"

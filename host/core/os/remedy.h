// What to do about a system call that failed, where the cause is the same for all of them.
#pragma once

#include <cerrno>

namespace tagwrench {

/// `otherwise`, unless `error` is that there are no more descriptors.
constexpr const char* remedy_for(int error, const char* otherwise) noexcept {
  return error == EMFILE || error == ENFILE ? "raise the limit (ulimit -n), or end other programs"
                                            : otherwise;
}

}  // namespace tagwrench

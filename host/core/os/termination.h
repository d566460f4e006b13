// Ctrl-C, kill and a closed terminal (SIGINT, SIGTERM, SIGHUP) as a descriptor for poll loops.
//
// Handlers write to an eventfd that nobody reads. Blocked signals and a signalfd would do in a
// process whose threads are all its own: but libraries start threads when they are loaded (OpenBLAS
// does), before main() can block anything, and the kernel gives a signal of the process to any
// thread that takes it. A handler is good in every thread.
//
// A call that waits in the thread that the kernel chose may end with EINTR then: see
// uninterrupted.h.
#pragma once

#include "host/core/os/unique_fd.h"

namespace tagwrench {

/// From the first call on they no longer end the program at once; the descriptor is readable for
/// good once one of them has come. SIGINT and SIGHUP stay ignored if whoever started the program
/// wanted that (nohup, a script's background job); all that are caught are unblocked in the calling
/// thread. Throws ConfigError if there is no descriptor to be had.
UniqueFd termination_fd();

/// The same, to look at and not to keep; -1, which poll() passes over, before termination_fd().
int borrowed_termination_fd() noexcept;

/// Whether one of them has come.
bool termination_requested() noexcept;

/// Between fork and exec: what comes is for the child, whose handlers would write to the parent's
/// eventfd.
void forget_termination() noexcept;

/// For a daemon that nothing ends but its link: no signal does anything in any thread, but those of
/// the program's own faults.
void ignore_signals() noexcept;

}  // namespace tagwrench

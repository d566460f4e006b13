// Processes that keep only what they need of who started them: daemons (of the spnav socket, of a
// gadget), and those that are forked.
#pragma once

#include <sys/types.h>

#include <span>
#include <string>
#include <vector>

namespace tagwrench {

/// Of the daemon's first thread, and of those that its libraries start.
enum class DaemonSignals { delivered, blocked };

/// Runs `program` with `words` (its name is the first) in a session of its own and in "/". Standard
/// streams are /dev/null, `descriptors` become 3, 4, ..., others are closed. All signals have their
/// default actions. Returns 0, or the error number if it cannot be started; safe beside threads, as
/// the program's memory is not copied.
int spawn_daemon(pid_t& pid, const std::string& program, std::vector<std::string> words,
                 std::span<const int> descriptors, DaemonSignals signals);

constexpr int kFirstDaemonFd = 3;

/// Closes every file descriptor but those `kept`, which are in rising order. Safe after a fork from
/// a process with threads: no allocation, no lock.
void close_all_but(const std::vector<int>& kept) noexcept;

}  // namespace tagwrench

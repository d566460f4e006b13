// Who is at the other end of a TCP connection within this machine, by the kernel's socket table:
// loopback is no person, any user of the machine may connect to it.
#pragma once

#include <sys/types.h>

#include <optional>

namespace tagwrench {

/// The user whose program holds the other end of the connected TCP socket. Nothing: that end is on
/// another machine or in another network namespace, or its program has closed it, or the kernel
/// does not tell (sock_diag(7)). Blocks for the time of one look-up, some microseconds.
std::optional<uid_t> peer_user(int socket) noexcept;

/// The same out of /proc/net/tcp: where the kernel has no sock_diag, and may load no module. Reads
/// through all connections of the machine.
std::optional<uid_t> user_in_table(int socket);

/// Whether that is us, or root, who may do as he likes anyway. A user whom a namespace hides (the
/// kernel's overflow number) is nobody.
bool is_our_user(std::optional<uid_t> user) noexcept;

}  // namespace tagwrench

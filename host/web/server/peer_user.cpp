#include "host/web/server/peer_user.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "host/core/os/uninterrupted.h"
#include "host/core/os/unique_fd.h"

// Not fuzzed: one message of the kernel's, of fixed size, and its table.

namespace tagwrench {
namespace {

constexpr uid_t kHiddenUser = 65534;      // of whom a user namespace does not tell the number
constexpr timeval kPatience{0, 200'000};  // the kernel answers within the call

/// As sock_diag wants it: address and port in network order.
struct Endpoint {
  std::array<std::uint32_t, 4> address{};
  std::uint16_t port = 0;
  std::uint8_t family = AF_UNSPEC;

  bool operator==(const Endpoint&) const = default;
};

/// An IPv4 address within IPv6 (::ffff:a.b.c.d) as the IPv4 address: either end may speak of it
/// either way.
Endpoint endpoint_of(std::uint8_t family, const void* address, std::uint16_t port) noexcept {
  Endpoint out{.port = port, .family = family};
  if (family == AF_INET) {
    std::memcpy(out.address.data(), address, sizeof(in_addr));
    return out;
  }
  in6_addr six{};
  std::memcpy(&six, address, sizeof six);
  std::memcpy(out.address.data(), &six, sizeof six);
  if (IN6_IS_ADDR_V4MAPPED(&six)) {
    out.family = AF_INET;
    out.address = {out.address[3], 0, 0, 0};
  }
  return out;
}

Endpoint endpoint_of(const sockaddr_storage& from) noexcept {
  if (from.ss_family == AF_INET) {
    sockaddr_in in{};
    std::memcpy(&in, &from, sizeof in);
    return endpoint_of(AF_INET, &in.sin_addr, in.sin_port);
  }
  if (from.ss_family != AF_INET6) return {};
  sockaddr_in6 in{};
  std::memcpy(&in, &from, sizeof in);
  return endpoint_of(AF_INET6, &in.sin6_addr, in.sin6_port);
}

template <typename Ask>
Endpoint endpoint(int socket, const Ask& ask) noexcept {
  sockaddr_storage found{};
  socklen_t size = sizeof found;
  if (ask(socket, reinterpret_cast<sockaddr*>(&found), &size) != 0) return {};
  return endpoint_of(found);
}

struct Request {
  nlmsghdr head{};
  inet_diag_req_v2 ask{};
};

Request request_for(const Endpoint& theirs, const Endpoint& ours) noexcept {
  Request request;
  request.head.nlmsg_len = sizeof request;
  request.head.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  request.head.nlmsg_flags = NLM_F_REQUEST;
  request.ask.sdiag_family = theirs.family;
  request.ask.sdiag_protocol = IPPROTO_TCP;
  request.ask.idiag_states = ~0U;
  inet_diag_sockid& id = request.ask.id;
  id.idiag_sport = theirs.port;  // as the other end sees it: its own comes first
  id.idiag_dport = ours.port;
  std::memcpy(id.idiag_src, theirs.address.data(), sizeof id.idiag_src);
  std::memcpy(id.idiag_dst, ours.address.data(), sizeof id.idiag_dst);
  id.idiag_cookie[0] = id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  return request;
}

/// Where there is no such connection, the kernel tells of a socket that listens there.
bool is_connection(const inet_diag_msg& answer, const Endpoint& theirs,
                   const Endpoint& ours) noexcept {
  if (answer.idiag_family != AF_INET && answer.idiag_family != AF_INET6) return false;
  const inet_diag_sockid& id = answer.id;
  return endpoint_of(answer.idiag_family, id.idiag_src, id.idiag_sport) == theirs &&
         endpoint_of(answer.idiag_family, id.idiag_dst, id.idiag_dport) == ours;
}

/// Of both ends of a connected socket; of no family, if it is none.
struct Ends {
  explicit Ends(int socket) noexcept
      : theirs(endpoint(socket, ::getpeername)), ours(endpoint(socket, ::getsockname)) {}
  bool known() const noexcept { return theirs.family != AF_UNSPEC && theirs.family == ours.family; }
  Endpoint theirs, ours;
};

/// What its program has closed belongs to nobody any more, and reads as if it were root's.
std::optional<uid_t> holder(std::uint64_t inode, uid_t user) noexcept {
  if (inode == 0) return {};
  return user;
}

/// sock_diag(7). `asked`: the kernel has answered, if only that there is no such connection.
std::optional<uid_t> user_by_netlink(const Ends& ends, bool& asked) noexcept {
  const UniqueFd kernel(::socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG));
  if (!kernel) return {};
  ::setsockopt(kernel.get(), SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  const Request request = request_for(ends.theirs, ends.ours);
  sockaddr_nl to{};
  to.nl_family = AF_NETLINK;
  if (::sendto(kernel.get(), &request, sizeof request, 0, reinterpret_cast<const sockaddr*>(&to),
               sizeof to) != sizeof request)
    return {};
  std::array<char, 4096> bytes{};
  sockaddr_nl from{};
  socklen_t from_size = sizeof from;
  const ssize_t size = uninterrupted([&] {
    return ::recvfrom(kernel.get(), bytes.data(), bytes.size(), 0,
                      reinterpret_cast<sockaddr*>(&from), &from_size);
  });
  nlmsghdr head{};
  inet_diag_msg answer{};
  if (from.nl_pid != 0 || size < static_cast<ssize_t>(NLMSG_LENGTH(sizeof answer))) return {};
  std::memcpy(&head, bytes.data(), sizeof head);
  std::memcpy(&answer, bytes.data() + NLMSG_HDRLEN, sizeof answer);
  if (head.nlmsg_type != SOCK_DIAG_BY_FAMILY) return {};  // without the module, an error
  asked = true;
  if (!is_connection(answer, ends.theirs, ends.ours)) return {};
  return holder(answer.idiag_inode, answer.idiag_uid);
}

/// As /proc/net/tcp and tcp6 have it (proc(5)): words of the address as they lie in memory.
std::string table_text(const Endpoint& at, bool in_six) {
  std::array<std::uint32_t, 4> words = at.address;
  std::size_t count = in_six ? 4 : 1;
  if (in_six && at.family == AF_INET) words = {0, 0, htonl(0xffff), at.address[0]};
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{:08X}", words[i]);
  return fmt::format("{}:{:04X}", text, ntohs(at.port));
}

}  // namespace

std::optional<uid_t> user_in_table(int socket) {
  const Ends ends(socket);
  if (!ends.known()) return {};
  for (const bool six : {false, true}) {
    if (!six && ends.theirs.family == AF_INET6) continue;
    const std::string wanted =
        ' ' + table_text(ends.theirs, six) + ' ' + table_text(ends.ours, six) + ' ';
    std::ifstream table(six ? "/proc/net/tcp6" : "/proc/net/tcp");
    for (std::string line; std::getline(table, line);) {
      if (line.find(wanted) == std::string::npos) continue;
      std::istringstream fields(line);
      std::string skipped;
      uid_t user = 0;
      std::uint64_t inode = 0;
      for (int i = 0; i < 7; ++i) fields >> skipped;  // up to retrnsmt
      if (fields >> user >> skipped >> inode) return holder(inode, user);
    }
  }
  return {};
}

std::optional<uid_t> peer_user(int socket) noexcept {
  const Ends ends(socket);
  if (!ends.known()) return {};
  bool asked = false;
  const std::optional<uid_t> user = user_by_netlink(ends, asked);
  if (asked) return user;
  try {
    return user_in_table(socket);
  } catch (const std::exception&) {  // out of memory
    return {};
  }
}

bool is_our_user(std::optional<uid_t> user) noexcept {
  if (!user || *user == kHiddenUser) return false;
  return *user == 0 || *user == ::geteuid();
}

}  // namespace tagwrench

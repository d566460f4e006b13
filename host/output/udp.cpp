#include "host/output/udp.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <memory>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

struct Place {
  std::string host;
  std::string port;
};

[[noreturn]] void refuse(const std::string& place, const std::string& why) {
  throw ConfigError("--output udp:{}: {}", place, why);
}

/// "host:4242", "[::1]:4242"
Place split(const std::string& place) {
  const std::size_t colon = place.rfind(':');
  Place split{place.substr(0, colon), colon == std::string::npos ? "" : place.substr(colon + 1)};
  const bool brackets =
      split.host.size() >= 2 && split.host.front() == '[' && split.host.back() == ']';
  if (brackets) split.host = split.host.substr(1, split.host.size() - 2);
  const bool digits = !split.port.empty() && split.port.size() <= 5 &&
                      split.port.find_first_not_of("0123456789") == std::string::npos;
  const int port = digits ? std::stoi(split.port) : 0;
  if (split.host.empty() || port < 1 || port > 65535 ||
      (!brackets && split.host.find(':') != std::string::npos))
    refuse(place, "is no HOST:PORT; use udp:127.0.0.1:4242, or udp:[::1]:4242");
  return split;
}

/// To the first address of this name that can be sent to.
UniqueFd connect_to(const std::string& place) {
  const Place to = split(place);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  wanted.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(to.host.c_str(), to.port.c_str(), &wanted, &found);
      error != 0) {
    refuse(place, fmt::format("cannot be looked up: {}; check the name, or use the address",
                              ::gai_strerror(error)));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> all(found, &::freeaddrinfo);
  int error = 0;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    UniqueFd socket(::socket(one->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (socket && ::connect(socket.get(), one->ai_addr, one->ai_addrlen) == 0) return socket;
    error = errno;
  }
  refuse(place, fmt::format("cannot be sent to: {}; check the address and the network",
                            std::strerror(error)));
}

}  // namespace

UdpDatagram udp_datagram(const Vector6& deflection) noexcept {
  // From HID's axes: x right, y toward the user, z down.
  const std::array<double, 6> values = {kUdpFull_cm * deflection[0],  -kUdpFull_cm * deflection[2],
                                        kUdpFull_cm * deflection[1],  -kUdpFull_deg * deflection[5],
                                        kUdpFull_deg * deflection[3], kUdpFull_deg * deflection[4]};
  UdpDatagram datagram{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = values[i] + 0.0;  // no negative zero
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (std::size_t byte = 0; byte < 8; ++byte)
      datagram[8 * i + byte] = static_cast<std::uint8_t>(bits >> (8 * byte));
  }
  return datagram;
}

UdpOutput::UdpOutput(const std::string& place) : place_(place), socket_(connect_to(place)) {}

/// Nobody listening, a full socket and a network that is away for a while lose this datagram alone.
SendStatus UdpOutput::put(const UdpDatagram& datagram) noexcept {
  if (error_ != 0) return SendStatus::failed;
  if (::send(socket_.get(), datagram.data(), datagram.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0)
    return SendStatus::ok;
  if (errno == ECONNREFUSED) return SendStatus::ok;  // of an earlier one, which nobody took
  constexpr std::array kPassing = {EAGAIN,   ENOBUFS,     ENOMEM,    EINTR,
                                   ENETDOWN, ENETUNREACH, EHOSTDOWN, EHOSTUNREACH};
  if (std::ranges::find(kPassing, errno) != kPassing.end()) return SendStatus::skipped;
  error_ = errno;
  return SendStatus::failed;
}

std::string UdpOutput::failure() const {
  return fmt::format(
      "udp:{}: cannot be sent to: {}; check the network and its firewall, then start again", place_,
      std::strerror(error_));
}

}  // namespace tagwrench

#include "host/desk/control_socket.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/config_error.h"
#include "host/os/runtime_folder.h"

namespace tagwrench {
namespace {

constexpr int kPatience_ms = 2000;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    throw ConfigError(path + ": too long for a socket (at most " +
                      std::to_string(sizeof address.sun_path - 1) + " bytes); set XDG_RUNTIME_DIR");
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

UniqueFd datagram_socket() {
  UniqueFd made(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!made)
    throw ConfigError(std::string("tagwrench control: no socket to be had: ") +
                      std::strerror(errno) + "; end other programs");
  return made;
}

bool somebody_listens(const sockaddr_un& address) {
  const UniqueFd probe = datagram_socket();
  return ::connect(probe.get(), generic(address), sizeof address) == 0;
}

}  // namespace

bool listens(const std::string& path) { return somebody_listens(address_of(path)); }

ControlWish parse_wish(std::string_view text) noexcept {
  using Kind = ControlWish::Kind;
  const std::string_view wish = trimmed(text);
  if (wish == "zero") return {Kind::zero, {}};
  if (wish == "next") return {Kind::next_profile, {}};
  if (wish == "status") return {Kind::status, {}};
  constexpr std::string_view kProfile = "profile ";
  if (wish.starts_with(kProfile)) return {Kind::profile, trimmed(wish.substr(kProfile.size()))};
  return {Kind::unknown, wish};
}

ControlSocket::ControlSocket(std::string path)
    : path_(std::move(path)), socket_(datagram_socket()) {
  const sockaddr_un address = address_of(path_);
  if (::bind(socket_.get(), generic(address), sizeof address) == 0) return;
  int error = errno;
  if (error == EADDRINUSE && !somebody_listens(address)) {
    ::unlink(path_.c_str());
    if (::bind(socket_.get(), generic(address), sizeof address) == 0) return;
    error = errno;
  }
  socket_.reset();  // or the file of another would be removed at the end
  throw ConfigError(error == EADDRINUSE
                        ? path_ + ": another bridge runs on this sensor; stop it first"
                        : path_ + ": cannot listen: " + std::strerror(error) +
                              "; set XDG_RUNTIME_DIR to a folder of yours");
}

ControlSocket::~ControlSocket() {
  if (socket_) ::unlink(path_.c_str());
}

ControlWish ControlSocket::next() noexcept {
  asker_size_ = sizeof asker_;
  const ssize_t size = ::recvfrom(socket_.get(), wish_.data(), wish_.size(), MSG_TRUNC,
                                  reinterpret_cast<sockaddr*>(&asker_), &asker_size_);
  if (size < 0) return {};
  if (static_cast<std::size_t>(size) > wish_.size())
    return {ControlWish::Kind::unknown, "too long"};
  return parse_wish({wish_.data(), static_cast<std::size_t>(size)});
}

void ControlSocket::answer(std::string_view line) noexcept {
  if (asker_size_ <= sizeof(sa_family_t)) return;  // he has no address
  // One who does not listen any more is not waited for.
  [[maybe_unused]] const ssize_t sent =
      ::sendto(socket_.get(), line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&asker_), asker_size_);
}

std::string ask(const std::string& path, std::string_view wish) {
  const sockaddr_un address = address_of(path);
  const UniqueFd socket = datagram_socket();
  const sa_family_t family = AF_UNIX;  // alone, it asks for a name of the kernel's choice
  sockaddr own{};
  own.sa_family = family;
  if (::bind(socket.get(), &own, sizeof family) != 0 ||
      ::connect(socket.get(), generic(address), sizeof address) != 0 ||
      ::send(socket.get(), wish.data(), wish.size(), MSG_NOSIGNAL) < 0)
    throw ConfigError(path + ": nobody listens (" + std::strerror(errno) +
                      "); start `tagwrench run` first, as the same user");
  pollfd waiting{socket.get(), POLLIN, 0};
  std::array<char, 512> line{};
  const ssize_t size = ::poll(&waiting, 1, kPatience_ms) > 0
                           ? ::recv(socket.get(), line.data(), line.size(), 0)
                           : -1;
  if (size < 0) throw ConfigError(path + ": no answer within 2 s; is `tagwrench run` stopped?");
  return {line.data(), static_cast<std::size_t>(size)};
}

std::string control_path(const std::string& sensor) {
  return runtime_folder() + "/" + sensor + ".control";
}

}  // namespace tagwrench

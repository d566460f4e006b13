#include "host/motion/control_socket.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/remedy.h"
#include "host/core/os/uninterrupted.h"
#include "host/core/os/user_folders.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

constexpr int kPatience_ms = 2000;

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
    throw ConfigError("tagwrench control: no socket to be had: {}; {}", std::strerror(errno),
                      remedy_for(errno, "end other programs"));
  return made;
}

/// Within the time that an answer may take.
bool is_ready(pollfd& entry) {
  return uninterrupted([&] { return ::poll(&entry, 1, kPatience_ms); }) > 0;
}

/// What stands before the separator and what behind; all and nothing where there is none.
std::pair<std::string_view, std::string_view> split_at(std::string_view text,
                                                       char separator) noexcept {
  const auto end = std::find(text.begin(), text.end(), separator);
  const auto before = static_cast<std::size_t>(end - text.begin());
  return {text.substr(0, before), end == text.end() ? std::string_view() : text.substr(before + 1)};
}

bool somebody_listens(const sockaddr_un& address) {
  const UniqueFd probe = datagram_socket();
  return ::connect(probe.get(), generic(address), sizeof address) == 0;
}

}  // namespace

bool listens(const std::string& path) { return somebody_listens(address_of(path)); }

bool connect_control(int socket, const std::string& path) {
  const sockaddr_un address = address_of(path);
  if (::connect(socket, generic(address), sizeof address) != 0) return false;
  sockaddr_un own{};
  socklen_t size = sizeof own;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size) != 0) return false;
  if (size > sizeof own.sun_family) return true;
  own.sun_family = AF_UNIX;  // alone, it asks for a name
  return ::bind(socket, generic(own), sizeof own.sun_family) == 0;
}

ControlRequest parse_request(std::string_view bytes) noexcept {
  using Kind = ControlRequest::Kind;
  constexpr std::string_view kBlank = " \t\r\n";
  const std::string_view request = trimmed(bytes, kBlank);
  const auto [line, text] = split_at(request, '\n');
  const auto [word, behind] = split_at(line, ' ');
  const std::string_view name = trimmed(behind, kBlank);
  if (word == "try" && !name.empty()) return {Kind::attempt, name, text};
  if (!text.empty()) return {Kind::unknown, word};
  if (word == "profile" && !name.empty()) return {Kind::profile, name};
  if (word == "window") return {Kind::window, name};
  if (word == "show") return {Kind::show, name};
  if (!name.empty()) return {Kind::unknown, word};
  if (word == "zero") return {Kind::zero};
  if (word == "next") return {Kind::next_profile};
  if (word == "status") return {Kind::status};
  if (word == "live") return {Kind::live};
  if (word == "keep") return {Kind::keep};
  if (word == "revert") return {Kind::revert};
  return {Kind::unknown, word};
}

ControlSocket::ControlSocket(std::string path)
    : path_(std::move(path)), socket_(datagram_socket()), request_(kMaxRequest) {
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

ControlRequest ControlSocket::next() noexcept {
  asker_size_ = sizeof asker_;
  const ssize_t size = ::recvfrom(socket_.get(), request_.data(), request_.size(), MSG_TRUNC,
                                  reinterpret_cast<sockaddr*>(&asker_), &asker_size_);
  if (size < 0) return {};
  if (static_cast<std::size_t>(size) > request_.size())
    return {ControlRequest::Kind::unknown, "too long"};
  return parse_request({request_.data(), static_cast<std::size_t>(size)});
}

std::string_view ControlSocket::asker() const noexcept {
  if (asker_size_ <= sizeof(sa_family_t)) return {};
  return {asker_.sun_path, std::min<std::size_t>(asker_size_, sizeof asker_) - sizeof(sa_family_t)};
}

void ControlSocket::answer(std::string_view asker, std::string_view text) noexcept {
  sockaddr_un address{};
  if (asker.empty() || asker.size() > sizeof address.sun_path) return;  // he has no address
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, asker.data(), asker.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + asker.size());
  // One who does not listen any more is not waited for.
  [[maybe_unused]] const ssize_t sent = ::sendto(
      socket_.get(), text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL, generic(address), size);
}

ControlClient::ControlClient(const std::string& path) : path_(path), socket_(datagram_socket()) {
  if (!connect_control(socket_.get(), path_)) fail();
}

void ControlClient::fail() const {
  throw ConfigError(path_ + ": nobody listens (" + std::strerror(errno) +
                    "); start `tagwrench run` first, as the same user");
}

std::string ControlClient::ask(std::string_view request) {
  const auto send = [&] {
    return ::send(socket_.get(), request.data(), request.size(), MSG_NOSIGNAL) >= 0;
  };
  pollfd room{socket_.get(), POLLOUT, 0};  // many ask at once, or it is stopped
  bool sent = send();
  if (!sent && errno == EAGAIN && is_ready(room)) sent = send();
  if (!sent && errno != EAGAIN) fail();
  pollfd waiting{socket_.get(), POLLIN, 0};
  std::string answer(ControlSocket::kMaxAnswer, '\0');
  const ssize_t size =
      sent && is_ready(waiting) ? ::recv(socket_.get(), answer.data(), answer.size(), 0) : -1;
  if (size < 0) throw ConfigError(path_ + ": no answer within 2 s; is `tagwrench run` stopped?");
  answer.resize(static_cast<std::size_t>(size));
  return answer;
}

std::string ask(const std::string& path, std::string_view request) {
  return ControlClient(path).ask(request);
}

std::string control_path(const std::string& sensor) {
  return runtime_folder() + "/" + sensor + ".control";
}

}  // namespace tagwrench

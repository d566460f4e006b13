// Requests from outside while the sensor runs: `tagwrench control`, a key of the window manager, a
// script; and the pages' sliders. One datagram a request, one back.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

struct ControlRequest {
  enum class Kind : std::uint8_t {
    none,
    zero,
    next_profile,
    profile,
    status,
    window,   ///< the program in focus, as a script of the desktop tells it
    live,     ///< what the sensor reads now
    show,     ///< a profile, spelt out
    attempt,  ///< a profile is in force on trial, as long as who tries it goes on asking
    keep,     ///< the one on trial takes its profile's place
    revert,   ///< and here it does not
    unknown,
  };
  Kind kind = Kind::none;
  std::string_view name{};  ///< of the profile or the program; valid until the next request
  std::string_view text{};  ///< of the profile on trial
};

/// "zero", "next", "profile NAME", "status", "window [NAME]", "live", "show [NAME]", "keep",
/// "revert", and "try NAME" with a profile's text from the next line on; anything else is unknown.
/// Blanks around words do not count.
ControlRequest parse_request(std::string_view bytes) noexcept;

class ControlSocket {
 public:
  static constexpr std::size_t kMaxRequest = 16384;
  static constexpr std::size_t kMaxAnswer = 16384;

  /// Listens at `path`; a socket file that nobody listens to any more is replaced. Throws
  /// ConfigError: somebody listens there, or the path cannot be used.
  explicit ControlSocket(std::string path);
  ControlSocket(ControlSocket&&) = default;
  ControlSocket& operator=(ControlSocket&&) = delete;
  ~ControlSocket() {
    if (socket_) ::unlink(path_.c_str());
  }

  int fd() const noexcept { return socket_.get(); }
  /// The next request; none when all are taken.
  ControlRequest next() noexcept;
  /// Who had the last request, to tell askers apart; empty without address. Valid until the next.
  std::string_view asker() const noexcept;
  /// To whoever had the last request, if he listens. Never blocks.
  void answer(std::string_view text) noexcept { answer(asker(), text); }
  /// To one who had a request earlier, as asker() gave him.
  void answer(std::string_view asker, std::string_view text) noexcept;

 private:
  std::string path_;
  UniqueFd socket_;
  std::vector<char> request_;
  sockaddr_un asker_{};
  socklen_t asker_size_ = 0;
};

/// Whether somebody listens there.
bool listens(const std::string& path);

/// Connects a datagram socket to whoever listens at `path` now, and then gives it a name of the
/// kernel's choice, unless it has one. In this order: what is connected hears its peer alone, and
/// before it has a name nobody can write to it. False: nobody listens; errno tells. Throws
/// ConfigError if the path is too long.
bool connect_control(int socket, const std::string& path);

/// One who asks, the same for all his requests.
class ControlClient {
 public:
  /// Of the sensor that listens at `path`. Throws ConfigError: nobody does.
  explicit ControlClient(const std::string& path);

  /// Sends a request, waits for its answer. Throws ConfigError: nobody listens or answers.
  std::string ask(std::string_view request);

 private:
  [[noreturn]] void fail() const;

  std::string path_;
  UniqueFd socket_;
};

/// One request of a client that is then gone.
std::string ask(const std::string& path, std::string_view request);

/// Where the sensor of this name is asked; a folder of the user's own.
std::string control_path(const std::string& sensor);

}  // namespace tagwrench

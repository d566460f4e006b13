// Wishes from outside while the sensor runs: `tagwrench control`, a key of the window manager, a
// script. One datagram a wish, one line back.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/os/unique_fd.h"

namespace tagwrench {

struct ControlWish {
  enum class Kind : std::uint8_t { none, zero, next_profile, profile, status, unknown };
  Kind kind = Kind::none;
  std::string_view name;  ///< of the profile; valid until the next wish
};

/// "zero", "next", "profile NAME" and "status"; anything else is unknown. Blanks around words do
/// not count.
ControlWish parse_wish(std::string_view text) noexcept;

class ControlSocket {
 public:
  static constexpr std::size_t kLongestWish = 128;

  /// Listens at `path`; a socket file that nobody listens to any more is replaced. Throws
  /// ConfigError: somebody listens there, or the path cannot be used.
  explicit ControlSocket(std::string path);
  ControlSocket(ControlSocket&&) = default;
  ControlSocket& operator=(ControlSocket&&) = delete;
  ~ControlSocket();

  int fd() const noexcept { return socket_.get(); }
  /// The next wish; none when all are taken.
  ControlWish next() noexcept;
  /// To whoever had the last wish, if he listens. Never blocks.
  void answer(std::string_view line) noexcept;

 private:
  std::string path_;
  UniqueFd socket_;
  std::array<char, kLongestWish> wish_{};
  sockaddr_un asker_{};
  socklen_t asker_size_ = 0;
};

/// Whether somebody listens there.
bool listens(const std::string& path);

/// Sends a wish to the sensor that listens at `path`, and waits for its answer. Throws ConfigError:
/// nobody listens, or does not answer.
std::string ask(const std::string& path, std::string_view wish);

/// Where the sensor of this name is asked; a folder of the user's own.
std::string control_path(const std::string& sensor);

}  // namespace tagwrench

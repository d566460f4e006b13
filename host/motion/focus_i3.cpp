// The focus as i3 and sway tell it.
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <exception>

#include "host/core/os/unique_fd.h"
#include "host/motion/focus_watch.h"
#include "host/motion/i3_ipc.h"

namespace tagwrench {
namespace {

class I3Focus : public FocusSource {
 public:
  explicit I3Focus(UniqueFd socket) : socket_(std::move(socket)) {}

  int fd() const noexcept override { return socket_.get(); }
  std::optional<Focus> changed() noexcept override;

 private:
  enum class Heard : std::uint8_t { nothing, something, end };
  Heard hear();

  UniqueFd socket_;
  I3Stream stream_;
};

/// What has come by now; never waits.
I3Focus::Heard I3Focus::hear() {
  std::array<char, 16384> bytes;
  const ssize_t size = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return Heard::nothing;
  if (size <= 0 || !stream_.put({bytes.data(), static_cast<std::size_t>(size)})) return Heard::end;
  return Heard::something;
}

std::optional<Focus> I3Focus::changed() noexcept {
  std::optional<Focus> last;
  try {
    // Once only: more is told by the descriptor, and frames wait.
    if (hear() == Heard::end) return Focus{.ended = true};
    while (const std::optional<I3Message> message = stream_.next()) {
      if (std::optional<Focus> focus = focus_in(*message)) last = std::move(focus);
    }
  } catch (const std::exception&) {
    return last;  // out of memory: the profile stays
  }
  return last;
}

/// Whole, or not at all.
bool sends(const UniqueFd& socket, const std::string& bytes) {
  return ::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

}  // namespace

std::unique_ptr<FocusSource> focus_by_i3_ipc(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.data(), path.size());
  UniqueFd socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const bool asked =
      socket &&
      ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      sends(socket, i3_message(I3Type::subscribe, R"(["window"])")) &&
      sends(socket, i3_message(I3Type::tree, ""));
  if (!asked) return {};
  return std::make_unique<I3Focus>(std::move(socket));
}

}  // namespace tagwrench

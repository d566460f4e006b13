// The bridge's own profiles, asked as any other program asks it: one datagram a request, one back.
// In the server's thread, which never waits for it.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/datagram_protocol.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "host/motion/control_socket.h"
#include "host/web/server/server_timer.h"

namespace tagwrench {

/// What the desk said.
struct ControlAnswer {
  bool ok = false;
  std::string text;  ///< without "ok: " or "error: ", and without the line's end
};

ControlAnswer control_answer(std::string_view bytes);

class ControlLink {
 public:
  using Done = std::function<void(ControlAnswer)>;
  static constexpr std::chrono::seconds kPatience{2};
  static constexpr std::size_t kMostWaiting = 64;  ///< more are refused

  /// `path` of the desk's socket, where somebody may or may not listen; nobody else's answers are
  /// heard. Throws ConfigError if the system has no more descriptors, or the path is too long.
  ControlLink(boost::asio::io_context& context, std::string path);

  /// `done` is called exactly once, later; one request after the other.
  void ask(std::string request, Done done);
  /// Requests that are not answered yet.
  std::size_t waiting() const { return requests_.size(); }

 private:
  struct Request {
    std::string text;
    Done done;
  };
  void open();
  void send();
  void finish(ControlAnswer answer);

  std::string path_;
  boost::asio::local::datagram_protocol::socket socket_;
  ServerTimer patience_;
  std::deque<Request> requests_;
  std::array<char, ControlSocket::kMaxAnswer> answer_{};
  std::uint64_t number_ = 0;  ///< of the request at the front
  bool asking_ = false;
  /// What is on its way to be called when this is destroyed finds it gone.
  std::shared_ptr<const bool> here_ = std::make_shared<const bool>(true);
};

}  // namespace tagwrench

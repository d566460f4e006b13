#include "host/web/bridge/control_link.h"

#include <fcntl.h>
#include <sys/socket.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

using Protocol = boost::asio::local::datagram_protocol;

constexpr const char* kNobody = "the sensor does not run at the moment; try again when it does";

}  // namespace

ControlAnswer control_answer(std::string_view bytes) {
  constexpr std::string_view kDone = "ok: ";
  constexpr std::string_view kError = "error: ";
  while (!bytes.empty() && bytes.back() == '\n') bytes.remove_suffix(1);
  if (bytes.starts_with(kDone)) return {true, std::string(bytes.substr(kDone.size()))};
  if (bytes.starts_with(kError)) bytes.remove_prefix(kError.size());
  return {false, std::string(bytes)};
}

ControlLink::ControlLink(boost::asio::io_context& context, std::string path)
    : path_(std::move(path)), socket_(context), patience_(context) {
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sa_family_t family = AF_UNIX;  // alone, it asks for a name of the kernel's choice
  sockaddr own{};
  own.sa_family = family;
  if (fd < 0 || ::bind(fd, &own, sizeof family) != 0)
    throw ConfigError(std::string("web: no socket to be had: ") + std::strerror(errno) +
                      "; end other programs");
  socket_.assign(Protocol(), fd);
  socket_.non_blocking(true);
}

void ControlLink::ask(std::string request, Done done) {
  requests_.push_back({std::move(request), std::move(done)});
  if (!asking_) send();
}

void ControlLink::send() {
  asking_ = true;
  const auto still = [this, number = number_, here = std::weak_ptr(here_)] {
    return !here.expired() && number == number_;
  };
  boost::system::error_code error;
  for (std::size_t stale = 1; stale > 0 && !error;)  // answers that came too late
    stale = socket_.receive(boost::asio::buffer(answer_), 0, error);
  socket_.send_to(boost::asio::buffer(requests_.front().text), Protocol::endpoint(path_), 0, error);
  if (error) {
    boost::asio::post(socket_.get_executor(), [this, still] {
      if (still()) finish({false, kNobody});
    });
    return;
  }
  socket_.async_receive(boost::asio::buffer(answer_),
                        [this, still](boost::system::error_code failed, std::size_t size) {
                          if (!failed && still()) finish(control_answer({answer_.data(), size}));
                        });
  patience_.after(kPatience, [this, still] {
    if (!still()) return;
    socket_.cancel();
    finish({false, kNobody});
  });
}

void ControlLink::finish(ControlAnswer answer) {
  ++number_;
  patience_.cancel();
  const Request request = std::move(requests_.front());
  requests_.pop_front();
  asking_ = false;
  if (!requests_.empty()) send();
  request.done(std::move(answer));
}

}  // namespace tagwrench

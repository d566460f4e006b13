#include "host/web/bridge/control_link.h"

#include <fcntl.h>
#include <sys/socket.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/remedy.h"

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
  open();
  connect_control(socket_.native_handle(), path_);  // says now that the path is too long
}

void ControlLink::open() {
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0)
    throw ConfigError("web: no socket to be had: {}; {}", std::strerror(errno),
                      remedy_for(errno, "end other programs"));
  socket_.assign(Protocol(), fd);
  socket_.non_blocking(true);
}

void ControlLink::ask(std::string request, Done done) {
  if (requests_.size() >= kMostWaiting) {
    boost::asio::post(socket_.get_executor(), [done = std::move(done)] {
      done({false, "too many requests at once; try again"});
    });
    return;
  }
  requests_.push_back({std::move(request), std::move(done)});
  if (!asking_) send();
}

void ControlLink::send() {
  asking_ = true;
  const auto still = [this, number = number_, here = std::weak_ptr(here_)] {
    return !here.expired() && number == number_;
  };
  // Anew for each request: another sensor may listen there by now.
  bool sent = connect_control(socket_.native_handle(), path_);
  if (sent) {
    boost::system::error_code error;
    while (!error) socket_.receive(boost::asio::buffer(answer_), 0, error);  // came too late
    socket_.send(boost::asio::buffer(requests_.front().text), 0, error);
    sent = !error;
  }
  if (!sent) {
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
    socket_.close();  // the answer, should it come after all, is for a name that nobody has
    try {
      open();
      finish({false, kNobody});
    } catch (const ConfigError& e) {
      finish({false, e.what()});
    }
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

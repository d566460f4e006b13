#include "host/web/bridge/desk_link.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/datagram_protocol.hpp>
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

DeskAnswer desk_answer(std::string_view bytes) {
  constexpr std::string_view kDone = "ok: ";
  constexpr std::string_view kError = "error: ";
  while (!bytes.empty() && bytes.back() == '\n') bytes.remove_suffix(1);
  if (bytes.starts_with(kDone)) return {true, std::string(bytes.substr(kDone.size()))};
  if (bytes.starts_with(kError)) bytes.remove_prefix(kError.size());
  return {false, std::string(bytes)};
}

struct DeskLink::Socket {
  Protocol::socket asio;
};

DeskLink::DeskLink(boost::asio::io_context& context, std::string path)
    : path_(std::move(path)), socket_(new Socket{Protocol::socket(context)}), patience_(context) {
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sa_family_t family = AF_UNIX;  // alone, it asks for a name of the kernel's choice
  sockaddr own{};
  own.sa_family = family;
  if (fd < 0 || ::bind(fd, &own, sizeof family) != 0)
    throw ConfigError(std::string("web: no socket to be had: ") + std::strerror(errno) +
                      "; end other programs");
  socket_->asio.assign(Protocol(), fd);
  socket_->asio.non_blocking(true);
}

DeskLink::~DeskLink() = default;

void DeskLink::ask(std::string wish, Done done) {
  wishes_.push_back({std::move(wish), std::move(done)});
  if (!asking_) send();
}

void DeskLink::send() {
  asking_ = true;
  const auto still = [this, number = number_, here = std::weak_ptr(here_)] {
    return !here.expired() && number == number_;
  };
  boost::system::error_code error;
  for (std::size_t stale = 1; stale > 0 && !error;)  // answers that came too late
    stale = socket_->asio.receive(boost::asio::buffer(answer_), 0, error);
  socket_->asio.send_to(boost::asio::buffer(wishes_.front().text), Protocol::endpoint(path_), 0,
                        error);
  if (error) {
    boost::asio::post(socket_->asio.get_executor(), [this, still] {
      if (still()) finish({false, kNobody});
    });
    return;
  }
  socket_->asio.async_receive(boost::asio::buffer(answer_),
                              [this, still](boost::system::error_code failed, std::size_t size) {
                                if (!failed && still()) finish(desk_answer({answer_.data(), size}));
                              });
  patience_.after(kPatience, [this, still] {
    if (!still()) return;
    socket_->asio.cancel();
    finish({false, kNobody});
  });
}

void DeskLink::finish(DeskAnswer answer) {
  ++number_;
  patience_.cancel();
  const Wish wish = std::move(wishes_.front());
  wishes_.pop_front();
  asking_ = false;
  if (!wishes_.empty()) send();
  wish.done(std::move(answer));
}

}  // namespace tagwrench

#include "host/web/server/server_timer.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

namespace tagwrench {

struct ServerTimer::Timer {
  boost::asio::steady_timer timer;
};

ServerTimer::ServerTimer(boost::asio::io_context& context)
    : timer_(new Timer{boost::asio::steady_timer(context)}) {}

ServerTimer::~ServerTimer() = default;

void ServerTimer::after(Duration wait, std::function<void()> work) {
  timer_->timer.expires_after(wait);
  timer_->timer.async_wait([work = std::move(work)](const boost::system::error_code& error) {
    if (!error) work();
  });
}

void ServerTimer::cancel() { timer_->timer.cancel(); }

}  // namespace tagwrench

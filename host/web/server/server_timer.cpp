#include "host/web/server/server_timer.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <utility>

namespace tagwrench {

struct ServerTimer::Timer {
  boost::asio::steady_timer timer;
  std::uint64_t order = 0;  ///< of the work that is to be done; others have been called off
};

ServerTimer::ServerTimer(boost::asio::io_context& context)
    : timer_(std::make_shared<Timer>(Timer{boost::asio::steady_timer(context)})) {}

ServerTimer::~ServerTimer() = default;

void ServerTimer::after(Duration wait, std::function<void()> work) {
  timer_->timer.expires_after(wait);
  // A wait that is over may be in the queue already, where Asio cancels it no more.
  timer_->timer.async_wait([here = std::weak_ptr<Timer>(timer_), order = ++timer_->order,
                            work = std::move(work)](const boost::system::error_code& error) {
    if (const auto timer = here.lock(); !error && timer && timer->order == order) work();
  });
}

void ServerTimer::cancel() {
  ++timer_->order;
  timer_->timer.cancel();
}

}  // namespace tagwrench

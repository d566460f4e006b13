// Something that is to be done in the server's thread, later.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "host/core/types.h"

namespace tagwrench {

/// What is not done when it is destroyed will not be.
class ServerTimer {
 public:
  explicit ServerTimer(boost::asio::io_context& context)
      : timer_(std::make_shared<Timer>(Timer{boost::asio::steady_timer(context)})) {}

  /// In place of what was to be done before.
  void after(Duration wait, std::function<void()> work) {
    timer_->timer.expires_after(wait);
    // A wait that is over may be in the queue already, where Asio cancels it no more.
    timer_->timer.async_wait([here = std::weak_ptr<Timer>(timer_), order = ++timer_->order,
                              work = std::move(work)](const boost::system::error_code& error) {
      if (const auto timer = here.lock(); !error && timer && timer->order == order) work();
    });
  }

  void cancel() {
    ++timer_->order;
    timer_->timer.cancel();
  }

 private:
  struct Timer {
    boost::asio::steady_timer timer;
    std::uint64_t order = 0;  ///< of the work that is to be done; others have been called off
  };
  std::shared_ptr<Timer> timer_;
};

}  // namespace tagwrench

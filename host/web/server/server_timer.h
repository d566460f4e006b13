// Something that is to be done in the server's thread, later: Asio's timer without its headers.
#pragma once

#include <functional>
#include <memory>

#include "host/core/types.h"

namespace boost::asio {
class io_context;
}

namespace tagwrench {

class ServerTimer {
 public:
  explicit ServerTimer(boost::asio::io_context& context);
  /// What is not done yet will not be.
  ~ServerTimer();
  ServerTimer(const ServerTimer&) = delete;
  ServerTimer& operator=(const ServerTimer&) = delete;

  /// In place of what was to be done before.
  void after(Duration wait, std::function<void()> work);
  void cancel();

 private:
  struct Timer;
  std::shared_ptr<Timer> timer_;
};

}  // namespace tagwrench

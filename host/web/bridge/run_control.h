// Between the server's thread and the loop of a run: requests that must happen in the loop, and the
// request that it give the camera away.
#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

class WebOutput;

class RunControl {
 public:
  /// In the loop's thread; or in that of close(), with nothing, when the run is over.
  using Request = std::function<void(WebOutput*)>;

  /// `stop` becomes readable when a signal has come. Throws ConfigError if the system has no more
  /// descriptors.
  explicit RunControl(int stop);

  /// Readable once a signal has come or the camera is wanted: the run shall end.
  int end_fd() const noexcept { return end_.get(); }
  /// Readable when run_requests() has something to do.
  int requests_fd() const noexcept { return requests_ready_.get(); }

  // Any thread.
  void request(Request request);
  /// Of the run that there is, or else of the next one.
  void want_camera() noexcept;
  /// That request is fulfilled.
  void camera_given() noexcept;

  // The loop's thread, and that which builds runs.
  void open();
  void run_requests(WebOutput& output) noexcept;
  void close() noexcept;

 private:
  std::vector<Request> take() noexcept;

  UniqueFd camera_wanted_;
  UniqueFd requests_ready_;
  UniqueFd end_;
  std::mutex mutex_;
  bool open_ = false;
  std::vector<Request> requests_;
};

/// An event that is counted; throws ConfigError if the system has no more descriptors.
UniqueFd make_event();
void raise_event(const UniqueFd& event) noexcept;
void clear_event(const UniqueFd& event) noexcept;

}  // namespace tagwrench

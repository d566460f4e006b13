// Between the server's thread and the loop of a run: wishes that must happen in the loop, and the
// wish that it give the camera away.
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
  using Wish = std::function<void(WebOutput*)>;

  /// `stop` becomes readable when a signal has come. Throws ConfigError if the system has no more
  /// descriptors.
  explicit RunControl(int stop);

  /// Readable once a signal has come or the camera is wanted: the run shall end.
  int end_fd() const noexcept { return end_.get(); }
  /// Readable when run_wishes() has something to do.
  int wishes_fd() const noexcept { return wishes_ready_.get(); }

  // Any thread.
  void wish(Wish wish);
  /// Of the run that there is, or else of the next one.
  void want_camera() noexcept;
  /// That wish is fulfilled.
  void camera_given() noexcept;

  // The loop's thread, and that which builds runs.
  void open();
  void run_wishes(WebOutput& output) noexcept;
  void close() noexcept;

 private:
  std::vector<Wish> take() noexcept;

  UniqueFd camera_wanted_;
  UniqueFd wishes_ready_;
  UniqueFd end_;
  std::mutex mutex_;
  bool open_ = false;
  std::vector<Wish> wishes_;
};

/// An event that is counted; throws ConfigError if the system has no more descriptors.
UniqueFd make_event();
void raise_event(const UniqueFd& event) noexcept;
void clear_event(const UniqueFd& event) noexcept;

}  // namespace tagwrench

// What systemd is told by a service that it supervises (sd_notify(3)): that it is ready, what it is
// doing, and that its loop still turns.
#pragma once

#include <memory>
#include <string_view>

#include "host/core/os/unique_fd.h"
#include "host/output/output.h"

namespace tagwrench {

class ServiceWatch final : public Output {
 public:
  /// Nothing where no systemd supervises this process.
  static std::unique_ptr<ServiceWatch> open();
  /// Says that the service is about to end.
  ~ServiceWatch() override;

  /// Set up, or waiting for what may come at any time; `status` says which.
  void ready(std::string_view status) noexcept;

  /// Readable when systemd wants a sign of life; -1 if it does not.
  int poll_fd() const noexcept override { return timer_.get(); }
  /// The sign of life. Whoever polls calls it, so that a loop that hangs gives none.
  std::string_view service() noexcept override;

  /// The last line for people is the state that `systemctl status` shows.
  bool notice(std::string_view line) noexcept override;

 private:
  explicit ServiceWatch(UniqueFd timer) noexcept : timer_(std::move(timer)) {}

  UniqueFd timer_;
};

}  // namespace tagwrench

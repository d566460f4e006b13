// What flips before the camera: a page, in any browser, so that a phone or a tablet is the screen;
// or a window of this computer.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/tools/camera_timing/measurement.h"
#include "host/web/server/web_server.h"

struct SDL_Window;
struct SDL_Renderer;

namespace tagwrench {

// A page's clock on the host's. Pure: times are passed in.

class PageClock {
 public:
  /// The page was asked at `sent`, read `page_ms` (performance.now(), ms), and its answer was here
  /// at `received`, host clock. What cannot be a clock's reading is left out, and false.
  bool exchange(TimePoint sent, double page_ms, TimePoint received) noexcept;

  int exchanges() const noexcept { return exchanges_; }
  /// Nothing before the first exchange, or if `page_ms` is none of a clock's readings.
  std::optional<TimePoint> host_time(double page_ms) const noexcept;
  /// By how much host_time() may be wrong about what is now: half the shortest way there and back,
  /// and what both clocks have drifted apart since.
  Duration error() const noexcept;

 private:
  int exchanges_ = 0;
  Duration offset_{};  ///< host less page
  Duration half_{};    ///< of the way there and back
  TimePoint measured_{}, last_{};
};

/// Serves host/web/pages/flip and tells it when to flip; the page tells when it has, by its own
/// clock, which exchanges of messages put on the host's. Messages: host/web/README.md.
class PagePatch final : public FlipPatch, private PageRequestHandler {
 public:
  /// Throws ConfigError: the address cannot be used or needs a token, or the page is not built.
  explicit PagePatch(const WebOptions& options);
  ~PagePatch() override { server_.stop(); }

  /// To be opened in the browser, with "&token=" and the token after it where there is one: in the
  /// fragment, which no browser sends.
  std::string url() const { return server_.url() + "flip/#screen"; }

  /// Until a page is ready to flip and its clock is known. False: `stop_fd` was readable, or it
  /// ended().
  bool wait_for_page(int stop_fd);

  void show(bool white, TimePoint when) override;
  std::optional<TimePoint> shown() override {
    const std::lock_guard lock(mutex_);
    return shown_;
  }
  Duration clock_error() const override {
    const std::lock_guard lock(mutex_);
    return clock_.error();
  }
  std::string ended() override {
    const std::lock_guard lock(mutex_);
    return ended_;
  }
  /// Of the screen, once there is one.
  std::string description() const;

 private:
  // The server's thread.
  void handle(PageRequest request) override;
  void page_gone(std::uint64_t page) override;
  std::string take(const PageRequest& request);
  std::string take_time(const PageRequest& request);
  std::string take_flip(const PageRequest& request);
  void send_time();

  void end(std::string why);  ///< with the mutex held
  void tell_loop() const;

  WebServer server_;
  UniqueFd news_;

  mutable std::mutex mutex_;  // for all below
  std::optional<std::uint64_t> page_;
  std::string ended_;
  PageClock clock_;
  bool ready_ = false;
  std::int64_t exchange_ = 0;  ///< number of the one under way
  TimePoint exchange_sent_{};
  std::int64_t flip_ = 0;  ///< number of the last order
  TimePoint flip_sent_{};
  std::optional<TimePoint> shown_;
};

// A window that is black or white all over.

class ScreenWindow final : public FlipPatch {
 public:
  /// Throws ConfigError if there is no screen.
  ScreenWindow();
  ~ScreenWindow() override;

  /// Waits for `when`.
  void show(bool white, TimePoint when) override;
  std::optional<TimePoint> shown() override { return shown_; }
  std::string ended() override;
  std::string description() const;

 private:
  void paint();

  SDL_Window* window_ = nullptr;
  SDL_Renderer* renderer_ = nullptr;
  bool white_ = false;
  TimePoint shown_{};
  bool closed_ = false;
};

}  // namespace tagwrench

// A window that is black or white all over.
#pragma once

#include "host/tools/camera_timing/measurement.h"

struct SDL_Window;
struct SDL_Renderer;

namespace tagwrench {

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

#include "host/tools/camera_timing/screen_window.h"

#include <SDL.h>
#include <fmt/format.h>

#include <cerrno>
#include <ctime>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

constexpr int kEdge_px = 700;

void wait_until(TimePoint when) {
  const auto ns = when.time_since_epoch().count();
  const timespec time{static_cast<time_t>(ns / 1'000'000'000),
                      static_cast<long>(ns % 1'000'000'000)};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

[[noreturn]] void no_screen() {
  const std::string why = SDL_GetError();
  SDL_Quit();
  throw ConfigError(
      "--screen: no window can be shown ({}): start it from a desktop, or set DISPLAY", why);
}

}  // namespace

ScreenWindow::ScreenWindow() {
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  if (SDL_Init(SDL_INIT_VIDEO) != 0) no_screen();
  window_ = SDL_CreateWindow("tagwrench camera-timing", SDL_WINDOWPOS_CENTERED,
                             SDL_WINDOWPOS_CENTERED, kEdge_px, kEdge_px, SDL_WINDOW_SHOWN);
  if (window_ == nullptr) no_screen();
  // No waiting for the screen's refresh: its time is part of what is measured.
  renderer_ = SDL_CreateRenderer(window_, -1, 0);
  if (renderer_ == nullptr) {
    SDL_DestroyWindow(window_);
    no_screen();
  }
  paint();
}

ScreenWindow::~ScreenWindow() {
  SDL_DestroyRenderer(renderer_);
  SDL_DestroyWindow(window_);
  SDL_Quit();
}

void ScreenWindow::paint() {
  const std::uint8_t level = white_ ? 255 : 0;
  SDL_SetRenderDrawColor(renderer_, level, level, level, 255);
  SDL_RenderClear(renderer_);
  SDL_RenderPresent(renderer_);
}

void ScreenWindow::show(bool white, TimePoint when) {
  wait_until(when);
  white_ = white;
  shown_ = std::chrono::steady_clock::now();
  paint();
}

std::string ScreenWindow::ended() {
  for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
    if (event.type == SDL_QUIT) closed_ = true;
    // What another window had covered is painted anew.
    if (event.type == SDL_WINDOWEVENT && event.window.event == SDL_WINDOWEVENT_EXPOSED) paint();
  }
  return closed_ ? "the window was closed" : "";
}

std::string ScreenWindow::description() const {
  return fmt::format("window of {0}x{0} pixels, video driver {1}", kEdge_px,
                     SDL_GetCurrentVideoDriver());
}

}  // namespace tagwrench

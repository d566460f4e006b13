#include "host/tools/camera_timing/flip_patches.h"

#include <SDL.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <system_error>

#include "host/core/config_error.h"
#include "host/web/server/request_guard.h"

namespace tagwrench {
namespace {

constexpr double kMax_ms = 1e12;  // thirty years: no page is older
constexpr double kDrift = 1e-4;   // two ordinary crystals, 50 ppm each

bool is_reading(double page_ms) {
  return std::isfinite(page_ms) && page_ms >= 0 && page_ms <= kMax_ms;
}

Duration from_ms(double ms) { return Duration(std::llround(1e6 * ms)); }

Duration drift(Duration since) {
  return Duration(std::llround(kDrift * static_cast<double>(since.count())));
}

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr int kExchanges = 16;                          // before the first flip
constexpr auto kSlack = std::chrono::milliseconds(20);  // browsers round their clocks
constexpr auto kMaxDelay = std::chrono::seconds(1);

const WebOptions& with_page(const WebOptions& options) {
  const auto page = options.pages / "flip/index.html";
  std::error_code error;
  if (!std::filesystem::is_regular_file(page, error)) {
    throw ConfigError(
        "--screen web: {} is not there: the pages are not built; `./run web` builds them",
        page.string());
  }
  return options;
}

std::optional<double> number(const json& arguments, const char* key) {
  const auto found = arguments.find(key);
  if (found == arguments.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

bool is_number(const json& arguments, const char* key, std::int64_t wanted) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_number_integer() &&
         found->get<std::int64_t>() == wanted;
}

constexpr int kEdge_px = 700;  // of the window

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

bool PageClock::exchange(TimePoint sent, double page_ms, TimePoint received) noexcept {
  if (!is_reading(page_ms) || received < sent) return false;
  ++exchanges_;
  last_ = received;
  const Duration half = (received - sent) / 2;
  if (exchanges_ > 1 && half > error()) return true;
  half_ = half;
  offset_ = (sent + half).time_since_epoch() - from_ms(page_ms);
  measured_ = received;
  return true;
}

std::optional<TimePoint> PageClock::host_time(double page_ms) const noexcept {
  if (exchanges_ == 0 || !is_reading(page_ms)) return std::nullopt;
  return TimePoint(from_ms(page_ms) + offset_);
}

Duration PageClock::error() const noexcept { return half_ + drift(last_ - measured_); }
PagePatch::PagePatch(const WebOptions& options)
    : server_(with_page(options)), news_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  server_.set_hello({{"type", "hello"}, {"protocol", 1}, {"screen", true}});
  server_.start(*this);
}

bool PagePatch::wait_for_page(int stop_fd) {
  while (true) {
    std::array<pollfd, 2> fds{{{news_.get(), POLLIN, 0}, {stop_fd, POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), -1);
    if (fds[1].revents != 0) return false;
    std::uint64_t news = 0;
    (void)!::read(news_.get(), &news, sizeof news);
    const std::lock_guard lock(mutex_);
    if (!ended_.empty()) return false;
    if (ready_) return true;
  }
}

void PagePatch::show(bool white, TimePoint when) {
  const TimePoint now = Clock::now();
  const Duration delay = std::clamp<Duration>(when - now, Duration::zero(), kMaxDelay);
  const std::lock_guard lock(mutex_);
  shown_.reset();
  flip_sent_ = now;
  ++flip_;
  if (!page_) return;
  server_.post([this, page = *page_,
                order = json{{"type", "flip"},
                             {"number", flip_},
                             {"white", white},
                             {"delay_ms", 1e-6 * static_cast<double>(delay.count())}}] {
    server_.send(page, order);
  });
}

std::string PagePatch::description() const {
  return fmt::format("a page of {}, its clock known to {:.2f} ms", server_.url(),
                     1e-6 * static_cast<double>(clock_error().count()));
}

void PagePatch::handle(PageRequest request) {
  const std::string trouble = take(request);
  server_.answer(request.page, request.id, trouble.empty(), trouble);
  const std::lock_guard lock(mutex_);
  if (page_ == request.page && ended_.empty() &&
      (request.what == "screen" || request.what == "flipped"))
    send_time();
}

/// What is wrong with it; empty: nothing.
std::string PagePatch::take(const PageRequest& request) {
  const std::lock_guard lock(mutex_);
  if (!ended_.empty()) return "it is over: " + ended_;
  if (request.what == "screen") {
    if (page_ && *page_ != request.page) return "another page is the screen; close it there first";
    page_ = request.page;
    return {};
  }
  if (page_ != request.page) return "this page is not the screen";
  if (request.what == "time") return take_time(request);
  if (request.what == "flipped") return take_flip(request);
  if (request.what == "leave") {
    end("somebody ended it at the page");
    return {};
  }
  return fmt::format("'{}' is nothing that a screen can ask", request.what);
}

std::string PagePatch::take_time(const PageRequest& request) {
  if (exchange_ == 0 || !is_number(request.arguments, "number", exchange_))
    return "nobody asked for the time";
  const std::optional<double> page_ms = number(request.arguments, "page_ms");
  if (!page_ms || !clock_.exchange(exchange_sent_, *page_ms, Clock::now()))
    return "page_ms must be the page's time in milliseconds";
  if (!ready_ && clock_.exchanges() < kExchanges) {
    send_time();
  } else if (!ready_) {
    ready_ = true;
    tell_loop();
  }
  return {};
}

std::string PagePatch::take_flip(const PageRequest& request) {
  if (flip_ == 0 || !is_number(request.arguments, "number", flip_) || shown_)
    return "no such flip was ordered";
  const std::optional<double> page_ms = number(request.arguments, "page_ms");
  const std::optional<TimePoint> at = page_ms ? clock_.host_time(*page_ms) : std::nullopt;
  if (!at) return "page_ms must be the page's time in milliseconds";
  const Duration slack = clock_.error() + kSlack;
  if (*at < flip_sent_ - slack || *at > Clock::now() + slack) {
    end("the page's clock jumps: has its device been asleep?");
    return ended_;
  }
  shown_ = *at;
  return {};
}

/// With the mutex held; what is sent may end the page.
void PagePatch::send_time() {
  exchange_sent_ = Clock::now();
  server_.post([this, page = *page_, number = ++exchange_] {
    server_.send(page, {{"type", "time"}, {"number", number}});
  });
}

void PagePatch::page_gone(std::uint64_t page) {
  const std::lock_guard lock(mutex_);
  if (page_ == page) end("the page is gone: it was closed, or the network was cut");
}

void PagePatch::end(std::string why) {
  if (!ended_.empty()) return;
  ended_ = std::move(why);
  tell_loop();
}

void PagePatch::tell_loop() const {
  const std::uint64_t one = 1;
  (void)!::write(news_.get(), &one, sizeof one);
}

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
  shown_ = Clock::now();
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

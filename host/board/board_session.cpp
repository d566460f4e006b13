#include "host/board/board_session.h"

#include <algorithm>
#include <cmath>

#include "protocol/pattern.h"

namespace tagwrench::link {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kOtherVersionHelloPeriod = seconds(1);
constexpr Duration kRepeat = milliseconds(500);  ///< of a request that must be answered
constexpr Duration kLedPeriod = seconds(1);
constexpr Duration kLedPatience = seconds(4);      ///< with a clock that does not settle
constexpr Duration kSilence = milliseconds(1500);  ///< the status alone comes more often
constexpr Duration kQuickPeriod = milliseconds(20);
constexpr std::uint32_t kStartIsOld_us = 1u << 29;  ///< far from the wrap of its sign

bool is_periodic(const Led& led) {
  return (led.mode == LedMode::strobe || led.mode == LedMode::pattern) && led.period_us > 0;
}

/// The same light with a later start.
Led moved_on(Led led, std::int64_t periods) {
  led.start_us += static_cast<std::uint32_t>(periods * led.period_us);
  if (led.mode != LedMode::pattern) return led;
  for (periods %= kPatternBits; periods > 0; --periods) {
    led.pattern_seed = next_pattern_state(led.pattern_seed);
  }
  return led;
}

/// Whole ones from its start to `board_us`; none if it is in the future.
std::uint32_t periods_until(const Led& led, std::uint32_t board_us) {
  const std::uint32_t age = board_us - led.start_us;
  return age < 1u << 31 ? age / led.period_us : 0;
}

}  // namespace

BoardSession::BoardSession(const BoardSessionOptions& options) noexcept
    : options_(options), clock_(options.clock), dither_(options.session | 1) {}

void BoardSession::reconnect() noexcept {
  state_ = BoardState::waiting;
  reader_ = FrameReader{};
  frame_bytes_ = 0;
  first_byte_count_ = 0;
  frame_sequence_ = {};
  configured_ = false;  // another program may have had it
  half_ = {};
  requests_.fill({});
  next_hello_ = line_free_ = {};
  other_host_told_ = false;
}

// ---- Requests ----------------------------------------------------------------------------------

void BoardSession::set_led(const Led& led) noexcept {
  led_ = led;
  led_set_ = true;
  led_refused_told_ = led_accepted_ = false;
  next_led_ = {};
  led_start_ = {};
  led_start_lost_ = false;
  remember_led_start();
}

void BoardSession::tare(std::uint8_t cell_mask, std::uint16_t conversions) noexcept {
  tare_ = {cell_mask, conversions};
  tare_due_ = true;
  next_tare_ = {};
}

void BoardSession::configure(const Configure& configuration) noexcept {
  options_.configuration = configuration;
  if (state_ == BoardState::ready) state_ = BoardState::configuring;
  configured_ = false;
  next_configure_ = {};
}

template <class Message>
std::uint8_t BoardSession::put(const Message& message) noexcept {
  std::array<std::uint8_t, kMaxBodyBytes> body;
  const std::uint8_t count = encode(message, sequence_++, body.data());
  const std::uint8_t wire_bytes = write_frame(body.data(), count, out_ + out_bytes_);
  out_bytes_ += wire_bytes;
  return wire_bytes;
}

std::size_t BoardSession::poll(TimePoint now, std::uint8_t* out) noexcept {
  out_ = out;
  out_bytes_ = 0;
  if (state_ >= BoardState::configuring && now - last_frame_ > kSilence) greet_again(now);
  if (state_ == BoardState::waiting || state_ == BoardState::other_version) {
    if (now >= next_hello_) {
      put(HelloRequest{kProtocolMajor, kProtocolMinor, options_.session});
      next_hello_ = now + (state_ == BoardState::waiting ? kHelloPeriod : kOtherVersionHelloPeriod);
    }
  } else {
    send_requests(now);
  }
  out_ = nullptr;
  const double wire_us = static_cast<double>(out_bytes_) * options_.clock.request_byte_us;
  line_free_ = std::max(now, line_free_) + Duration(std::llround(wire_us * 1e3));
  return out_bytes_;
}

void BoardSession::send_requests(TimePoint now) noexcept {
  if (now >= next_time_request_) send_time_request(now);  // first: nothing delays it
  if (set_id_due_ && now >= next_set_id_) {
    put(SetId{options_.new_id});
    next_set_id_ = now + kRepeat;
  }
  if (state_ == BoardState::configuring && now >= next_configure_) {
    put(options_.configuration);
    next_configure_ = now + kRepeat;
  }
  if (ask_hello_ && now >= next_hello_) {
    put(HelloRequest{kProtocolMajor, kProtocolMinor, options_.session});
    next_hello_ = now + kHelloPeriod;
  }
  if (led_start_lost_) find_led_start(now);
  if (led_set_ && !led_start_lost_ && now >= next_led_) {
    move_led_start_on(now);
    remember_led_start();
    led_sequence_ = sequence_;
    put(led_);
    next_led_ = now + kLedPeriod;
  }
  if (tare_due_ && state_ == BoardState::ready && now >= next_tare_) {
    put(tare_);
    next_tare_ = now + kRepeat;
  }
}

void BoardSession::send_time_request(TimePoint now) noexcept {
  SentRequest& request = requests_[next_request_++ % requests_.size()];
  request.sequence = sequence_;
  request.sent = std::max(now, line_free_);
  request.bytes = put(TimeRequest{});
  request.waiting = true;
  Duration period = options_.time_period;
  if (quick_requests_ > 0) {
    --quick_requests_;
    period = std::min(period, kQuickPeriod);
  }
  // An even period could beat with the adapter's polling or with the samples.
  dither_ = dither_ * 1664525u + 1013904223u;
  const double factor = 0.9 + 0.2 * static_cast<double>(dither_ >> 8) / (1 << 24);
  next_time_request_ = now + Duration(std::llround(static_cast<double>(period.count()) * factor));
}

/// A start that lies far back would turn into one in the future when board time wraps.
void BoardSession::move_led_start_on(TimePoint now) noexcept {
  if (!is_periodic(led_) || !clock_.known()) return;
  const std::uint32_t board_us = clock_.to_board(now);
  const std::uint32_t periods = periods_until(led_, board_us);
  if (board_us - led_.start_us >= kStartIsOld_us) led_ = moved_on(led_, periods);
}

/// Board times end with a restart of the board; host times go on. The latest period's start is the
/// one to remember: those of the board's clock and of the host's drift apart.
void BoardSession::remember_led_start() noexcept {
  if (!is_periodic(led_) || !clock_.known()) return;
  const Led& from = led_start_.known ? led_start_.led : led_;
  led_start_.led = moved_on(from, periods_until(from, clock_.to_board(clock_.latest())));
  led_start_.time = clock_.to_host(led_start_.led.start_us).time;
  led_start_.known = true;
}

/// Of a board that has started anew: where the light would be by now, as its new clock says. Until
/// that clock is good (kLedPatience at most), the light stays off.
void BoardSession::find_led_start(TimePoint now) noexcept {
  if (!clock_.known()) return;
  if (!clock_.report().converged && now - restarted_ < kLedPatience) return;
  led_ = led_start_.led;
  const double since_us = std::chrono::duration<double, std::micro>(now - led_start_.time).count();
  const std::int64_t board_us = std::llround(since_us * (1 + 1e-6 * clock_.report().skew_ppm));
  led_.start_us = clock_.to_board(now) - static_cast<std::uint32_t>(board_us);
  if (board_us > 0) led_ = moved_on(led_, board_us / led_.period_us);
  led_start_.known = led_start_lost_ = false;
  next_led_ = {};
}

TimePoint BoardSession::next_poll() const noexcept {
  if (state_ == BoardState::waiting || state_ == BoardState::other_version) return next_hello_;
  TimePoint next = std::min(next_time_request_, last_frame_ + kSilence + milliseconds(1));
  if (set_id_due_) next = std::min(next, next_set_id_);
  if (state_ == BoardState::configuring) next = std::min(next, next_configure_);
  if (ask_hello_) next = std::min(next, next_hello_);
  if (led_set_ && !led_start_lost_) next = std::min(next, next_led_);
  if (tare_due_ && state_ == BoardState::ready) next = std::min(next, next_tare_);
  return next;
}

SessionCounters BoardSession::counters() const noexcept { return counters_; }

std::uint64_t BoardSession::overwritten() const noexcept {
  return cells_.lost() + adc_.lost() + buttons_.lost() + faults_.lost();
}

}  // namespace tagwrench::link

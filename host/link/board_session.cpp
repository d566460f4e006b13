#include "host/link/board_session.h"

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
constexpr Duration kSilence = milliseconds(1500);  ///< the status alone comes more often
constexpr Duration kQuickPeriod = milliseconds(20);
constexpr std::uint32_t kStartIsOld_us = 1u << 29;  ///< far from the wrap of its sign

}  // namespace

BoardSession::BoardSession(const BoardSessionOptions& options) noexcept
    : options_(options), clock_(options.clock), dither_(options.session | 1) {}

void BoardSession::reconnect() noexcept {
  state_ = BoardState::waiting;
  reader_ = FrameReader{};
  frame_bytes_ = 0;
  first_byte_count_ = 0;
  frame_sequence_ = {};
  half_ = {};
  requests_.fill({});
  next_hello_ = line_free_ = {};
  other_host_told_ = false;
}

// ---- Requests ----------------------------------------------------------------------------------

void BoardSession::set_led(const Led& led) noexcept {
  led_ = led;
  led_set_ = true;
  led_refused_told_ = false;
  next_led_ = {};
}

void BoardSession::tare(std::uint8_t cell_mask, std::uint16_t conversions) noexcept {
  tare_ = {cell_mask, conversions};
  tare_due_ = true;
  next_tare_ = {};
}

void BoardSession::configure(const Configure& configuration) noexcept {
  options_.configuration = configuration;
  if (state_ == BoardState::ready) state_ = BoardState::configuring;
  next_configure_ = {};
}

template <class Message>
std::uint8_t BoardSession::put(const Message& message) noexcept {
  std::array<std::uint8_t, kMostBodyBytes> body;
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
  if (led_set_ && now >= next_led_) {
    move_led_start_on(now);
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
  const bool periodic = led_.mode == LedMode::strobe || led_.mode == LedMode::pattern;
  if (!periodic || led_.period_us == 0 || !clock_.known()) return;
  const std::uint32_t age = clock_.to_board(now) - led_.start_us;
  if (age < kStartIsOld_us || age >= 1u << 31) return;
  std::uint32_t periods = age / led_.period_us;
  led_.start_us += periods * led_.period_us;
  if (led_.mode != LedMode::pattern) return;
  for (periods %= kPatternBits; periods > 0; --periods) {
    led_.pattern_seed = next_pattern_state(led_.pattern_seed);
  }
}

TimePoint BoardSession::next_poll() const noexcept {
  if (state_ == BoardState::waiting || state_ == BoardState::other_version) return next_hello_;
  TimePoint next = std::min(next_time_request_, last_frame_ + kSilence + milliseconds(1));
  if (set_id_due_) next = std::min(next, next_set_id_);
  if (state_ == BoardState::configuring) next = std::min(next, next_configure_);
  if (led_set_) next = std::min(next, next_led_);
  if (tare_due_ && state_ == BoardState::ready) next = std::min(next, next_tare_);
  return next;
}

SessionCounters BoardSession::counters() const noexcept { return counters_; }

std::uint64_t BoardSession::overwritten() const noexcept {
  return cells_.lost() + adc_.lost() + buttons_.lost() + faults_.lost();
}

}  // namespace tagwrench::link

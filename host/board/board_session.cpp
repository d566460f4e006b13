#include "host/board/board_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/codec.h"
#include "protocol/pattern.h"
#include "protocol/version.h"

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
  for (periods %= kPatternBits; periods > 0; --periods)
    led.pattern_seed = next_pattern_state(led.pattern_seed);
  return led;
}

/// Whole ones from its start to `board_us`; none if it is in the future.
std::uint32_t periods_until(const Led& led, std::uint32_t board_us) {
  const std::uint32_t age = board_us - led.start_us;
  return age < 1u << 31 ? age / led.period_us : 0;
}

constexpr Duration kMaxAhead = seconds(2);  ///< of its arrival: a stamp that cannot be
constexpr Duration kMaxAge = seconds(60);   ///< this program was held up for so long
constexpr unsigned kMisfitsOfARestart = 4;  ///< in a row: its clock may have started anew
constexpr unsigned kQuickRequests = 20;     ///< at the start, for the clock to converge soon

/// The board's words are a stranger's bytes: no control codes to a terminal.
void make_printable(char* text) {
  for (; *text != 0; ++text)
    if (*text < 0x20 || *text > 0x7E) *text = '?';
}

HostTime arrival_only(TimePoint arrival) { return {arrival, milliseconds(50), milliseconds(50)}; }

struct Name {
  std::uint32_t value;
  const char* text;
};

template <typename Value>
constexpr Name named(Value value, const char* text) {
  return {static_cast<std::uint32_t>(value), text};
}

constexpr Name kResetCauses[] = {
    named(ResetCause::unknown, "unknown cause"), named(ResetCause::power_on, "power on"),
    named(ResetCause::pin, "reset pin"), named(ResetCause::brown_out, "supply too low"),
    named(ResetCause::watchdog, "watchdog")};

constexpr Name kFaults[] = {
    named(FaultCode::none, "none"),
    named(FaultCode::host_silent, "host_silent"),
    named(FaultCode::led_limited, "led_limited"),
    named(FaultCode::cell_silent, "cell_silent"),
    named(FaultCode::cell_stuck, "cell_stuck"),
    named(FaultCode::supply_low, "supply_low"),
};

constexpr Name kResults[] = {
    named(Result::ok, "ok"),
    named(Result::unknown_kind, "it does not know this request"),
    named(Result::malformed, "the request was malformed"),
    named(Result::out_of_range, "a number is beyond its limits"),
    named(Result::wrong_version, "other protocol version"),
    named(Result::not_ready, "nothing is converted there; is the cell wired?"),
    named(Result::already_set, "it has one already"),
};

constexpr Name kRequests[] = {named(Kind::set_id, "to take an id"), named(Kind::tare, "to tare"),
                              named(Kind::time_request, "a time request")};

const char* find(std::span<const Name> names, std::uint32_t value, const char* none = "?") {
  const auto found = std::ranges::find(names, value, &Name::value);
  return found == names.end() ? none : found->text;
}

std::string version(std::uint32_t packed) {
  return fmt::format("{}.{}", packed >> 8, packed & 0xFF);
}

std::string fault(const BoardEvent& news) {
  switch (static_cast<FaultCode>(news.value)) {
    case FaultCode::host_silent:
      return "board: heard nothing from here for its host timeout and switched the LED off";
    case FaultCode::led_limited:
      return "board: the LED was lowered to the level that it can stand for ever";
    case FaultCode::cell_silent:
      return fmt::format(
          "board: load cell {} does not answer; check the wires of its amplifier (DOUT, SCK, "
          "power)",
          news.other);
    case FaultCode::cell_stuck:
      return fmt::format(
          "board: the data line of load cell {} never goes high; check its amplifier for a short",
          news.other);
    case FaultCode::supply_low: return "board: its supply is low; use another cable or port";
    case FaultCode::none: break;
  }
  return fmt::format("board: fault {} on channel {}", news.value, news.other);
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

void BoardSession::take(std::span<const std::uint8_t> bytes, TimePoint arrival) noexcept {
  counters_.bytes += bytes.size();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (counters_.frames == 0 && first_byte_count_ < first_bytes_.size())
      first_bytes_[first_byte_count_++] = bytes[i];
    if (frame_bytes_ < 1000) ++frame_bytes_;
    switch (reader_.take(bytes[i])) {
      case Received::nothing: break;
      case Received::damaged: ++counters_.damaged_frames; break;
      case Received::frame: {
        // The bytes behind it came later, one after the other.
        const double behind_us =
            static_cast<double>(bytes.size() - 1 - i) * options_.clock.reply_byte_us;
        ++counters_.frames;
        take_frame(arrival - Duration(std::llround(behind_us * 1e3)), frame_bytes_);
        break;
      }
    }
    if (bytes[i] == 0) frame_bytes_ = 0;
  }
}

template <typename Sequence>
std::uint16_t BoardSession::lost_between(std::optional<Sequence>& last,
                                         Sequence sequence) noexcept {
  const auto lost = static_cast<Sequence>(last ? sequence - *last - 1 : 0);
  last = sequence;
  return lost;
}

void BoardSession::take_frame(TimePoint arrival, std::uint16_t wire_bytes) noexcept {
  counters_.lost_frames += lost_between(frame_sequence_, reader_.sequence());
  last_frame_ = std::max(last_frame_, arrival);
  const auto read = [this](auto message, auto&& use) {
    if (decode(reader_.message(), reader_.message_bytes(), message))
      use(message);
    else
      ++counters_.unknown_frames;
  };
  // Until the board has said who it is, the rest may be of an earlier start, or have waited in a
  // driver while the line was cut.
  const Kind kind = static_cast<Kind>(reader_.kind());
  if (state_ == BoardState::waiting && kind != Kind::hello) return;
  switch (kind) {
    case Kind::hello: return read(Hello{}, [&](const Hello& m) { take_hello(m, arrival); });
    case Kind::capabilities:
      return read(Capabilities{}, [&](const Capabilities& m) {
        capabilities_ = m;
        has_capabilities_ = true;
      });
    case Kind::cell_sample:
      return read(CellSample{}, [&](const CellSample& m) { take_cell(m, arrival); });
    case Kind::adc_sample:
      return read(AdcSample{}, [&](const AdcSample& m) { take_adc(m, arrival); });
    case Kind::button_event:
      return read(ButtonEvent{}, [&](const ButtonEvent& m) {
        buttons_.push({m.button, m.pressed, host_time(m.time_us, arrival)});
      });
    case Kind::time_reply:
      return read(TimeReply{},
                  [&](const TimeReply& m) { take_time_reply(m, arrival, wire_bytes); });
    case Kind::status: return read(Status{}, [&](const Status& m) { take_status(m, arrival); });
    case Kind::answer: return read(Answer{}, [&](const Answer& m) { take_answer(m); });
    case Kind::tare_result: return read(TareResult{}, [&](const TareResult& m) { tares_.push(m); });
    case Kind::fault:
      return read(Fault{}, [&](const Fault& m) {
        faults_.push({m.code, m.channel, host_time(m.time_us, arrival)});
        log_info(BoardEvent::Kind::fault, static_cast<std::uint32_t>(m.code), m.channel);
      });
    default: ++counters_.unknown_frames;
  }
}

void BoardSession::take_hello(const Hello& hello, TimePoint arrival) noexcept {
  if (hello.session != options_.session) {
    // It started anew, or answers another host: ask whom it listens to.
    if (hello.session != 0) configured_ = false;
    if (state_ >= BoardState::configuring) greet_again(arrival);
    return;
  }
  const bool restarted = has_hello_ && hello.boot_id != boot_id_;
  const bool known = has_hello_ && !restarted;
  hello_ = hello;
  make_printable(hello_.board);
  make_printable(hello_.firmware);
  boot_id_ = hello.boot_id;
  has_hello_ = true;
  ask_hello_ = false;
  if (restarted) {
    ++counters_.restarts;
    configured_ = false;
    restarted_ = arrival;
    led_start_lost_ = led_start_.known;
    log_info(BoardEvent::Kind::restarted, static_cast<std::uint32_t>(hello.reset_cause));
  }
  const std::uint32_t version = hello.protocol_major * 256u + hello.protocol_minor;
  const Update update = needed_update(kProtocolMajor, hello.protocol_major);
  if (update != Update::none) {
    if (state_ != BoardState::other_version) {
      log_info(update == Update::board ? BoardEvent::Kind::board_too_old
                                       : BoardEvent::Kind::host_too_old,
               version);
    }
    state_ = BoardState::other_version;
    return;
  }
  if (!known) {  // what belonged to the board's last life
    clock_.restart();
    half_ = {};
    requests_.fill({});
    cell_sequence_.fill({});
    adc_sequence_.fill({});
    has_status_ = false;
  }
  if (known && state_ >= BoardState::configuring) return;  // a repeated answer
  log_info(BoardEvent::Kind::connected, version);
  state_ = configured_ ? BoardState::ready : BoardState::configuring;
  set_id_due_ = hello.unique_id.count == 0 && options_.new_id.count > 0;
  next_set_id_ = next_configure_ = next_led_ = next_time_request_ = next_tare_ = {};
  quick_requests_ = kQuickRequests;
}

void BoardSession::take_answer(const Answer& answer) noexcept {
  const auto result = static_cast<std::uint32_t>(answer.result);
  const bool ok = answer.result == Result::ok;
  switch (static_cast<Kind>(answer.request_kind)) {
    case Kind::configure:
      if (state_ != BoardState::configuring) return;
      state_ = BoardState::ready;
      configured_ = true;
      if (!ok) log_info(BoardEvent::Kind::configuration_refused, result);
      return;
    case Kind::set_id:
      if (!set_id_due_) return;
      set_id_due_ = false;
      if (ok) {
        hello_.unique_id = options_.new_id;
        log_info(BoardEvent::Kind::id_given);
      } else {
        log_info(BoardEvent::Kind::request_refused, answer.request_kind, result);
      }
      return;
    case Kind::led:
      if (ok) led_accepted_ |= answer.request_sequence == led_sequence_;
      if (ok || led_refused_told_) return;
      led_refused_told_ = true;
      log_info(BoardEvent::Kind::led_refused, result);
      return;
    case Kind::tare:
      if (!tare_due_) return;
      tare_due_ = false;
      if (!ok) log_info(BoardEvent::Kind::request_refused, answer.request_kind, result);
      return;
    case Kind::hello_request: return;  // Hello says it in full
    default:
      if (!ok) log_info(BoardEvent::Kind::request_refused, answer.request_kind, result);
  }
}

void BoardSession::take_status(const Status& status, TimePoint arrival) noexcept {
  status_ = status;
  has_status_ = true;
  if (status.session == options_.session || state_ < BoardState::configuring) return;
  if (status.session != 0) configured_ = false;
  if (status.session != 0 && !other_host_told_) {
    other_host_told_ = true;
    log_info(BoardEvent::Kind::other_host, status.session);
  }
  greet_again(arrival);
}

void BoardSession::take_time_reply(const TimeReply& reply, TimePoint arrival,
                                   std::uint16_t wire_bytes) noexcept {
  if (half_.waiting && reply.previous_valid &&
      reply.previous_request_sequence == half_.request_sequence) {
    half_.exchange.board_sent_us = reply.previous_sent_us;
    misfits_ = clock_.add(half_.exchange) ? 0 : misfits_ + 1;
    if (misfits_ == kMisfitsOfARestart && state_ >= BoardState::configuring) {
      misfits_ = 0;
      ask_hello_ = true;
      next_hello_ = arrival;
    }
  }
  half_.waiting = false;
  for (SentRequest& request : requests_) {
    if (!request.waiting || request.sequence != reply.request_sequence) continue;
    request.waiting = false;
    half_.exchange = {.host_sent = request.sent,
                      .host_received = arrival,
                      .board_received_us = reply.received_us,
                      .board_sent_us = 0,
                      .request_bytes = request.bytes,
                      .reply_bytes = wire_bytes};
    half_.request_sequence = reply.request_sequence;
    half_.waiting = true;
  }
}

void BoardSession::take_cell(const CellSample& sample, TimePoint arrival) noexcept {
  if (sample.channel >= cell_sequence_.size()) {
    ++counters_.unknown_frames;
    return;
  }
  const std::uint16_t lost = lost_between(cell_sequence_[sample.channel], sample.sequence);
  counters_.lost_conversions += lost;
  cells_.push({sample.channel, sample.counts, sample.saturated, host_time(sample.time_us, arrival),
               sample.time_us, sample.sequence, lost});
}

void BoardSession::take_adc(const AdcSample& sample, TimePoint arrival) noexcept {
  if (sample.channel >= adc_sequence_.size()) {
    ++counters_.unknown_frames;
    return;
  }
  adc_.push({sample.channel, sample.counts, host_time(sample.time_us, arrival), sample.sequence,
             lost_between(adc_sequence_[sample.channel], sample.sequence)});
}

HostTime BoardSession::host_time(std::uint32_t board_us, TimePoint arrival) const noexcept {
  if (!clock_.known()) return arrival_only(arrival);
  const HostTime time = clock_.to_host(board_us);
  const Duration age = arrival - time.time;
  const bool sane = age < kMaxAge && age > -kMaxAhead;
  return sane ? time : arrival_only(arrival);
}

const char* reset_cause_name(std::uint32_t cause) { return find(kResetCauses, cause); }
const char* fault_name(std::uint32_t code) { return find(kFaults, code); }
const char* result_name(std::uint32_t result) { return find(kResults, result); }

std::string text(const BoardEvent& news) {
  switch (news.kind) {
    case BoardEvent::Kind::connected:
      return fmt::format("board: connected, protocol {}", version(news.value));
    case BoardEvent::Kind::restarted:
      return fmt::format("board: it started anew ({}); configured again",
                         reset_cause_name(news.value));
    case BoardEvent::Kind::board_too_old:
      return fmt::format(
          "board: its firmware speaks protocol {}, this program {}.{}; update the board: "
          "`tagwrench board flash`",
          version(news.value), kProtocolMajor, kProtocolMinor);
    case BoardEvent::Kind::host_too_old:
      return fmt::format(
          "board: its firmware speaks protocol {}, this program {}.{}; update tagwrench on this "
          "computer",
          version(news.value), kProtocolMajor, kProtocolMinor);
    case BoardEvent::Kind::id_given: return "board: it had no id and was given one";
    case BoardEvent::Kind::configuration_refused:
      return fmt::format("board: refused its configuration: {}", result_name(news.value));
    case BoardEvent::Kind::led_refused:
      return fmt::format("board: refused this light: {}; `tagwrench board info` shows the limits",
                         result_name(news.value));
    case BoardEvent::Kind::request_refused:
      return fmt::format("board: refused {}: {}", find(kRequests, news.value, "a request"),
                         result_name(news.other));
    case BoardEvent::Kind::other_host:
      return fmt::format("board: another program speaks to it too (session {:08x}); end it",
                         news.value);
    case BoardEvent::Kind::fault: return fault(news);
    case BoardEvent::Kind::unplugged:
      return "board: the port is gone; plug it in again, this program waits";
    case BoardEvent::Kind::plugged: return "board: the port is back";
  }
  return "?";
}

}  // namespace tagwrench::link

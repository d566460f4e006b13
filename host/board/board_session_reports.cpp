// What a session does with what the board says.
#include <algorithm>
#include <cmath>

#include "host/board/board_session.h"
#include "protocol/version.h"

namespace tagwrench::link {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kMaxAhead = seconds(2);  ///< of its arrival: a stamp that cannot be
constexpr Duration kMaxAge = seconds(60);   ///< this program was held up for so long
constexpr unsigned kMisfitsOfARestart = 4;  ///< in a row: its clock may have started anew
constexpr unsigned kQuickRequests = 20;     ///< at the start, for the clock to converge soon

/// The board's words are a stranger's bytes: no control codes to a terminal.
void make_printable(char* text) {
  for (; *text != 0; ++text) {
    if (*text < 0x20 || *text > 0x7E) *text = '?';
  }
}

HostTime arrival_only(TimePoint arrival) { return {arrival, milliseconds(50), milliseconds(50)}; }

}  // namespace

void BoardSession::take(std::span<const std::uint8_t> bytes, TimePoint arrival) noexcept {
  counters_.bytes += bytes.size();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (counters_.frames == 0 && first_byte_count_ < first_bytes_.size())
      first_bytes_[first_byte_count_++] = bytes[i];
    if (frame_bytes_ < 1000) ++frame_bytes_;
    switch (reader_.take(bytes[i])) {
      case Received::nothing:
        break;
      case Received::damaged:
        ++counters_.damaged_frames;
        break;
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

void BoardSession::take_frame(TimePoint arrival, std::uint16_t wire_bytes) noexcept {
  watch_frame_sequence(reader_.sequence());
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
    case Kind::hello:
      return read(Hello{}, [&](const Hello& m) { take_hello(m, arrival); });
    case Kind::capabilities:
      return read(Capabilities{}, [&](const Capabilities& m) { take_capabilities(m); });
    case Kind::cell_sample:
      return read(CellSample{}, [&](const CellSample& m) { take_cell(m, arrival); });
    case Kind::adc_sample:
      return read(AdcSample{}, [&](const AdcSample& m) { take_adc(m, arrival); });
    case Kind::button_event:
      return read(ButtonEvent{}, [&](const ButtonEvent& m) { take_button(m, arrival); });
    case Kind::time_reply:
      return read(TimeReply{},
                  [&](const TimeReply& m) { take_time_reply(m, arrival, wire_bytes); });
    case Kind::status:
      return read(Status{}, [&](const Status& m) { take_status(m, arrival); });
    case Kind::answer:
      return read(Answer{}, [&](const Answer& m) { take_answer(m); });
    case Kind::tare_result:
      return read(TareResult{}, [&](const TareResult& m) { take_tare(m); });
    case Kind::fault:
      return read(Fault{}, [&](const Fault& m) { take_fault(m, arrival); });
    default:
      ++counters_.unknown_frames;
  }
}

void BoardSession::watch_frame_sequence(std::uint8_t sequence) noexcept {
  if (frame_sequence_.known) {
    counters_.lost_frames +=
        static_cast<std::uint8_t>(sequence - static_cast<std::uint8_t>(frame_sequence_.last) - 1);
  }
  frame_sequence_ = {true, sequence};
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
  if (!known) restart_streams();
  if (known && state_ >= BoardState::configuring) return;  // a repeated answer
  log_info(BoardEvent::Kind::connected, version);
  state_ = configured_ ? BoardState::ready : BoardState::configuring;
  set_id_due_ = hello.unique_id.count == 0 && options_.new_id.count > 0;
  next_set_id_ = next_configure_ = next_led_ = next_time_request_ = next_tare_ = {};
  quick_requests_ = kQuickRequests;
}

/// What belonged to the board's last life.
void BoardSession::restart_streams() noexcept {
  clock_.restart();
  half_ = {};
  requests_.fill({});
  cell_sequence_.fill({});
  adc_sequence_.fill({});
  has_status_ = false;
}

void BoardSession::take_capabilities(const Capabilities& capabilities) noexcept {
  capabilities_ = capabilities;
  has_capabilities_ = true;
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
    case Kind::hello_request:
      return;  // Hello says it in full
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

/// Its answer's boot id says whether it started anew.
void BoardSession::greet_again(TimePoint now) noexcept {
  state_ = BoardState::waiting;
  next_hello_ = now;
}

void BoardSession::take_tare(const TareResult& result) noexcept { tares_.push(result); }

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

std::uint16_t BoardSession::lost_between(SequenceWatch& watch, std::uint16_t sequence) noexcept {
  const auto lost =
      watch.known ? static_cast<std::uint16_t>(sequence - watch.last - 1) : std::uint16_t{0};
  watch = {true, sequence};
  return lost;
}

void BoardSession::take_cell(const CellSample& sample, TimePoint arrival) noexcept {
  if (sample.channel >= cell_sequence_.size()) {
    ++counters_.unknown_frames;
    return;
  }
  CellReading reading;
  reading.channel = sample.channel;
  reading.counts = sample.counts;
  reading.saturated = sample.saturated;
  reading.time = host_time(sample.time_us, arrival);
  reading.board_us = sample.time_us;
  reading.sequence = sample.sequence;
  reading.lost_before = lost_between(cell_sequence_[sample.channel], sample.sequence);
  counters_.lost_conversions += reading.lost_before;
  cells_.push(reading);
}

void BoardSession::take_adc(const AdcSample& sample, TimePoint arrival) noexcept {
  if (sample.channel >= adc_sequence_.size()) {
    ++counters_.unknown_frames;
    return;
  }
  AdcReading reading;
  reading.channel = sample.channel;
  reading.counts = sample.counts;
  reading.time = host_time(sample.time_us, arrival);
  reading.sequence = sample.sequence;
  reading.lost_before = lost_between(adc_sequence_[sample.channel], sample.sequence);
  adc_.push(reading);
}

void BoardSession::take_button(const ButtonEvent& event, TimePoint arrival) noexcept {
  buttons_.push({event.button, event.pressed, host_time(event.time_us, arrival)});
}

void BoardSession::take_fault(const Fault& fault, TimePoint arrival) noexcept {
  faults_.push({fault.code, fault.channel, host_time(fault.time_us, arrival)});
  log_info(BoardEvent::Kind::fault, static_cast<std::uint32_t>(fault.code), fault.channel);
}

HostTime BoardSession::host_time(std::uint32_t board_us, TimePoint arrival) const noexcept {
  if (!clock_.known()) return arrival_only(arrival);
  const HostTime time = clock_.to_host(board_us);
  const Duration age = arrival - time.time;
  const bool sane = age < kMaxAge && age > -kMaxAhead;
  return sane ? time : arrival_only(arrival);
}

void BoardSession::log_info(BoardEvent::Kind kind, std::uint32_t value,
                            std::uint32_t other) noexcept {
  news_.push({kind, value, other});
}

}  // namespace tagwrench::link

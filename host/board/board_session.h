// Room board: the board that lights the tags and reads load cells.
// In:  bytes of a serial port (protocol/README.md), the board's time in us, the host's clock.
// Out: load cells in counts or N, buttons, voltages, faults, each with its time on the host's clock
//      and that time's standard deviation; orders for the LED, in permille.
// Then: board_link.h (port and session), clock_sync.h (docs/theory.md), cell_calibration.h.
//
// The conversation with a board. Pure: bytes and times go in, bytes and samples come out; it has no
// descriptor and, once constructed, touches no heap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "host/board/clock_sync.h"
#include "host/board/ring.h"
#include "host/core/types.h"
#include "protocol/codec.h"
#include "protocol/frame.h"

namespace tagwrench::link {

// What happens on the link that a person should be told: data in the loop, a line of text outside.

struct BoardEvent {
  enum class Kind : std::uint8_t {
    connected,              ///< value: protocol major << 8 | minor of the board
    restarted,              ///< the board started anew; value: ResetCause
    board_too_old,          ///< value: its protocol major << 8 | minor
    host_too_old,           ///< value: the board's protocol major << 8 | minor
    id_given,               ///< the board had no unique id
    configuration_refused,  ///< value: Result
    led_refused,            ///< value: Result
    request_refused,        ///< value: Kind of the request, other: Result
    other_host,             ///< value: the other session
    fault,                  ///< value: FaultCode, other: channel
    unplugged,
    plugged,
  };
  Kind kind = Kind::connected;
  std::uint32_t value = 0;
  std::uint32_t other = 0;
};

/// One line, remedy included where there is one.
std::string text(const BoardEvent& news);

const char* reset_cause_name(std::uint32_t reset_cause);
const char* fault_name(std::uint32_t fault_code);
const char* result_name(std::uint32_t result);

struct BoardSessionOptions {
  std::uint32_t session = 0;  ///< drawn at random; tells this host from another one
  UniqueId new_id{};          ///< for a board that has none; empty: leave it without
  Configure configuration{
      .host_timeout_ms = 5000,
      .cells = {CellInput::a128, CellInput::a128, CellInput::a128, CellInput::a128},
      .cell_count = kMaxCells,
      .cell_rate_sps = 80,
      .adc_mask = 0,
      .adc_rate_hz = 100,
      .status_period_ms = 1000};
  Duration time_period = std::chrono::milliseconds(100);  ///< between time requests
  ClockSyncOptions clock;
};

enum class BoardState : std::uint8_t {
  waiting,        ///< for a Hello
  other_version,  ///< answered, but speaks another version of the protocol
  configuring,    ///< Hello has come, the configuration is not confirmed
  ready,
};

/// Times are the host's, and carry the uncertainty of the clock as it was known on arrival.
struct CellReading {
  std::uint8_t channel = 0;
  std::int32_t counts = 0;
  bool saturated = false;
  HostTime time;
  std::uint32_t board_us = 0;
  std::uint16_t sequence = 0;
  std::uint16_t lost_before = 0;  ///< conversions between the last reading and this one
};

struct AdcReading {
  std::uint8_t channel = 0;
  std::uint16_t counts = 0;
  HostTime time;
  std::uint16_t sequence = 0;
  std::uint16_t lost_before = 0;
};

struct ButtonReading {
  std::uint8_t button = 0;
  bool pressed = false;
  HostTime time;
};

struct FaultReading {
  FaultCode code = FaultCode::none;
  std::uint8_t channel = 0;
  HostTime time;
};

/// Since construction.
struct SessionCounters {
  std::uint64_t bytes = 0;
  std::uint64_t frames = 0;  ///< good ones
  std::uint64_t damaged_frames = 0;
  std::uint64_t unknown_frames = 0;  ///< of a kind that this version does not know, or malformed
  std::uint64_t lost_frames = 0;     ///< by the board's frame sequence numbers
  std::uint64_t lost_conversions = 0;
  std::uint32_t restarts = 0;  ///< of the board, seen by its boot id
};

class BoardSession {
 public:
  /// Room for all that one poll() writes.
  static constexpr std::size_t kMaxBytesOut = 6 * kMaxFrameBytes;
  static constexpr Duration kHelloPeriod = std::chrono::milliseconds(250);

  explicit BoardSession(const BoardSessionOptions& options) noexcept;

  /// Bytes as they came; the last of them was there at `arrival`. Their samples wait to be taken.
  void take(std::span<const std::uint8_t> bytes, TimePoint arrival) noexcept;

  /// What is to be sent now, to `out` (kMaxBytesOut of room); returns its length. The bytes count
  /// as sent at `now`, or, if the line was still busy, right after those before.
  std::size_t poll(TimePoint now, std::uint8_t* out) noexcept;
  /// When to call poll() at the latest.
  TimePoint next_poll() const noexcept;

  /// The line was cut: starts over with the handshake. What was configured and lit is set again.
  void reconnect() noexcept;

  // ---- What the board is told ----

  /// Lights the LED so, now and after every reconnection; also the keep-alive. `start_us` may stay
  /// the same: it is moved on by whole periods as time goes by. A board that starts anew stays dark
  /// until its clock is known again, and goes on as if it had not.
  void set_led(const Led& led) noexcept;
  /// Whether the board has confirmed it.
  bool led_accepted() const noexcept { return led_accepted_; }
  void tare(std::uint8_t cell_mask, std::uint16_t conversions) noexcept {
    tare_ = {cell_mask, conversions};
    tare_due_ = true;
    next_tare_ = {};
  }

  // ---- What the board said ----

  BoardState state() const noexcept { return state_; }
  const Hello& hello() const noexcept { return hello_; }
  const Capabilities& capabilities() const noexcept { return capabilities_; }
  bool has_capabilities() const noexcept { return has_capabilities_; }
  const Status& status() const noexcept { return status_; }
  bool has_status() const noexcept { return has_status_; }
  const ClockSync& clock() const noexcept { return clock_; }
  ClockSync& clock() noexcept { return clock_; }
  const SessionCounters& counters() const noexcept { return counters_; }
  /// Samples that nobody took before they were overwritten.
  std::uint64_t overwritten() const noexcept {
    return cells_.lost() + adc_.lost() + buttons_.lost() + faults_.lost();
  }

  bool next(CellReading& reading) noexcept { return cells_.pop(reading); }
  bool next(AdcReading& reading) noexcept { return adc_.pop(reading); }
  bool next(ButtonReading& reading) noexcept { return buttons_.pop(reading); }
  bool next(FaultReading& reading) noexcept { return faults_.pop(reading); }
  bool next(TareResult& result) noexcept { return tares_.pop(result); }
  bool next(BoardEvent& news) noexcept { return news_.pop(news); }

  /// What came before there was a good frame: tells a board of ours from other devices.
  std::span<const std::uint8_t> first_bytes() const noexcept {
    return {first_bytes_.data(), first_byte_count_};
  }

 private:
  struct SentRequest {
    std::uint8_t sequence = 0;
    std::uint8_t bytes = 0;
    TimePoint sent{};
    bool waiting = false;
  };
  struct HalfExchange {
    TimeExchange exchange;
    std::uint8_t request_sequence = 0;
    bool waiting = false;
  };
  /// A start of a period of the LED's in both clocks.
  struct LedStart {
    Led led{};  ///< what shines from then on
    TimePoint time{};
    bool known = false;
  };

  void take_frame(TimePoint arrival, std::uint16_t wire_bytes) noexcept;
  void take_hello(const Hello& hello, TimePoint arrival) noexcept;
  void take_answer(const Answer& answer) noexcept;
  void take_status(const Status& status, TimePoint arrival) noexcept;
  void take_time_reply(const TimeReply& reply, TimePoint arrival,
                       std::uint16_t wire_bytes) noexcept;
  void take_cell(const CellSample& sample, TimePoint arrival) noexcept;
  void take_adc(const AdcSample& sample, TimePoint arrival) noexcept;
  /// Its answer's boot id says whether it started anew.
  void greet_again(TimePoint now) noexcept {
    state_ = BoardState::waiting;
    next_hello_ = now;
  }
  void log_info(BoardEvent::Kind kind, std::uint32_t value = 0, std::uint32_t other = 0) noexcept {
    news_.push({kind, value, other});
  }
  HostTime host_time(std::uint32_t board_us, TimePoint arrival) const noexcept;
  /// Numbers that are missing; 0 for the first.
  template <typename Sequence>
  static std::uint16_t lost_between(std::optional<Sequence>& last, Sequence sequence) noexcept;

  template <class Message>
  std::uint8_t put(const Message& message) noexcept;
  void send_requests(TimePoint now) noexcept;
  void send_time_request(TimePoint now) noexcept;
  void move_led_start_on(TimePoint now) noexcept;
  void remember_led_start() noexcept;
  void find_led_start(TimePoint now) noexcept;

  BoardSessionOptions options_;
  ClockSync clock_;
  FrameReader reader_;
  std::uint16_t frame_bytes_ = 0;  ///< on the wire, of the frame that is coming in
  std::array<std::uint8_t, 32> first_bytes_{};
  std::size_t first_byte_count_ = 0;

  BoardState state_ = BoardState::waiting;
  Hello hello_{};
  bool has_hello_ = false;
  Capabilities capabilities_{};
  bool has_capabilities_ = false;
  Status status_{};
  bool has_status_ = false;
  bool other_host_told_ = false;
  bool configured_ = false;  ///< confirmed by the board since it last started
  bool ask_hello_ = false;   ///< while all else goes on: whether it has started anew
  TimePoint restarted_{};
  std::uint32_t boot_id_ = 0;
  TimePoint last_frame_{};
  SessionCounters counters_;
  std::optional<std::uint8_t> frame_sequence_;
  std::array<std::optional<std::uint16_t>, kMaxCells> cell_sequence_;
  std::array<std::optional<std::uint16_t>, 8> adc_sequence_;

  std::uint8_t* out_ = nullptr;
  std::size_t out_bytes_ = 0;
  std::uint8_t sequence_ = 0;
  TimePoint line_free_{};
  TimePoint next_hello_{};
  TimePoint next_configure_{};
  TimePoint next_led_{};
  TimePoint next_time_request_{};
  TimePoint next_tare_{};
  TimePoint next_set_id_{};
  unsigned quick_requests_ = 0;
  std::uint32_t dither_ = 1;
  Led led_{};
  bool led_set_ = false;
  bool led_refused_told_ = false;
  bool led_accepted_ = false;
  std::uint8_t led_sequence_ = 0;  ///< of the latest order
  LedStart led_start_;
  bool led_start_lost_ = false;  ///< its board time is of an earlier life of the board
  bool set_id_due_ = false;
  Tare tare_{};
  bool tare_due_ = false;
  std::array<SentRequest, 8> requests_;
  std::size_t next_request_ = 0;
  HalfExchange half_;
  unsigned misfits_ = 0;  ///< exchanges in a row that the clock rejected

  Ring<CellReading, 1024> cells_;
  Ring<AdcReading, 1024> adc_;
  Ring<ButtonReading, 64> buttons_;
  Ring<FaultReading, 64> faults_;
  Ring<TareResult, 16> tares_;
  Ring<BoardEvent, 32> news_;
};

}  // namespace tagwrench::link

// Messages <-> bytes. The structs mirror link.proto, where fields, units and wrap-around are
// explained; *.pb.h stays in codec_*.cpp. A message type's encode() and decode() are functions of
// their own, so that a board links only what it uses.
#pragma once

#include "protocol/frame.h"

namespace tagwrench {
namespace link {

/// A host may talk to a board of the same major version; a higher minor version only adds.
constexpr uint8_t kProtocolMajor = 1;
constexpr uint8_t kProtocolMinor = 0;

constexpr uint8_t kMaxCells = 4;
constexpr uint8_t kIdBytes = 8;
constexpr uint32_t kBaud = 500000;

/// First byte of a body. Requests go to the board, reports (bit 7) to the host.
enum class Kind : uint8_t {
  hello_request = 0x01,
  configure = 0x02,
  led = 0x03,
  time_request = 0x04,
  tare = 0x05,
  set_id = 0x06,

  hello = 0x81,
  capabilities = 0x82,
  cell_sample = 0x83,
  adc_sample = 0x84,
  button_event = 0x85,
  time_reply = 0x86,
  status = 0x87,
  answer = 0x88,
  tare_result = 0x89,
  fault = 0x8A,
};

enum class CellInput : uint8_t { off = 0, a128 = 1, b32 = 2, a64 = 3 };
enum class LedMode : uint8_t { off = 0, steady = 1, strobe = 2, pattern = 3 };
enum class ResetCause : uint8_t { unknown = 0, power_on = 1, pin = 2, brown_out = 3, watchdog = 4 };
enum class Result : uint8_t {
  ok = 0,
  unknown_kind = 1,
  malformed = 2,
  out_of_range = 3,
  wrong_version = 4,
  not_ready = 5,
  already_set = 6,
};
enum class FaultCode : uint8_t {
  none = 0,
  host_silent = 1,
  led_limited = 2,
  cell_silent = 3,
  cell_stuck = 4,
  supply_low = 5,
};

struct UniqueId {
  uint8_t bytes[kIdBytes];
  uint8_t count;  ///< 0: none given yet
};

// ---- Requests ----

struct HelloRequest {
  uint8_t protocol_major;
  uint8_t protocol_minor;
  uint32_t session;
};

struct Configure {
  uint16_t host_timeout_ms;
  CellInput cells[kMaxCells];
  uint8_t cell_count;  ///< of `cells`; the others are off
  uint8_t cell_rate_sps;
  uint8_t adc_mask;
  uint8_t adc_rate_hz;
  uint16_t status_period_ms;
};

struct Led {
  LedMode mode;
  uint16_t level_permille;
  uint32_t period_us;
  uint16_t width_us;
  uint32_t start_us;
  uint16_t pattern_seed;
};

struct TimeRequest {};

struct Tare {
  uint8_t cell_mask;
  uint16_t conversions;
};

struct SetId {
  UniqueId unique_id;
};

// ---- Reports ----

struct Hello {
  uint8_t protocol_major;
  uint8_t protocol_minor;
  char board[16];     ///< ends with a zero
  char firmware[12];  ///< ends with a zero
  UniqueId unique_id;
  uint32_t boot_id;
  ResetCause reset_cause;
  uint32_t session;
};

struct Capabilities {
  uint8_t cells;
  uint8_t adc_channels;
  uint8_t adc_bits;
  uint8_t buttons;
  uint16_t led_levels;
  uint16_t led_sustained_permille;
  uint16_t led_full_time_ms;
  uint16_t strobe_width_min_us;
  uint16_t strobe_width_max_us;
  uint16_t strobe_period_min_us;
  uint32_t strobe_period_max_us;
  uint32_t time_step_ns;
  bool measures_supply;
  bool measures_temperature;
};

struct CellSample {
  uint8_t channel;
  int32_t counts;
  uint32_t time_us;
  uint16_t sequence;
  uint16_t missed;
  bool saturated;
};

struct AdcSample {
  uint8_t channel;
  uint16_t counts;
  uint32_t time_us;
  uint16_t sequence;
};

struct ButtonEvent {
  uint8_t button;
  bool pressed;
  uint32_t time_us;
  uint16_t sequence;
};

struct TimeReply {
  uint8_t request_sequence;
  uint32_t received_us;
  uint8_t previous_request_sequence;
  uint32_t previous_sent_us;
  bool previous_valid;
};

struct Status {
  uint32_t time_us;
  uint32_t session;
  uint16_t led_level_permille;
  bool led_limited;
  uint32_t led_on_time_s;
  uint16_t supply_mv;
  int16_t temperature_centidegree;
  uint16_t bad_frames;
  uint16_t unknown_kinds;
  uint16_t overruns;
  uint16_t dropped_reports;
  uint16_t cell_rate_centihertz[kMaxCells];
  uint8_t cell_count;  ///< of cell_rate_centihertz
  uint16_t stack_free_bytes;
  uint32_t longest_loop_us;
};

struct Answer {
  uint8_t request_kind;
  uint8_t request_sequence;
  Result result;
};

struct TareResult {
  uint8_t channel;
  int32_t mean_counts;
  uint32_t spread_counts;
  uint16_t conversions;
};

struct Fault {
  FaultCode code;
  uint8_t channel;
  uint32_t time_us;
};

/// encode() writes a whole body (kind, sequence, message) to `body`, kMaxBodyBytes of room, and
/// returns its length. Every message of these types fits; strings and ids that are too long are
/// cut. Reports are encoded by hand (codec_board.cpp), byte for byte what nanopb makes of them.
uint8_t encode(const HelloRequest& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Configure& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Led& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const TimeRequest& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Tare& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const SetId& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Hello& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Capabilities& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const ButtonEvent& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Status& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Answer& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const TareResult& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const Fault& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const CellSample& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const AdcSample& message, uint8_t sequence, uint8_t* body);
uint8_t encode(const TimeReply& message, uint8_t sequence, uint8_t* body);

/// decode() reads the message after a body's header. False, with `message` all zero: not a message
/// of this type, or an enum value that this version does not know. Fields that this version does
/// not know are skipped; an unknown reset cause in Hello reads as unknown. What does not print in a
/// string reads as '?'.
bool decode(const uint8_t* bytes, uint8_t count, HelloRequest& message);
bool decode(const uint8_t* bytes, uint8_t count, Configure& message);
bool decode(const uint8_t* bytes, uint8_t count, Led& message);
bool decode(const uint8_t* bytes, uint8_t count, TimeRequest& message);
bool decode(const uint8_t* bytes, uint8_t count, Tare& message);
bool decode(const uint8_t* bytes, uint8_t count, SetId& message);
bool decode(const uint8_t* bytes, uint8_t count, Hello& message);
bool decode(const uint8_t* bytes, uint8_t count, Capabilities& message);
bool decode(const uint8_t* bytes, uint8_t count, CellSample& message);
bool decode(const uint8_t* bytes, uint8_t count, AdcSample& message);
bool decode(const uint8_t* bytes, uint8_t count, ButtonEvent& message);
bool decode(const uint8_t* bytes, uint8_t count, TimeReply& message);
bool decode(const uint8_t* bytes, uint8_t count, Status& message);
bool decode(const uint8_t* bytes, uint8_t count, Answer& message);
bool decode(const uint8_t* bytes, uint8_t count, TareResult& message);
bool decode(const uint8_t* bytes, uint8_t count, Fault& message);

}  // namespace link
}  // namespace tagwrench

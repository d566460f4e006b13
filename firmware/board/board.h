// What the application asks of a board. Each board defines these functions in a folder of its own
// and has the loop that calls App::poll(); which board it is, the linker decides. Nothing here
// blocks for longer than reading one conversion takes, and nothing fails.
//
// Times are the board's: microseconds since its start, 32 bits, wrapping after 71.6 min.
#pragma once

#include "protocol/codec.h"

namespace tagwrench {
namespace board {

/// What this board has; told to the host as Capabilities.
struct Traits {
  const char* name;
  uint8_t cells;
  uint8_t adc_channels;
  uint8_t adc_bits;
  uint8_t buttons;
  uint16_t led_levels;
  uint16_t strobe_width_min_us;
  uint16_t strobe_width_max_us;
  uint16_t strobe_period_min_us;
  uint32_t strobe_period_max_us;
  uint16_t time_step_ns;
  bool measures_supply;
};
extern const Traits kTraits;

// ---- Clock ----

uint32_t now_us();

// ---- Serial port, 500,000 baud ----

struct SerialByte {
  uint8_t value;
  uint32_t time_us;  ///< when its last bit had come; of zero bytes only, which end frames
};
/// The next received byte, if there is one.
bool serial_take(SerialByte& byte);
/// Bytes that were received and lost, since the start; wraps.
uint16_t serial_overruns();
/// How many bytes serial_send() can take now.
uint8_t serial_room();
/// Queues bytes; `count` is at most serial_room(). If `stamped`, the departure of the first one is
/// recorded.
void serial_send(const uint8_t* bytes, uint8_t count, bool stamped);
/// When the first byte of the last stamped bytes began to leave. False: it has not yet.
bool serial_departure(uint32_t& time_us);

// ---- LED ----

/// Steady light, 0..1000 permille, by a PWM that no camera sees. Drops edges that are waiting.
void led_steady(uint16_t permille);
/// Dark, from now on led by led_edge(). Drops edges that are waiting.
void led_pulses();
/// How many more edges can wait; at least 8 when none does.
uint8_t led_edge_room();
/// Queues a change of the light (full or dark), at most 2^30 us ahead and after those before it.
/// An edge that comes too late happens at once.
void led_edge(uint32_t at_us, bool on);

/// Whether light that is led by edges is on now.
bool led_shining();
/// A number that outlives a reset but not a loss of power; 0 then, and before it was first kept.
int32_t kept_heat();
void keep_heat(int32_t heat);

// ---- Load-cell amplifiers (HX711) ----

struct Conversion {
  uint8_t channel;
  int32_t counts;    ///< 24 bits with sign
  uint32_t time_us;  ///< data ready
  uint8_t lost;      ///< conversions of this channel that nobody took, since the one before
  bool stuck;        ///< the data line stayed low after reading: `counts` means nothing
};
/// 10 or 80 conversions a second.
void cell_rate(uint8_t rate_sps);
/// Starts a channel anew with this input; its first conversion may still be one of another input,
/// or of unknown age. `off` powers the amplifier down.
void cell_input(uint8_t channel, link::CellInput input);
bool cell_take(Conversion& conversion);

// ---- ADC ----

struct Measurement {
  uint8_t channel;
  uint16_t counts;
  uint32_t time_us;  ///< of the trigger
  uint8_t lost;      ///< as in Conversion
};
/// Samples the channels in the mask at this rate each, evenly in turn, triggered by a timer.
void adc_start(uint8_t channel_mask, uint8_t rate_hz);
bool adc_take(Measurement& measurement);

// ---- Buttons ----

/// True if the line has changed since the last call, with the time of the first change.
bool button_edge(uint8_t button, uint32_t& first_us);
bool button_pressed(uint8_t button);

// ---- The board itself ----

/// count is 0 if none was ever kept.
link::UniqueId unique_id();
/// Keeps it for ever. Written in the background.
void keep_unique_id(const link::UniqueId& id);
/// Another number after every start.
uint32_t boot_id();
link::ResetCause reset_cause();
/// 0: not measured (yet).
uint16_t supply_mv();
/// Stack never touched since the start; 0 where it does not matter.
uint16_t stack_free_bytes();
/// The on-board lamp that shows a person whether a host is there.
void host_lamp(bool on);

}  // namespace board
}  // namespace tagwrench

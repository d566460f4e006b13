#include "tests/unit/firmware/fake_board.h"

#include <utility>

namespace tagwrench::board {
namespace {

constexpr std::size_t kEdges = 8;

bool reached(std::uint32_t now_us, std::uint32_t at_us) {
  return static_cast<std::int32_t>(now_us - at_us) >= 0;
}

}  // namespace

FakeBoard& fake_board() {
  static FakeBoard board;
  return board;
}

void FakeBoard::advance(std::uint32_t by_us) {
  now_us += by_us;
  while (!waiting.empty() && reached(now_us, waiting.front().at_us)) {
    if (waiting.front().on != shining) light.push_back(waiting.front());
    shining = waiting.front().on;
    waiting.erase(waiting.begin());
  }
}

void FakeBoard::change(unsigned button, bool pressed, std::uint32_t at_us) {
  Button& changed = buttons[button];
  changed.pressed = pressed;
  if (!changed.changed) changed.first_us = at_us;
  changed.changed = true;
}

const Traits kTraits = {
    .name = "fake",
    .cells = 4,
    .adc_channels = 2,
    .adc_bits = 10,
    .buttons = 2,
    .led_levels = 1001,
    .strobe_width_min_us = 100,
    .strobe_width_max_us = 20000,
    .strobe_period_min_us = 2000,
    .strobe_period_max_us = 1000000,
    .time_step_ns = 1000,
    .measures_supply = true,
};

std::uint32_t now_us() { return fake_board().now_us; }

bool serial_take(SerialByte& byte) {
  if (fake_board().incoming.empty()) return false;
  byte = fake_board().incoming.front();
  fake_board().incoming.pop_front();
  return true;
}
std::uint16_t serial_overruns() { return fake_board().overruns; }
std::uint8_t serial_room() { return fake_board().room; }
void serial_send(const std::uint8_t* bytes, std::uint8_t count, bool stamped) {
  FakeBoard& board = fake_board();
  board.sent.insert(board.sent.end(), bytes, bytes + count);
  if (stamped) {
    board.stamped = true;
    board.departure_us = board.now_us;
  }
}
bool serial_departure(std::uint32_t& time_us) {
  time_us = fake_board().departure_us;
  return fake_board().stamped && fake_board().departed;
}

void led_steady(std::uint16_t permille) {
  FakeBoard& board = fake_board();
  if (board.shining) board.light.push_back({board.now_us, false});
  board.shining = false;
  board.waiting.clear();
  board.pulses = false;
  board.steady_permille = permille;
}
void led_pulses() {
  led_steady(0);
  fake_board().pulses = true;
}
std::uint8_t led_edge_room() {
  return static_cast<std::uint8_t>(kEdges - fake_board().waiting.size());
}
void led_edge(std::uint32_t at_us, bool on) {
  FakeBoard& board = fake_board();
  if (reached(board.now_us, at_us)) ++board.late_edges;
  board.waiting.push_back({at_us, on});
}

bool led_shining() { return fake_board().shining; }
std::int32_t kept_heat() { return fake_board().heat; }
void keep_heat(std::int32_t heat) { fake_board().heat = heat; }

void cell_rate(std::uint8_t rate_sps) { fake_board().cell_rate_sps = rate_sps; }
void cell_input(std::uint8_t channel, link::CellInput input) {
  fake_board().inputs[channel] = input;
}
bool cell_take(Conversion& conversion) {
  if (fake_board().conversions.empty()) return false;
  conversion = fake_board().conversions.front();
  fake_board().conversions.pop_front();
  return true;
}

void adc_start(std::uint8_t channel_mask, std::uint8_t rate_hz) {
  fake_board().adc_mask = channel_mask;
  fake_board().adc_rate_hz = rate_hz;
}
bool adc_take(Measurement& measurement) {
  if (fake_board().measurements.empty()) return false;
  measurement = fake_board().measurements.front();
  fake_board().measurements.pop_front();
  return true;
}

bool button_edge(std::uint8_t button, std::uint32_t& first_us) {
  first_us = fake_board().buttons[button].first_us;
  return std::exchange(fake_board().buttons[button].changed, false);
}
bool button_pressed(std::uint8_t button) { return fake_board().buttons[button].pressed; }

link::UniqueId unique_id() { return fake_board().id; }
void keep_unique_id(const link::UniqueId& id) { fake_board().id = id; }
std::uint32_t boot_id() { return fake_board().boot_id; }
link::ResetCause reset_cause() { return fake_board().reset_cause; }
std::uint16_t supply_mv() { return fake_board().supply_mv; }
std::uint16_t stack_free_bytes() { return 0; }
void host_lamp(bool on) { fake_board().host_lamp = on; }

}  // namespace tagwrench::board

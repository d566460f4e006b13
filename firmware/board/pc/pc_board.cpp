#include "firmware/board/pc/pc_board.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <numbers>
#include <random>
#include <utility>

#include "firmware/board/board.h"
#include "firmware/board/pc/port_name.h"

namespace tagwrench {
namespace board {
namespace {

constexpr double kCountsPerNewton = 100000;
constexpr double kNoiseCounts = 40;
constexpr uint32_t kPressUs = 200000;

uint64_t clock_us() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<uint64_t>(now.tv_sec) * 1000000 + static_cast<uint64_t>(now.tv_nsec) / 1000;
}

const uint64_t kStartUs = clock_us();
std::mt19937 random_numbers{std::random_device{}()};
const uint32_t kBootId = random_numbers();

int port = -1;
std::string port_name;
std::string terminal_name;
std::deque<SerialByte> received;
bool sent_stamped = false;
uint32_t sent_us = 0;

uint16_t led_permille = 0;
bool shining = false;  ///< after the last edge
int32_t heat = 0;
struct Edge {
  uint32_t at_us;
  bool on;
};
constexpr size_t kEdges = 8;
std::deque<Edge> edges;

uint32_t cell_period_us = 100000;
struct Channel {
  Cell cell;
  bool on = false;
  bool ready = false;
  uint8_t lost = 0;
  uint32_t due_us = 0;
  uint32_t ready_us = 0;
};
Channel channels[link::kMaxCells];

uint8_t adc_mask = 0;
uint32_t adc_period_us = 0;
uint32_t adc_due_us = 0;
std::deque<Measurement> measurements;

struct Button {
  bool pressed = false;
  bool changed = false;
  uint32_t changed_us = 0;
};
Button buttons[2];

link::UniqueId id;
std::string command;

bool due(uint32_t at_us, uint32_t now) { return static_cast<int32_t>(now - at_us) >= 0; }

double seconds(uint32_t at_us) { return at_us * 1e-6; }

void show_led(const char* what) { fprintf(stderr, "led %.6f %s\n", seconds(now_us()), what); }

void change(Button& button, bool pressed, uint32_t now) { button = Button{pressed, true, now}; }

double force_n(unsigned channel, uint32_t at_us) {
  const Cell& cell = channels[channel].cell;
  if (cell.model == CellModel::constant) return cell.force_n;
  return cell.force_n * std::sin(2 * std::numbers::pi * cell.hz * seconds(at_us));
}

void advance_cells(uint32_t now) {
  for (Channel& channel : channels) {
    if (!channel.on || channel.cell.model == CellModel::none) continue;
    while (due(channel.due_us, now)) {
      if (channel.ready) ++channel.lost;
      channel.ready = true;
      channel.ready_us = channel.due_us;
      channel.due_us += cell_period_us;
    }
  }
}

void advance_adc(uint32_t now) {
  while (adc_mask != 0 && due(adc_due_us, now)) {
    for (uint8_t i = 0; i < kTraits.adc_channels; ++i) {
      if (!(adc_mask >> i & 1)) continue;
      const double part =
          0.5 + 0.4 * std::sin(2 * std::numbers::pi * (1 + i) * seconds(adc_due_us));
      measurements.push_back({i, static_cast<uint16_t>(1023 * part), adc_due_us, 0});
    }
    adc_due_us += adc_period_us;
  }
}

void advance_buttons(uint32_t now) {
  for (Button& button : buttons) {
    if (button.pressed && due(button.changed_us + kPressUs, now)) change(button, false, now);
  }
}

void advance_led(uint32_t now) {
  while (!edges.empty() && due(edges.front().at_us, now)) {
    shining = edges.front().on;
    edges.pop_front();
  }
}

void read_port() {
  uint8_t bytes[256];
  const ssize_t count = read(port, bytes, sizeof bytes);
  const uint32_t now = now_us();
  for (ssize_t i = 0; i < count; ++i) received.push_back({bytes[i], now});
}

/// False: nothing more will come.
bool read_commands() {
  char text[256];
  const ssize_t count = read(STDIN_FILENO, text, sizeof text);
  for (ssize_t i = 0; i < count; ++i) {
    if (text[i] != '\n') {
      command += text[i];
      continue;
    }
    unsigned button;
    if (sscanf(command.c_str(), "button %u", &button) == 1 && button < kTraits.buttons) {
      press_button(button);
    } else {
      fprintf(stderr, "tagwrench_board_pc: no such command: %s (button 0|1)\n", command.c_str());
    }
    command.clear();
  }
  return count > 0;
}

}  // namespace

const Traits kTraits = {
    .name = "pc",
    .cells = link::kMaxCells,
    .adc_channels = 2,
    .adc_bits = 10,
    .buttons = 2,
    .led_levels = 1001,
    .strobe_width_min_us = 100,
    .strobe_width_max_us = 20000,
    .strobe_period_min_us = 2000,
    .strobe_period_max_us = 1000000,
    .time_step_ns = 1000,
    .measures_supply = false,
};

std::string open_port(const std::string& link) {
  const auto no_terminal = [] {
    return std::string("cannot make a pseudo-terminal: ") + std::strerror(errno) +
           "; is /dev/pts mounted?";
  };
  port = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0 || grantpt(port) != 0 || unlockpt(port) != 0) return no_terminal();
  char name[64];
  if (ptsname_r(port, name, sizeof name) != 0) return no_terminal();
  // Held open, so that the port outlives a host that closes it; raw, so that it echoes nothing.
  const int host_end = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  if (host_end < 0 || tcgetattr(host_end, &settings) != 0) return no_terminal();
  cfmakeraw(&settings);
  if (tcsetattr(host_end, TCSANOW, &settings) != 0) return no_terminal();
  port_name = link;
  terminal_name = name;
  return take_name(link, name);
}

void close_port() { leave_name(port_name, terminal_name); }

void wire_cell(unsigned channel, const Cell& cell) { channels[channel].cell = cell; }

void press_button(unsigned button) { change(buttons[button], true, now_us()); }

void wait() {
  static bool listening = true;
  // Nothing that is modelled happens more often.
  const timespec most{0, 500000};
  pollfd watched[] = {{port, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
  if (received.empty()) ppoll(watched, listening ? 2 : 1, &most, nullptr);
  if (watched[0].revents & POLLIN) read_port();
  if (listening && watched[1].revents != 0) listening = read_commands();
  const uint32_t now = now_us();
  advance_cells(now);
  advance_adc(now);
  advance_buttons(now);
  advance_led(now);
}

uint32_t now_us() { return static_cast<uint32_t>(clock_us() - kStartUs); }

bool serial_take(SerialByte& byte) {
  if (received.empty()) return false;
  byte = received.front();
  received.pop_front();
  return true;
}

uint16_t serial_overruns() { return 0; }

uint8_t serial_room() { return 255; }

void serial_send(const uint8_t* bytes, uint8_t count, bool stamped) {
  if (stamped) {
    sent_us = now_us();
    sent_stamped = true;
  }
  // Like a cable, the port does not wait for a reader: what it does not take is lost.
  if (write(port, bytes, count) != count) tcflush(port, TCOFLUSH);
}

bool serial_departure(uint32_t& time_us) {
  time_us = sent_us;
  return sent_stamped;
}

void led_steady(uint16_t permille) {
  edges.clear();
  shining = false;
  if (permille != led_permille) show_led(std::to_string(permille).c_str());
  led_permille = permille;
}

void led_pulses() {
  led_steady(0);
  show_led("pulses");
}

uint8_t led_edge_room() { return static_cast<uint8_t>(kEdges - edges.size()); }

void led_edge(uint32_t at_us, bool on) { edges.push_back({at_us, on}); }

bool led_shining() { return shining; }

int32_t kept_heat() { return heat; }

void keep_heat(int32_t now) { heat = now; }

void cell_rate(uint8_t rate_sps) { cell_period_us = 1000000u / rate_sps; }

void cell_input(uint8_t channel, link::CellInput input) {
  Channel& changed = channels[channel];
  changed.on = input != link::CellInput::off;
  changed.ready = changed.on && changed.cell.model == CellModel::stuck;
  changed.lost = 0;
  changed.ready_us = now_us();
  changed.due_us = changed.ready_us + cell_period_us;
}

bool cell_take(Conversion& conversion) {
  for (uint8_t i = 0; i < link::kMaxCells; ++i) {
    Channel& channel = channels[i];
    if (!channel.ready) continue;
    channel.ready = false;
    const bool stuck = channel.cell.model == CellModel::stuck;
    std::normal_distribution<double> noise{0, kNoiseCounts};
    const double counts = kCountsPerNewton * force_n(i, channel.ready_us) + noise(random_numbers);
    conversion = {i, static_cast<int32_t>(std::clamp(counts, -8388608.0, 8388607.0)),
                  channel.ready_us, channel.lost, stuck};
    channel.lost = 0;
    return true;
  }
  return false;
}

void adc_start(uint8_t channel_mask, uint8_t rate_hz) {
  measurements.clear();
  adc_mask = channel_mask;
  if (channel_mask == 0) return;
  adc_period_us = 1000000u / rate_hz;
  adc_due_us = now_us() + adc_period_us;
}

bool adc_take(Measurement& measurement) {
  if (measurements.empty()) return false;
  measurement = measurements.front();
  measurements.pop_front();
  return true;
}

bool button_edge(uint8_t button, uint32_t& first_us) {
  first_us = buttons[button].changed_us;
  return std::exchange(buttons[button].changed, false);
}

bool button_pressed(uint8_t button) { return buttons[button].pressed; }

link::UniqueId unique_id() { return id; }
void keep_unique_id(const link::UniqueId& new_id) { id = new_id; }
uint32_t boot_id() { return kBootId; }
link::ResetCause reset_cause() { return link::ResetCause::power_on; }
uint16_t supply_mv() { return 0; }
uint16_t stack_free_bytes() { return 0; }

/// There is none.
void host_lamp(bool) {}

}  // namespace board
}  // namespace tagwrench

#include "tests/firmware/board_orders.h"

#include <cmath>
#include <numbers>
#include <sstream>

namespace tagwrench::emulator {

namespace {

using Words = std::istringstream;

double seconds_of(VirtualTime time) { return static_cast<double>(time.count()) * 1e-9; }

bool order_cell(Words& words, EmulatedBoard& board) {
  unsigned channel = 0;
  std::string what;
  if (!(words >> channel >> what) || channel >= kCells) return false;
  if (what == "connect") {
    board.cell(channel).set_wiring(Hx711::Wiring::connected);
  } else if (what == "disconnect") {
    board.cell(channel).set_wiring(Hx711::Wiring::disconnected);
  } else if (what == "stuck") {
    board.cell(channel).set_wiring(Hx711::Wiring::stuck_low);
  } else if (what == "sine") {
    double amplitude = 0;
    double hz = 0;
    if (!(words >> amplitude >> hz)) return false;
    board.cell(channel).bridge().force = [=](VirtualTime t) {
      return amplitude * std::sin(2 * std::numbers::pi * hz * seconds_of(t));
    };
  } else {
    std::istringstream number(what);
    double force = 0;
    if (!(number >> force)) return false;
    board.set_force(channel, force);
  }
  return true;
}

bool order_adc(Words& words, EmulatedBoard& board) {
  unsigned channel = 0;
  double volts = 0;
  if (!(words >> channel >> volts) || channel > 1) return false;
  board.set_adc(channel, volts);
  return true;
}

bool order_supply(Words& words, EmulatedBoard& board) {
  double volts = 0;
  if (!(words >> volts)) return false;
  board.adc().set_supply(volts);
  return true;
}

bool order_button(Words& words, EmulatedBoard& board) {
  unsigned button = 0;
  std::string what;
  if (!(words >> button >> what) || button >= kButtons) return false;
  if (what != "press" && what != "release") return false;
  constexpr unsigned kBounces = 3;
  board.move_button(button, what == "press", board.now(), kBounces);
  return true;
}

bool order_noise(Words& words, PtyLine& port) {
  double rate = 0;
  if (!(words >> rate) || rate < 0 || rate > 1) return false;
  port.set_bit_errors(rate);
  return true;
}

bool order_babble(Words& words, PtyLine& port) {
  unsigned count = 0;
  if (!(words >> count) || count > 100000) return false;
  port.babble(count);
  return true;
}

}  // namespace

std::optional<std::string> carry_out(const std::string& line, EmulatedBoard& board, PtyLine& port) {
  Words words(line);
  std::string order;
  if (!(words >> order)) return std::nullopt;
  bool good = true;
  if (order == "cell") {
    good = order_cell(words, board);
  } else if (order == "adc") {
    good = order_adc(words, board);
  } else if (order == "supply") {
    good = order_supply(words, board);
  } else if (order == "button") {
    good = order_button(words, board);
  } else if (order == "reset") {
    board.press_reset();
  } else if (order == "power") {
    board.power_cycle();
  } else if (order == "hang") {
    board.hang();
  } else if (order == "noise") {
    good = order_noise(words, port);
  } else if (order == "babble") {
    good = order_babble(words, port);
  } else if (order == "unplug") {
    port.unplug();
  } else if (order == "plug") {
    // The board has its power from the cable.
    if (!port.plugged()) board.power_cycle();
    port.plug();
  } else {
    good = false;
  }
  if (good) return std::nullopt;
  return "'" + line + "' is no order; there are: " + kOrders;
}

}  // namespace tagwrench::emulator

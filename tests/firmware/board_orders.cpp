#include "tests/firmware/board_orders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <iterator>
#include <memory>
#include <numbers>
#include <sstream>

namespace tagwrench::emulator {

namespace {

using Words = std::istringstream;
using SteadyTime = std::chrono::steady_clock::time_point;

struct Order {
  const char* form;
  const char* effect;
};

constexpr std::array<Order, 17> kOrders{{
    {"cell N FORCE_N", "load cell N (0 to 3), where it is wired, feels this force"},
    {"cell N at T_NS FORCE_N", "it feels it at this time of CLOCK_MONOTONIC; between, a line"},
    {"cell N sine AMPLITUDE_N HZ", "it feels a force that goes up and down"},
    {"cell N gain FACTOR", "its amplifier shows so many times what it showed before"},
    {"cell N disconnect", "its wires come off"},
    {"cell N connect", "they are put on again"},
    {"cell N stuck", "its data line stays low"},
    {"adc N VOLT", "voltage at the analogue input N (0 or 1)"},
    {"supply VOLT", "voltage that the board runs on"},
    {"button N press|release", "button N (0 or 1), whose contact bounces"},
    {"reset", "presses the board's reset button"},
    {"power", "takes its power away for a moment"},
    {"hang", "its program stops, until the watchdog strikes"},
    {"unplug | plug", "pulls the USB cable out, puts it in again"},
    {"noise BIT_ERROR_RATE", "flips bits on the line, either way (0.001: one in 1000); 0 ends it"},
    {"babble BYTES", "sends the host so many bytes that mean nothing"},
    {"quit", "ends the emulated board"},
}};

/// Has all of the order been read?
bool done(std::istringstream& words) {
  words >> std::ws;
  return words.eof();
}

double seconds_of(VirtualTime time) { return static_cast<double>(time.count()) * 1e-9; }

void apply_sine(Hx711& cell, double amplitude_n, double hz) {
  cell.bridge().force = [=](VirtualTime t) {
    return amplitude_n * std::sin(2 * std::numbers::pi * hz * seconds_of(t));
  };
}

/// A force that is told point by point, ahead of time.
class ForceCourse {
 public:
  explicit ForceCourse(const SteadyTime& start) : start_(start) {}
  void add(std::int64_t time_ns, double force_n) {
    constexpr std::size_t kMax = 4096;  // points; those of some seconds
    if (!points_.empty() && time_ns <= points_.back().time_ns) return;
    points_.push_back({time_ns, force_n});
    if (points_.size() > kMax) points_.pop_front();
  }
  double operator()(VirtualTime time) const {
    const std::int64_t t = (start_ + time).time_since_epoch().count();
    const auto after =
        std::upper_bound(points_.begin(), points_.end(), t,
                         [](std::int64_t at, const Point& p) { return at < p.time_ns; });
    if (after == points_.begin()) return points_.front().force_n;
    if (after == points_.end()) return points_.back().force_n;
    const Point& before = *std::prev(after);
    const double share = static_cast<double>(t - before.time_ns) /
                         static_cast<double>(after->time_ns - before.time_ns);
    return before.force_n + share * (after->force_n - before.force_n);
  }

 private:
  struct Point {
    std::int64_t time_ns;
    double force_n;
  };
  const SteadyTime& start_;
  std::deque<Point> points_;
};

void order_course(Hx711& cell, std::int64_t time_ns, double force_n, const SteadyTime& start) {
  struct Follow {
    std::shared_ptr<ForceCourse> course;
    double operator()(VirtualTime time) const { return (*course)(time); }
  };
  const Follow* now = cell.bridge().force.target<Follow>();
  const Follow follow = now != nullptr ? *now : Follow{std::make_shared<ForceCourse>(start)};
  follow.course->add(time_ns, force_n);
  if (now == nullptr) cell.bridge().force = follow;
}

bool order_cell(Words& words, EmulatedBoard& board, const SteadyTime& start) {
  unsigned channel = 0;
  std::string what;
  if (!(words >> channel >> what) || channel >= kCells) return false;
  Hx711& cell = board.cell(channel);
  if (what == "sine") {
    double amplitude = 0;
    double hz = 0;
    if (!(words >> amplitude >> hz) || !done(words)) return false;
    apply_sine(cell, amplitude, hz);
    return true;
  }
  if (what == "at") {
    std::int64_t time_ns = 0;
    double force = 0;
    if (!(words >> time_ns >> force) || !done(words)) return false;
    order_course(cell, time_ns, force, start);
    return true;
  }
  if (what == "gain") {
    double factor = 0;
    if (!(words >> factor) || !done(words)) return false;
    cell.bridge().counts_per_newton *= factor;
    return true;
  }
  if (!done(words)) return false;
  if (what == "connect") {
    cell.set_wiring(Hx711::Wiring::connected);
  } else if (what == "disconnect") {
    cell.set_wiring(Hx711::Wiring::disconnected);
  } else if (what == "stuck") {
    cell.set_wiring(Hx711::Wiring::stuck_low);
  } else {
    std::istringstream number(what);
    double force = 0;
    if (!(number >> force) || !done(number)) return false;
    board.set_force(channel, force);
  }
  return true;
}

bool order_adc(Words& words, EmulatedBoard& board) {
  unsigned channel = 0;
  double volts = 0;
  if (!(words >> channel >> volts) || channel > 1 || !done(words)) return false;
  board.set_adc(channel, volts);
  return true;
}

bool order_supply(Words& words, EmulatedBoard& board) {
  double volts = 0;
  if (!(words >> volts) || !done(words)) return false;
  board.adc().set_supply(volts);
  return true;
}

bool order_button(Words& words, EmulatedBoard& board) {
  unsigned button = 0;
  std::string what;
  if (!(words >> button >> what) || button >= kButtons || !done(words)) return false;
  if (what != "press" && what != "release") return false;
  constexpr unsigned kBounces = 3;
  board.move_button(button, what == "press", board.now(), kBounces);
  return true;
}

bool order_noise(Words& words, PtyLine& port) {
  double rate = 0;
  if (!(words >> rate) || rate < 0 || rate > 1 || !done(words)) return false;
  port.set_bit_errors(rate);
  return true;
}

bool order_babble(Words& words, PtyLine& port) {
  unsigned count = 0;
  if (!(words >> count) || count > 100000 || !done(words)) return false;
  port.babble(count);
  return true;
}

std::optional<std::string> plug(EmulatedBoard& board, PtyLine& port) {
  if (port.plugged()) return std::nullopt;
  try {
    port.plug();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  board.power_cycle();  // it has its power from the cable
  return std::nullopt;
}

}  // namespace

std::string help_on_orders() {
  std::string text = "Orders, on standard input:";
  for (const Order& order : kOrders) {
    const std::string form = order.form;
    text += "\n  " + form + std::string(28 - form.size(), ' ') + order.effect;
  }
  return text;
}

void wire(EmulatedBoard& board, const board::CellOption& option) {
  Hx711& cell = board.cell(option.channel);
  switch (option.cell.model) {
    case board::CellModel::constant: board.set_force(option.channel, option.cell.force_n); break;
    case board::CellModel::sine: apply_sine(cell, option.cell.force_n, option.cell.hz); break;
    case board::CellModel::none: cell.set_wiring(Hx711::Wiring::disconnected); break;
    case board::CellModel::stuck: cell.set_wiring(Hx711::Wiring::stuck_low); break;
  }
}

std::optional<std::string> carry_out(const std::string& line, EmulatedBoard& board, PtyLine& port,
                                     const SteadyTime& start) {
  Words words(line);
  std::string order;
  if (!(words >> order)) return std::nullopt;
  bool good = true;
  if (order == "cell") {
    good = order_cell(words, board, start);
  } else if (order == "adc") {
    good = order_adc(words, board);
  } else if (order == "supply") {
    good = order_supply(words, board);
  } else if (order == "button") {
    good = order_button(words, board);
  } else if (order == "noise") {
    good = order_noise(words, port);
  } else if (order == "babble") {
    good = order_babble(words, port);
  } else if (!done(words)) {
    good = false;
  } else if (order == "reset") {
    board.press_reset();
  } else if (order == "power") {
    board.power_cycle();
  } else if (order == "hang") {
    board.hang();
  } else if (order == "unplug") {
    port.unplug();
  } else if (order == "plug") {
    return plug(board, port);
  } else {
    good = false;
  }
  if (good) return std::nullopt;
  std::string all;
  for (const Order& one : kOrders) all += std::string(all.empty() ? "" : " | ") + one.form;
  return "'" + line + "' is no order; there are: " + all;
}

}  // namespace tagwrench::emulator

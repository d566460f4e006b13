// Messages with every field anywhere in its range, the ends of the range often.
#pragma once

#include <algorithm>
#include <limits>
#include <random>

#include "tests/unit/protocol/messages.h"

namespace tagwrench::link {

constexpr CellInput last_of(CellInput) { return CellInput::a64; }
constexpr LedMode last_of(LedMode) { return LedMode::pattern; }
constexpr ResetCause last_of(ResetCause) { return ResetCause::watchdog; }
constexpr Result last_of(Result) { return Result::already_set; }
constexpr FaultCode last_of(FaultCode) { return FaultCode::supply_low; }

class RandomMessages {
 public:
  explicit RandomMessages(std::uint32_t seed) : random_(seed) {}

  template <class Message>
  Message make() {
    Message message{};
    std::apply([&](auto&... field) { (fill(field), ...); }, fields(message));
    settle(message);
    return message;
  }

 private:
  int below(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }

  void fill(bool& field) { field = below(2) == 1; }
  template <class T>
  requires std::is_integral_v<T>
  void fill(T& field) {
    using Limits = std::numeric_limits<T>;
    // Where the number of bytes of an encoded integer changes.
    const T steps[] = {0,    1,    Limits::min(), Limits::max(),       static_cast<T>(-1),
                       0x3F, 0x40, 0x7F,          static_cast<T>(0x80)};
    if (below(2) == 0) {
      field = steps[below(std::size(steps))];
    } else {
      field = static_cast<T>(random_() >> below(32));
      if (below(2) == 0) field = static_cast<T>(-field);
    }
  }
  template <class T>
  requires std::is_enum_v<T>
  void fill(T& field) { field = static_cast<T>(below(static_cast<int>(last_of(field)) + 1)); }
  template <class T, std::size_t n>
  void fill(T (&field)[n]) {
    for (T& element : field) fill(element);
  }
  template <std::size_t n>
  void fill(char (&field)[n]) {
    const int length = below(static_cast<int>(n));
    for (int i = 0; i < length; ++i) field[i] = static_cast<char>(' ' + below(95));
  }
  void fill(UniqueId& id) {
    id.count = static_cast<std::uint8_t>(below(kIdBytes + 1));
    for (int i = 0; i < id.count; ++i) fill(id.bytes[i]);
  }

  /// What lies beyond a count is not sent.
  template <class Message>
  void settle(Message&) {}
  void settle(Configure& m) {
    m.cell_count = static_cast<std::uint8_t>(m.cell_count % (kMaxCells + 1));
    std::fill(m.cells + m.cell_count, m.cells + kMaxCells, CellInput::off);
  }
  void settle(Status& m) {
    m.cell_count = static_cast<std::uint8_t>(m.cell_count % (kMaxCells + 1));
    std::fill(m.cell_rate_centihertz + m.cell_count, m.cell_rate_centihertz + kMaxCells, 0);
  }

  std::mt19937 random_;
};

}  // namespace tagwrench::link

// The serial port of the emulated board, bit-exact in time as simavr's is not: a byte takes its 10
// bits in both directions, the receiver holds two bytes and a third in its shift register, and
// loses what comes after (datasheet, section 19).
#pragma once

#include <deque>
#include <vector>

#include "tests/firmware/avr_core.h"

namespace tagwrench::emulator {

struct SentByte {
  std::uint8_t value = 0;
  VirtualTime begin{};  ///< of the start bit
  VirtualTime end{};    ///< of the stop bit
};

class Usart {
 public:
  explicit Usart(AvrCore& core);

  /// Bytes for the board, one after the other at `baud` from `earliest` on, or when the bytes
  /// before are through.
  void send(const std::uint8_t* bytes, std::size_t count, VirtualTime earliest);
  void set_baud(double baud) { baud_ = baud; }
  /// When the line to the board is free.
  VirtualTime line_free() const { return line_free_; }
  std::size_t waiting() const { return line_.size(); }

  /// What the board sent since the last call.
  std::vector<SentByte> take_sent();

  std::uint64_t overruns() const { return overruns_; }        ///< bytes that silicon would lose
  std::uint64_t unheard() const { return unheard_; }          ///< came while the receiver was off
  std::uint64_t overwritten() const { return overwritten_; }  ///< written while UDRE was clear
  std::uint64_t received() const { return received_; }

 private:
  struct LineByte {
    std::uint8_t value;
    VirtualTime begin;
  };

  void reset();
  Cycle bit_cycles();
  Cycle frame_cycles();
  void next_line_byte();
  void line_event(Cycle when);
  void arrive();
  void begin_transmission(std::uint8_t value, Cycle when);
  void end_transmission(Cycle when);
  void write_data(std::uint8_t value);
  std::uint8_t read_data();
  void update_levels();

  AvrCore& core_;
  CycleTimer line_timer_;
  CycleTimer transmit_timer_;
  double baud_ = 500000;
  std::deque<LineByte> line_;
  VirtualTime line_free_{};
  bool in_byte_ = false;  ///< the start bit has come, the stop bit has not
  std::deque<std::uint8_t> fifo_;
  std::optional<std::uint8_t> shift_;  ///< complete, but the FIFO is full
  bool data_overrun_ = false;
  std::optional<std::uint8_t> transmit_data_;
  bool transmitting_ = false;
  bool transmit_complete_ = false;
  std::uint8_t shift_out_ = 0;
  Cycle shift_begin_ = 0;
  std::vector<SentByte> sent_;
  std::uint64_t overruns_ = 0;
  std::uint64_t unheard_ = 0;
  std::uint64_t overwritten_ = 0;
  std::uint64_t received_ = 0;
};

}  // namespace tagwrench::emulator

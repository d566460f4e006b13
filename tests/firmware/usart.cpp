#include "tests/firmware/usart.h"

#include <cmath>

#include "tests/firmware/avr_registers.h"

namespace tagwrench::emulator {

namespace {

constexpr std::uint8_t kRxComplete = 0x80, kTxComplete = 0x40, kDataEmpty = 0x20;
constexpr std::uint8_t kFrameError = 0x10, kDataOverrun = 0x08, kDoubleSpeed = 0x02;
constexpr std::uint8_t kRxEnable = 0x10, kTxEnable = 0x08;
constexpr double kBits = 10;
/// The receiver samples the middle of the stop bit.
constexpr double kReceivedBits = 9.5;
/// Receiver tolerance at 8 data bits (datasheet, table 19-2, recommended: 1.5 to 2 %).
constexpr double kMaxBaudError = 0.025;

}  // namespace

Usart::Usart(AvrCore& core)
    : core_(core),
      line_timer_(core, [this](Cycle when) { line_event(when); }),
      transmit_timer_(core, [this](Cycle when) { end_transmission(when); }) {
  core.replace_read(reg::kUdr0, [this] { return read_data(); });
  core.replace_write(reg::kUdr0, [this](std::uint8_t value) { write_data(value); });
  core.replace_read(reg::kUcsr0a, [this] {
    std::uint8_t status = core_.data(reg::kUcsr0a) & (kDoubleSpeed | 1 | kFrameError);
    if (!fifo_.empty()) status |= kRxComplete;
    if (transmit_complete_) status |= kTxComplete;
    if (!transmit_data_) status |= kDataEmpty;
    if (data_overrun_) status |= kDataOverrun;
    return status;
  });
  core.replace_write(reg::kUcsr0a, [this](std::uint8_t value) {
    if ((value & kTxComplete) != 0) {
      transmit_complete_ = false;
      core_.clear(reg::kUsartTx);
    }
    const std::uint8_t kept = core_.data(reg::kUcsr0a) & ~(kDoubleSpeed | 1);
    core_.data(reg::kUcsr0a) = static_cast<std::uint8_t>(kept | (value & (kDoubleSpeed | 1)));
  });
  core.replace_write(reg::kUcsr0b, [this](std::uint8_t value) {
    core_.data(reg::kUcsr0b) = value;
    if ((value & kRxEnable) == 0) {
      fifo_.clear();
      shift_.reset();
      data_overrun_ = false;
    }
    update_levels();
  });
  for (const std::uint16_t address : {reg::kUbrr0l, reg::kUbrr0h, reg::kUcsr0c}) {
    core.replace_write(address,
                       [this, address](std::uint8_t value) { core_.data(address) = value; });
  }
  core.after_handler(reg::kUsartRx, [this] { update_levels(); });
  core.after_handler(reg::kUsartDataEmpty, [this] { update_levels(); });
  core.after_reset([this] { reset(); });
}

void Usart::reset() {
  fifo_.clear();
  shift_.reset();
  transmit_data_.reset();
  transmitting_ = transmit_complete_ = data_overrun_ = false;
  transmit_timer_.cancel();
  core_.data(reg::kUcsr0a) = kDataEmpty;
  core_.data(reg::kUcsr0b) = 0;
  core_.data(reg::kUcsr0c) = 0x06;
}

Cycle Usart::bit_cycles() {
  const Cycle divider = (core_.word(reg::kUbrr0l) & 0xFFFU) + 1;
  return divider * ((core_.data(reg::kUcsr0a) & kDoubleSpeed) != 0 ? 8 : 16);
}

Cycle Usart::frame_cycles() {
  const std::uint8_t format = core_.data(reg::kUcsr0c);
  const Cycle bits = 10 + ((format & 0x30) != 0 ? 1U : 0U) + ((format & 0x08) != 0 ? 1U : 0U);
  return bits * bit_cycles();
}

// ---- From the host ----

void Usart::send(const std::uint8_t* bytes, std::size_t count, VirtualTime earliest) {
  const VirtualTime frame(std::llround(kBits * 1e9 / baud_));
  for (std::size_t i = 0; i < count; ++i) {
    const VirtualTime begin = std::max(earliest, line_free_);
    line_.push_back({bytes[i], begin});
    line_free_ = begin + frame;
  }
  next_line_byte();
}

void Usart::next_line_byte() {
  if (!line_.empty() && !line_timer_.pending()) line_timer_.at(core_.cycle_at(line_.front().begin));
}

void Usart::line_event(Cycle) {
  const LineByte byte = line_.front();
  if (!in_byte_) {
    in_byte_ = true;
    if (shift_) {  // a start bit while nothing is free: what waits in the shift register is gone
      shift_.reset();
      data_overrun_ = true;
      ++overruns_;
    }
    const VirtualTime received(std::llround(kReceivedBits * 1e9 / baud_));
    line_timer_.at(core_.cycle_at(byte.begin + received));
    return;
  }
  in_byte_ = false;
  arrive();
  line_.pop_front();
  next_line_byte();
}

void Usart::arrive() {
  std::uint8_t value = line_.front().value;
  if ((core_.data(reg::kUcsr0b) & kRxEnable) == 0) {
    ++unheard_;
    return;
  }
  const double board_baud = kNominalHz / static_cast<double>(bit_cycles());
  std::uint8_t& status = core_.data(reg::kUcsr0a);
  status = static_cast<std::uint8_t>(status & ~kFrameError);
  if (std::abs(board_baud / baud_ - 1) > kMaxBaudError) {  // what is heard has little to do with it
    value = static_cast<std::uint8_t>(value * 37 + 11);
    status |= kFrameError;
  }
  ++received_;
  if (fifo_.size() < 2) {
    fifo_.push_back(value);
  } else {
    shift_ = value;
  }
  update_levels();
}

std::uint8_t Usart::read_data() {
  core_.clear(reg::kUsartRx);
  if (fifo_.empty()) return 0;
  const std::uint8_t value = fifo_.front();
  fifo_.pop_front();
  data_overrun_ = false;
  if (shift_) {
    fifo_.push_back(*shift_);
    shift_.reset();
  }
  update_levels();
  return value;
}

// ---- To the host ----

void Usart::write_data(std::uint8_t value) {
  if ((core_.data(reg::kUcsr0b) & kTxEnable) == 0) return;
  if (!transmitting_) {
    // The transmitter's clock runs on; a start bit waits for its next tick.
    const Cycle bit = bit_cycles();
    begin_transmission(value, (core_.cycle() + bit - 1) / bit * bit);
    update_levels();
    return;
  }
  if (transmit_data_) ++overwritten_;
  transmit_data_ = value;
  core_.clear(reg::kUsartDataEmpty);
}

void Usart::begin_transmission(std::uint8_t value, Cycle when) {
  transmitting_ = true;
  transmit_complete_ = false;
  shift_out_ = value;
  shift_begin_ = when;
  transmit_timer_.at(when + frame_cycles());
}

void Usart::end_transmission(Cycle when) {
  sent_.push_back({shift_out_, core_.time_of(shift_begin_), core_.time_of(when)});
  transmitting_ = false;
  if (transmit_data_) {
    const std::uint8_t value = *transmit_data_;
    transmit_data_.reset();
    begin_transmission(value, when);
  } else {
    transmit_complete_ = true;
    core_.raise(reg::kUsartTx);
  }
  update_levels();
}

std::vector<SentByte> Usart::take_sent() {
  std::vector<SentByte> taken;
  taken.swap(sent_);
  return taken;
}

/// "Received" and "data register empty" are levels: they interrupt as long as they hold.
void Usart::update_levels() {
  if (!fifo_.empty() && core_.enabled(reg::kUsartRx)) core_.raise(reg::kUsartRx);
  if (!transmit_data_ && core_.enabled(reg::kUsartDataEmpty) &&
      (core_.data(reg::kUcsr0b) & kTxEnable) != 0)
    core_.raise(reg::kUsartDataEmpty);
}

}  // namespace tagwrench::emulator

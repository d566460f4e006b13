// Registers, interrupts, pins and EEPROM of the emulated processor, as the models see them.
#include <avr_eeprom.h>
#include <avr_ioport.h>
#include <sim_avr.h>
#include <sim_interrupts.h>
#include <sim_io.h>

#include "tests/firmware/avr_core.h"
#include "tests/firmware/avr_registers.h"

namespace tagwrench::emulator {

namespace {

constexpr VirtualTime kEepromWrite = std::chrono::microseconds(3400);

std::uint16_t pin_register(char port) {
  return static_cast<std::uint16_t>(reg::kPinB + 3 * (port - 'B'));
}

}  // namespace

struct AvrCore::Hook {
  AvrCore* core;
  std::uint16_t address;
  avr_io_write_t original;
  void* original_parameter;
  Read read;
  std::vector<Write> after;
  Write instead;

  static std::uint8_t on_read(avr_t*, avr_io_addr_t, void* self) {
    auto& hook = *static_cast<Hook*>(self);
    return hook.core->data(hook.address) = hook.read();
  }
  static void on_write(avr_t*, avr_io_addr_t, std::uint8_t value, void* self) {
    auto& hook = *static_cast<Hook*>(self);
    if (hook.instead) {
      hook.instead(value);
    } else {
      hook.write_original(value);
    }
    for (const Write& write : hook.after) write(value);
  }
  void write_original(std::uint8_t value) {
    if (original != nullptr) {
      original(core->avr_, address, value, original_parameter);
    } else {
      core->data(address) = value;
    }
  }
};

std::uint8_t& AvrCore::data(std::uint16_t address) { return avr_->data[address]; }

std::uint16_t AvrCore::word(std::uint16_t address) {
  return static_cast<std::uint16_t>(data(address) | data(static_cast<std::uint16_t>(address + 1))
                                                        << 8);
}

std::uint8_t AvrCore::flash(std::uint32_t address) const { return avr_->flash[address]; }

AvrCore::Hook& AvrCore::hook(std::uint16_t address) {
  auto& slot = hooks_[address];
  if (!slot) {
    auto& io = avr_->io[AVR_DATA_TO_IO(address)];
    slot = std::make_shared<Hook>(Hook{this, address, io.w.c, io.w.param, {}, {}, {}});
    io.w.c = &Hook::on_write;
    io.w.param = slot.get();
  }
  return *slot;
}

void AvrCore::replace_read(std::uint16_t address, Read read) {
  Hook& with = hook(address);
  with.read = std::move(read);
  avr_->io[AVR_DATA_TO_IO(address)].r.c = &Hook::on_read;
  avr_->io[AVR_DATA_TO_IO(address)].r.param = &with;
}

void AvrCore::replace_write(std::uint16_t address, Write write) {
  hook(address).instead = std::move(write);
}

void AvrCore::after_write(std::uint16_t address, Write write) {
  hook(address).after.push_back(std::move(write));
}

void AvrCore::original_write(std::uint16_t address, std::uint8_t value) {
  hook(address).write_original(value);
}

std::uint8_t AvrCore::written_flags(std::uint8_t value) const {
  const bool sbi = flash(avr_->pc + 1) == 0x9A;
  return sbi ? static_cast<std::uint8_t>(1U << (flash(avr_->pc) & 7)) : value;
}

avr_int_vector_t* AvrCore::vector(std::uint8_t number) const { return vectors_.at(number); }

void AvrCore::raise(std::uint8_t number) { avr_raise_interrupt(avr_, vector(number)); }

void AvrCore::clear(std::uint8_t number) {
  avr_int_vector_t* const which = vector(number);
  avr_clear_interrupt(avr_, which);
  if (which->raised.reg != 0) avr_regbit_clear(avr_, which->raised);
}

bool AvrCore::enabled(std::uint8_t number) const {
  return avr_regbit_get(avr_, vector(number)->enable) != 0;
}

bool AvrCore::flag(std::uint8_t number) const {
  return avr_regbit_get(avr_, vector(number)->raised) != 0;
}

void AvrCore::after_handler(std::uint8_t number, std::function<void()> callback) {
  after_handler_[number] = std::move(callback);
}

void AvrCore::after_reset(std::function<void()> callback) {
  callback();
  after_reset_.push_back(std::move(callback));
}

/// simavr forgets the levels of pins, but not what it last told of them: a pull-up that is set
/// again would change nothing.
void AvrCore::forget_pins(char port) {
  const auto i = static_cast<std::size_t>(port - 'B');
  const auto levels = static_cast<std::uint8_t>(levels_[i] & driven_[i]);
  data(pin_register(port)) = levels;
  for (int bit = 0; bit < 8; ++bit)
    avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(port), bit)->value = levels >> bit & 1U;
}

/// simavr stores what is written to PCIFR instead of clearing flags.
void AvrCore::watch_flag_registers() {
  replace_write(reg::kPcifr, [this](std::uint8_t value) {
    const std::uint8_t flags = written_flags(value);
    for (unsigned port = 0; port < 3; ++port) {
      if ((flags >> port & 1) != 0) clear(static_cast<std::uint8_t>(reg::kPcint0 + port));
    }
  });
}

/// simavr finishes a write at once, where silicon is busy for 3.4 ms; and "ready" interrupts as
/// long as it holds.
void AvrCore::watch_eeprom() {
  constexpr std::uint8_t kProgram = 1 << 1;
  constexpr std::uint8_t kMasterProgram = 1 << 2;
  const auto update_level = [this] {
    if (!eeprom_busy_ && enabled(reg::kEepromReady)) raise(reg::kEepromReady);
  };
  eeprom_timer_ = std::make_unique<CycleTimer>(*this, [this, update_level](Cycle) {
    eeprom_busy_ = false;
    data(reg::kEecr) = static_cast<std::uint8_t>(data(reg::kEecr) & ~kProgram);
    update_level();
  });
  after_handler_[reg::kEepromReady] = update_level;
  replace_write(reg::kEecr, [this, update_level](std::uint8_t value) {
    const bool armed = (data(reg::kEecr) & kMasterProgram) != 0;
    if (eeprom_busy_) value = static_cast<std::uint8_t>(value & ~kProgram);
    original_write(reg::kEecr, value);
    if (armed && (value & kProgram) != 0) {
      eeprom_busy_ = true;
      clear(reg::kEepromReady);
      eeprom_timer_->at(cycle() + cycles_of(kEepromWrite));
    }
    if (eeprom_busy_) data(reg::kEecr) = static_cast<std::uint8_t>(data(reg::kEecr) | kProgram);
    update_level();
  });
}

void AvrCore::set_external(char port) {
  const auto i = static_cast<std::size_t>(port - 'B');
  avr_ioport_external_t external{};
  external.name = port;
  external.mask = driven_[i];
  external.value = static_cast<std::uint8_t>(levels_[i] & driven_[i]);
  avr_ioctl(avr_, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
}

void AvrCore::drive(char port, std::uint8_t bit, bool level) {
  const auto i = static_cast<std::size_t>(port - 'B');
  const auto mask = static_cast<std::uint8_t>(1U << bit);
  driven_[i] = static_cast<std::uint8_t>(driven_[i] | mask);
  levels_[i] = static_cast<std::uint8_t>(level ? levels_[i] | mask : levels_[i] & ~mask);
  set_external(port);
  avr_raise_irq(avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(port), bit), level ? 1 : 0);
}

void AvrCore::release(char port, std::uint8_t bit) {
  const auto i = static_cast<std::size_t>(port - 'B');
  const auto mask = static_cast<std::uint8_t>(1U << bit);
  driven_[i] = static_cast<std::uint8_t>(driven_[i] & ~mask);
  set_external(port);
  const std::uint16_t pin = pin_register(port);
  const bool pulled_up = (data(static_cast<std::uint16_t>(pin + 2)) & mask) != 0 &&
                         (data(static_cast<std::uint16_t>(pin + 1)) & mask) == 0;
  avr_raise_irq(avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(port), bit), pulled_up ? 1 : 0);
}

std::vector<std::uint8_t> AvrCore::eeprom() const {
  std::vector<std::uint8_t> bytes(avr_->e2end + 1);
  avr_eeprom_desc_t all{bytes.data(), 0, static_cast<std::uint32_t>(bytes.size())};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &all);
  return bytes;
}

void AvrCore::set_eeprom(std::uint16_t offset, const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> copy = bytes;
  avr_eeprom_desc_t part{copy.data(), offset, static_cast<std::uint32_t>(copy.size())};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &part);
}

}  // namespace tagwrench::emulator

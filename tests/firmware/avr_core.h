// The processor of the emulated board: libsimavr's ATmega328P running the flashable image, with
// virtual time, timers that survive a reset, and access to registers for the models of the
// peripherals. Where simavr's own peripherals differ from silicon (serial port, timer 1, ADC, flag
// registers) the models here replace them.
//
// libsimavr is GPLv3. Tests alone use it; nothing of the product links or ships it.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct avr_t;
struct avr_int_vector_t;

namespace tagwrench::emulator {

/// True time since the board was powered. The board's own crystal may deviate from it.
using VirtualTime = std::chrono::nanoseconds;
using Cycle = std::uint64_t;

constexpr double kNominalHz = 16e6;

class AvrCore;

/// Calls back at a cycle; at most one call is due. It survives a reset of the processor.
class CycleTimer {
 public:
  CycleTimer(AvrCore& core, std::function<void(Cycle)> callback);
  CycleTimer(const CycleTimer&) = delete;
  CycleTimer& operator=(const CycleTimer&) = delete;
  ~CycleTimer();

  void at(Cycle due);
  void cancel();
  bool pending() const { return due_.has_value(); }

 private:
  friend class AvrCore;
  static std::uint64_t fire(avr_t*, std::uint64_t when, void* self);
  void arm();

  AvrCore& core_;
  std::function<void(Cycle)> callback_;
  std::optional<Cycle> due_;
};

/// Cycles that something took.
struct CycleCount {
  std::uint64_t calls = 0;
  std::uint64_t total = 0;
  std::uint64_t worst = 0;

  void add(std::uint64_t cycles) {
    ++calls;
    total += cycles;
    worst = std::max(worst, cycles);
  }
  double mean() const {
    return calls == 0 ? 0 : static_cast<double>(total) / static_cast<double>(calls);
  }
};

/// What the processor was seen to do; a reset does not clear it.
struct CoreFigures {
  std::uint16_t lowest_stack = 0xFFFF;    ///< data address
  CycleCount loop;                        ///< between two watchdog resets (instruction WDR)
  std::array<CycleCount, 26> latency{};   ///< by vector: flag raised to vector entered
  std::array<CycleCount, 26> duration{};  ///< by vector: entry to RETI
  std::uint64_t interrupt_cycles = 0;
};

class AvrCore {
 public:
  /// Throws std::runtime_error if the image cannot be read. The crystal is fast by `clock_ppm`.
  AvrCore(const std::filesystem::path& elf, double clock_ppm);
  AvrCore(const AvrCore&) = delete;
  AvrCore& operator=(const AvrCore&) = delete;
  ~AvrCore();

  Cycle cycle() const;
  VirtualTime now() const { return time_of(cycle()); }
  VirtualTime time_of(Cycle cycle) const;
  Cycle cycle_at(VirtualTime time) const;
  Cycle cycles_of(VirtualTime duration) const { return cycle_at(duration); }

  /// Throws std::runtime_error if the program crashed or used what no model covers.
  void run_until(VirtualTime time);
  /// Looks at the stack and at calls after every instruction, at half the speed; off, the stack is
  /// looked at when interrupts begin.
  void watch_every_instruction(bool on);

  /// As if the reset pin was pulled (bit 1 of MCUSR) or power came (bit 0).
  void reset(std::uint8_t mcusr);
  /// Sets the program counter to an endless loop; interrupts go on if they were on.
  void hang(bool interrupts_off);
  bool hanging() const;

  // Registers, for models.
  std::uint8_t& data(std::uint16_t address);
  std::uint16_t word(std::uint16_t address);
  std::uint8_t flash(std::uint32_t address) const;
  using Read = std::function<std::uint8_t()>;
  using Write = std::function<void(std::uint8_t)>;
  void replace_read(std::uint16_t address, Read read);
  void replace_write(std::uint16_t address, Write write);
  /// After simavr's own handling.
  void after_write(std::uint16_t address, Write write);
  /// simavr's own handling of a write that was replaced.
  void original_write(std::uint16_t address, std::uint8_t value);
  /// A value written to a register whose ones clear flags: after SBI, its bit alone (datasheet,
  /// section 14.2.2), where simavr writes the whole register back.
  std::uint8_t written_flags(std::uint8_t value) const;

  // Interrupts, for models.
  void raise(std::uint8_t vector);
  void clear(std::uint8_t vector);
  bool enabled(std::uint8_t vector) const;
  bool flag(std::uint8_t vector) const;
  /// Called when the vector's handler returns; for flags that stand for a level.
  void after_handler(std::uint8_t vector, std::function<void()> callback);
  /// Called after each reset, first of all for power-on.
  void after_reset(std::function<void()> callback);

  /// Drives an input pin, 'B' to 'D', or leaves it to its pull-up.
  void drive(char port, std::uint8_t bit, bool level);
  void release(char port, std::uint8_t bit);

  std::vector<std::uint8_t> eeprom() const;
  void set_eeprom(std::uint16_t offset, const std::vector<std::uint8_t>& bytes);
  bool eeprom_busy() const { return eeprom_busy_; }

  /// Address of a symbol as the linker has it: those of data begin at 0x800100.
  std::optional<std::uint32_t> symbol(const std::string& name) const;
  const std::map<std::string, std::uint32_t>& symbols() const { return symbols_; }
  /// Counts the cycles of the functions whose mangled name contains `part` from now on, interrupts
  /// subtracted; false if there is none (it may have been inlined).
  bool count_calls(const std::string& part);
  const std::map<std::string, CycleCount>& calls() const { return call_counts_; }

  struct Sizes {
    std::uint32_t flash_bytes = 0;   ///< code and initial data
    std::uint32_t static_bytes = 0;  ///< initialised and zeroed data
    std::uint16_t ram_end = 0;       ///< last data address
  };
  const Sizes& sizes() const { return sizes_; }
  const CoreFigures& figures() const { return figures_; }
  void clear_figures() { figures_ = CoreFigures(); }
  unsigned resets() const { return resets_; }

  /// Reported by the next run_until(); models call it where an exception would cross C code.
  void fail(std::string reason);
  avr_t* avr() const { return avr_; }

 private:
  friend class CycleTimer;
  struct Hook;
  struct Spy;
  struct VectorWatch;
  struct Call {
    std::string* name;
    std::uint16_t stack;
    Cycle begin;
    std::uint64_t interrupts_before;
  };

  void load(const std::filesystem::path& elf);
  Hook& hook(std::uint16_t address);
  void watch_vectors();
  void watch_flag_registers();
  void watch_eeprom();
  void finish_reset();
  void step();
  void note_stack(std::uint32_t pc);
  void set_batch();
  void note_call(std::uint32_t pc);
  void set_external(char port);
  void forget_pins(char port);
  avr_int_vector_t* vector(std::uint8_t number) const;

  avr_t* avr_ = nullptr;
  double hz_;
  std::vector<CycleTimer*> timers_;
  std::map<std::uint16_t, std::shared_ptr<Hook>> hooks_;
  std::unique_ptr<Spy> spy_;
  std::deque<VectorWatch> watches_;
  std::array<avr_int_vector_t*, 26> vectors_{};
  std::array<std::function<void()>, 26> after_handler_{};
  std::vector<std::function<void()>> after_reset_;
  std::map<std::string, std::uint32_t> symbols_;
  Sizes sizes_;
  CoreFigures figures_;
  std::string failure_;
  bool reset_seen_ = false;
  unsigned resets_ = 0;
  std::optional<std::uint8_t> next_mcusr_;
  Cycle last_kick_ = 0;
  bool watching_ = false;
  bool stack_torn_ = false;
  std::uint32_t hang_at_ = 0;
  std::array<std::uint8_t, 3> driven_{};
  std::array<std::uint8_t, 3> levels_{};
  std::unique_ptr<CycleTimer> stop_;
  std::unique_ptr<CycleTimer> eeprom_timer_;
  bool eeprom_busy_ = false;
  std::vector<std::string*> entry_;  ///< by word address: name of a counted function, or null
  std::map<std::string, CycleCount> call_counts_;
  std::deque<std::string> call_names_;
  std::vector<Call> open_calls_;
};

}  // namespace tagwrench::emulator

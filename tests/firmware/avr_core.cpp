#include "tests/firmware/avr_core.h"

#include <avr_extint.h>
#include <avr_watchdog.h>
#include <sim_avr.h>
#include <sim_core.h>
#include <sim_elf.h>
#include <sim_interrupts.h>
#include <sim_io.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "tests/firmware/avr_registers.h"

namespace tagwrench::emulator {

namespace {

constexpr std::uint32_t kDataOffset = 0x800000;
constexpr std::uint32_t kEepromOffset = 0x810000;
/// Vector entry takes four cycles (datasheet, section 7.7.1); simavr counts none.
constexpr unsigned kEntryCycles = 4;

void log_errors(avr_t*, int level, const char* format, va_list arguments) {
  if (level == LOG_ERROR) std::vfprintf(stderr, format, arguments);
}

}  // namespace

// ---- CycleTimer ----

CycleTimer::CycleTimer(AvrCore& core, std::function<void(Cycle)> callback)
    : core_(core), callback_(std::move(callback)) {
  core_.timers_.push_back(this);
}

CycleTimer::~CycleTimer() {
  cancel();
  std::erase(core_.timers_, this);
}

void CycleTimer::at(Cycle due) {
  due_ = due;
  arm();
}

void CycleTimer::cancel() {
  if (due_ && core_.avr_ != nullptr) avr_cycle_timer_cancel(core_.avr_, &fire, this);
  due_.reset();
}

void CycleTimer::arm() {
  const Cycle now = core_.cycle();
  avr_cycle_timer_register(core_.avr_, *due_ > now ? *due_ - now : 0, &fire, this);
}

std::uint64_t CycleTimer::fire(avr_t*, std::uint64_t, void* self) {
  auto& timer = *static_cast<CycleTimer*>(self);
  const Cycle due = *timer.due_;
  timer.due_.reset();
  timer.callback_(due);
  return 0;
}

// ---- What is watched ----

/// First of simavr's modules: it is told of each WDR instruction and each reset.
struct AvrCore::Spy {
  avr_io_t io{};  // first member: simavr knows this alone
  AvrCore* core = nullptr;
  avr_io_t* watchdog = nullptr;

  static int on_ioctl(avr_io_t* io, std::uint32_t request, void* parameter) {
    if (request != AVR_IOCTL_WATCHDOG_RESET) return -1;  // the next module may have it
    const Spy& spy = *reinterpret_cast<Spy*>(io);
    AvrCore& core = *spy.core;
    if (core.last_kick_ != 0) core.figures_.loop.add(core.cycle() - core.last_kick_);
    core.last_kick_ = core.cycle();
    // Directly: asking each module in turn would take much of the emulator's time.
    return spy.watchdog->ioctl(spy.watchdog, request, parameter);
  }
  static void on_reset(avr_io_t* io) { reinterpret_cast<Spy*>(io)->core->reset_seen_ = true; }
};

struct AvrCore::VectorWatch {
  AvrCore* core;
  avr_int_vector_t* vector;
  Cycle raised = 0;
  bool waiting = false;
  Cycle entered = 0;

  static void on_pending(avr_irq_t*, std::uint32_t value, void* self) {
    auto& watch = *static_cast<VectorWatch*>(self);
    if (value == 0) return;
    watch.waiting = avr_regbit_get(watch.core->avr_, watch.vector->enable) != 0;
    watch.raised = watch.core->cycle();
  }
  static void on_running(avr_irq_t*, std::uint32_t value, void* self) {
    auto& watch = *static_cast<VectorWatch*>(self);
    AvrCore& core = *watch.core;
    const std::uint8_t number = watch.vector->vector;
    if (value != 0) {
      core.avr_->cycle += kEntryCycles;
      watch.entered = core.cycle();
      core.figures_.lowest_stack = std::min(core.figures_.lowest_stack, core.word(reg::kSpl));
      if (watch.waiting) core.figures_.latency[number].add(watch.entered - watch.raised);
      watch.waiting = false;
    } else {
      core.figures_.duration[number].add(core.cycle() - watch.entered);
      core.figures_.interrupt_cycles += core.cycle() - watch.entered + kEntryCycles;
      if (core.after_handler_[number]) core.after_handler_[number]();
    }
  }
};

// ---- AvrCore ----

AvrCore::AvrCore(const std::filesystem::path& elf, double clock_ppm)
    : hz_(kNominalHz * (1 + clock_ppm * 1e-6)) {
  avr_global_logger_set(&log_errors);
  avr_ = avr_make_mcu_by_name("atmega328p");
  if (avr_ == nullptr) throw std::runtime_error("libsimavr does not know the atmega328p");
  avr_init(avr_);
  avr_->frequency = static_cast<std::uint32_t>(kNominalHz);
  avr_->vcc = avr_->avcc = avr_->aref = 5000;
  avr_->sleep = [](avr_t*, avr_cycle_count_t) {};
  try {
    load(elf);
  } catch (...) {
    avr_terminate(avr_);
    std::free(avr_);
    throw;
  }
  spy_ = std::make_unique<Spy>();
  spy_->core = this;
  spy_->io.kind = "spy";
  for (avr_io_t* io = avr_->io_port; io != nullptr; io = io->next) {
    if (std::string_view(io->kind) == "watchdog") spy_->watchdog = io;
  }
  spy_->io.ioctl = &Spy::on_ioctl;
  spy_->io.reset = &Spy::on_reset;
  avr_register_io(avr_, &spy_->io);
  watch_vectors();
  watch_flag_registers();
  watch_eeprom();
  stop_ = std::make_unique<CycleTimer>(*this, [](Cycle) {});
  reset(1);
}

AvrCore::~AvrCore() {
  stop_.reset();
  eeprom_timer_.reset();
  avr_terminate(avr_);
  std::free(avr_);
  avr_ = nullptr;
}

void AvrCore::load(const std::filesystem::path& elf) {
  elf_firmware_t image{};
  if (!std::filesystem::is_regular_file(elf) || elf_read_firmware(elf.c_str(), &image) != 0)
    throw std::runtime_error(elf.string() + ": cannot be read");
  if (image.flashsize == 0 || image.flashsize > avr_->flashend + 1)
    throw std::runtime_error(elf.string() + ": not an image of an ATmega328P");
  avr_load_firmware(avr_, &image);
  avr_->frequency = static_cast<std::uint32_t>(kNominalHz);
  sizes_.flash_bytes = image.flashsize;
  sizes_.ram_end = static_cast<std::uint16_t>(avr_->ramend);
  for (std::uint32_t i = 0; i < image.symbolcount; ++i) {
    const std::uint32_t address = image.symbol[i]->addr;
    if (address < kEepromOffset) symbols_.emplace(image.symbol[i]->symbol, address);
    std::free(image.symbol[i]);
  }
  std::free(image.symbol);
  std::free(image.flash);
  std::free(image.eeprom);
  std::free(image.fuse);
  if (const auto end = symbol("_end")) sizes_.static_bytes = *end - kDataOffset - reg::kRamBegin;
  entry_.assign((avr_->flashend + 1) / 2, nullptr);
  for (std::uint32_t at = 0; at + 1 < image.flashsize && hang_at_ == 0; at += 2) {
    if (flash(at) == 0xFF && flash(at + 1) == 0xCF) hang_at_ = at;  // rjmp .-2
  }
}

Cycle AvrCore::cycle() const { return avr_->cycle; }

VirtualTime AvrCore::time_of(Cycle cycle) const {
  return VirtualTime(std::llround(static_cast<double>(cycle) * (1e9 / hz_)));
}

Cycle AvrCore::cycle_at(VirtualTime time) const {
  const double cycles = std::ceil(static_cast<double>(time.count()) * (hz_ * 1e-9) - 1e-3);
  return cycles > 0 ? static_cast<Cycle>(cycles) : 0;
}

void AvrCore::run_until(VirtualTime time) {
  const Cycle end = cycle_at(time);
  stop_->at(end);  // a sleeping processor wakes there
  while (avr_->cycle < end) step();
  stop_->cancel();
}

void AvrCore::watch_every_instruction(bool on) {
  watching_ = on;
  set_batch();
}

/// How many cycles simavr may run on without coming back between two timers.
void AvrCore::set_batch() { avr_->run_cycle_limit = watching_ ? 1 : 1000000; }

void AvrCore::step() {
  const std::uint32_t pc = avr_->pc;
  if (watching_ && entry_[pc >> 1] != nullptr) note_call(pc);
  const int state = avr_run(avr_);
  if (reset_seen_) finish_reset();
  if (watching_) note_stack(pc);
  if (state == cpu_Crashed || state == cpu_Done || state == cpu_Stopped)
    fail("the program crashed, or sleeps for ever");
  if (!failure_.empty()) throw std::runtime_error("emulated board: " + failure_);
}

void AvrCore::note_stack(std::uint32_t pc) {
  const std::uint16_t stack = word(reg::kSpl);
  while (!open_calls_.empty() && stack > open_calls_.back().stack) {
    const Call& call = open_calls_.back();
    call_counts_[*call.name].add(cycle() - call.begin -
                                 (figures_.interrupt_cycles - call.interrupts_before));
    open_calls_.pop_back();
  }
  if (stack >= figures_.lowest_stack) return;
  // Between OUT SPH and OUT SPL the pointer is half old, half new.
  const unsigned opcode = flash(pc) | flash(pc + 1) << 8;
  if ((opcode & 0xFE0F) == 0xBE0E) stack_torn_ = true;
  if ((opcode & 0xFE0F) == 0xBE0D) stack_torn_ = false;
  if (!stack_torn_ && stack >= reg::kRamBegin) figures_.lowest_stack = stack;
}

void AvrCore::note_call(std::uint32_t pc) {
  const std::uint16_t stack = word(reg::kSpl);
  if (!open_calls_.empty() && open_calls_.back().stack == stack) return;
  open_calls_.push_back({entry_[pc >> 1], stack, cycle(), figures_.interrupt_cycles});
}

bool AvrCore::count_calls(const std::string& part) {
  call_names_.push_back(part);
  bool found = false;
  for (const auto& [name, address] : symbols_) {
    if (name.find(part) == std::string::npos || address >= sizes_.flash_bytes) continue;
    entry_[address / 2] = &call_names_.back();
    found = true;
  }
  return found;
}

void AvrCore::reset(std::uint8_t mcusr) {
  next_mcusr_ = mcusr;
  avr_reset(avr_);
  finish_reset();
}

void AvrCore::finish_reset() {
  reset_seen_ = false;
  ++resets_;
  last_kick_ = 0;
  set_batch();
  stack_torn_ = false;
  open_calls_.clear();
  if (next_mcusr_) {
    data(reg::kMcusr) = *next_mcusr_;
    next_mcusr_.reset();
  }
  // It would look at INT0 and INT1 every cycle, which nobody uses.
  for (const std::uint8_t number : {0, 1}) avr_extint_set_strict_lvl_trig(avr_, number, 0);
  for (VectorWatch& watch : watches_) watch.waiting = false;
  for (CycleTimer* timer : timers_) {
    if (timer->due_) timer->arm();
  }
  for (char port = 'B'; port <= 'D'; ++port) forget_pins(port);
  for (const auto& callback : after_reset_) callback();
}

void AvrCore::hang(bool interrupts_off) {
  if (hang_at_ == 0) throw std::runtime_error("emulated board: no endless loop in the image");
  // In the main program, or the handler that is left would never end.
  while (avr_->interrupts.running_ptr != 0 || avr_->sreg[S_I] == 0) step();
  avr_->pc = hang_at_;
  if (interrupts_off) avr_sreg_set(avr_, S_I, 0);
}

bool AvrCore::hanging() const { return avr_->pc == hang_at_; }

void AvrCore::watch_vectors() {
  for (unsigned i = 0; i < avr_->interrupts.vector_count; ++i) {
    avr_int_vector_t* const which = avr_->interrupts.vector[i];
    if (which->vector >= reg::kVectors) continue;
    vectors_[which->vector] = which;
    watches_.push_back({this, which});
    avr_irq_register_notify(which->irq + AVR_INT_IRQ_PENDING, &VectorWatch::on_pending,
                            &watches_.back());
    avr_irq_register_notify(which->irq + AVR_INT_IRQ_RUNNING, &VectorWatch::on_running,
                            &watches_.back());
  }
}

std::optional<std::uint32_t> AvrCore::symbol(const std::string& name) const {
  const auto found = symbols_.find(name);
  if (found == symbols_.end()) return std::nullopt;
  return found->second;
}

void AvrCore::fail(std::string reason) {
  if (failure_.empty()) failure_ = std::move(reason);
}

}  // namespace tagwrench::emulator

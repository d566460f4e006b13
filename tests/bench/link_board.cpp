#include "tests/bench/link_board.h"

#include <fmt/format.h>

#include "tests/firmware/clock_run.h"
#include "tests/firmware/full_load.h"

namespace tagwrench::bench {
namespace {

using emulator::FullLoadFigures;
using emulator::StampError;

void stamp(Table& table, const std::string& what, const StampError& error, double limit_us) {
  table.line(fmt::format("{}: rms {:.2f} us, worst {:.2f} us, bias {:+.2f} us, {} samples", what,
                         error.rms_us, error.worst_us, error.bias_us, error.samples));
  table.at_most("  rms, " + what, error.rms_us, limit_us, "us");
}

/// Where the optimiser leaves a function of its own: part of its mangled name, and what it does.
constexpr std::pair<const char*, const char*> kOperations[] = {
    {"4Link4sendINS_4link10CellSample", "a load-cell sample: encode, CRC, COBS, queue"},
    {"4Link4sendINS_4link9AdcSample", "an ADC sample: the same"},
    {"4Link4post", "of that, CRC, COBS and queue"},
    {"4Link11answer_time", "a time request: answer"},
    {"3App11send_status", "a status: the same"},
    {"9LoadCells4take", "a conversion: judge, count, tare"},
};

emulator::FullLoadOptions with_operations(double seconds) {
  emulator::FullLoadOptions options;
  options.seconds = seconds;
  options.clock_ppm = 40;
  for (const auto& [function, what] : kOperations) options.functions.emplace_back(function);
  return options;
}

void bench_burst(Table& table) {
  emulator::FullLoadOptions options;
  options.seconds = 20;
  options.strobe_period_us = 2000;
  options.burst = 4;
  const FullLoadFigures f = emulator::run_full_load(TAGWRENCH_FIRMWARE_ELF, options);
  table.open("the same, with a strobe of 500 Hz and bursts of 4 requests every 100 ms", {});
  table.at_most("bytes that the receiver lost", static_cast<double>(f.receiver_overruns), 0, "");
  table.at_most("worst latency of the receiver's interrupt", f.worst_receive_latency_us, 40, "us");
  table.line(fmt::format("main loop: longest {:.2f} ms", f.longest_loop_us * 1e-3));
}

void bench_clock(Table& table) {
  table.open("sample times on the host's clock, lockstep with the image",
             {"a conversion's host time against the truth; 40 s, skew -40 ppm, ten exchanges/s"});
  for (const auto& [name, jitter_us] :
       {std::pair{"no jitter", 0.0}, std::pair{"0.125 ms of jitter either way", 125.0},
        std::pair{"1 ms of jitter either way", 1000.0}}) {
    emulator::ClockRunOptions options;
    options.to_board.jitter_us = options.to_host.jitter_us = jitter_us;
    const emulator::ClockRunFigures f = emulator::run_clock(TAGWRENCH_FIRMWARE_ELF, options);
    table.line(
        fmt::format("{}: worst {:.0f} us, stated +-{:.0f} us, {:.1f} % within 3 of it; "
                    "converged after {:.1f} s",
                    name, f.worst_us, f.sigma_us, 100 * f.within_3_sigma, f.converged_after_s));
    table.at_most(std::string("  rms, ") + name, f.rms_us, 50, "us");
    table.at_most(std::string("  error over stated sigma, ") + name, f.normalised_rms, 1.2, "");
  }
}

}  // namespace

void bench_emulated_board(Table& table) {
  constexpr double kSeconds = 20;
  const FullLoadFigures f =
      emulator::run_full_load(TAGWRENCH_FIRMWARE_ELF, with_operations(kSeconds));
  table.open("firmware on the emulated ATmega328P, full load",
             {fmt::format("{:.0f} s of 4 cells at 80/s, 2 ADC channels at 100 Hz, 50 time "
                          "exchanges/s; emulated at {:.1f} times real time",
                          f.seconds, f.seconds / f.wall_seconds)});
  table.at_most("flash", f.flash_bytes, 27.0 * 1024, "bytes");
  table.at_most(
      fmt::format("RAM: static {}, deepest stack {}", f.static_ram_bytes, f.stack_used_bytes),
      f.static_ram_bytes + f.stack_used_bytes, 2048.0 / 2, "bytes");
  table.line(fmt::format("{:.0f} bytes/s to the host, {} frames", f.bytes_per_second, f.frames));
  const auto lost =
      static_cast<double>(f.cell_lost + f.adc_lost + f.sequence_gaps + f.damaged_frames +
                          f.receiver_overruns + (f.time_requests - f.time_replies));
  table.at_most(fmt::format("lost of {} conversions, {} ADC samples, {} time replies",
                            f.cell_conversions, f.adc_samples, f.time_replies),
                lost, 0, "");
  stamp(table, "time stamp of a conversion", f.cell_stamp, 50);
  stamp(table, "time stamp of an ADC sample", f.adc_stamp, 50);
  stamp(table, "time request's arrival", f.time_received, 50);
  stamp(table, "time reply's departure", f.time_sent, 50);
  table.at_most("worst latency of the receiver's interrupt", f.worst_receive_latency_us, 40, "us");
  table.line(
      fmt::format("worst latency of any interrupt {:.1f} us, longest handler {:.1f} us, "
                  "interrupts take {:.1f} % of the time",
                  f.worst_latency_us, f.longest_handler_us, 100 * f.interrupt_load));
  table.line(
      fmt::format("main loop: longest {:.2f} ms, mean {:.3f} ms; a cell's read-out {:.0f} us",
                  f.longest_loop_us * 1e-3, f.mean_loop_us * 1e-3, f.cell_read_worst_us));
  for (const auto& [function, what] : kOperations) {
    for (const auto& [name, cycles] : f.calls) {
      if (name.find(function) == std::string::npos || cycles.calls == 0) continue;
      table.line(fmt::format("{:<46}{:>6.0f} cycles, {:>6.1f} us; worst {:>6.1f} us", what,
                             cycles.mean(), cycles.mean() / 16,
                             static_cast<double>(cycles.worst) / 16));
    }
  }
  bench_burst(table);
  bench_clock(table);
}

}  // namespace tagwrench::bench

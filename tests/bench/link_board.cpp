#include "tests/bench/link_board.h"

#include <fmt/format.h>

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

}  // namespace

void bench_emulated_board(Table& table) {
  constexpr double kSeconds = 20;
  const FullLoadFigures f = emulator::run_full_load(
      TAGWRENCH_FIRMWARE_ELF,
      {kSeconds, 40, {"encode", "write_frame", "decode", "FrameReader", "poll", "take"}});
  table.open("firmware on the emulated ATmega328P, full load",
             {fmt::format("{:.0f} s of 4 cells at 80/s, 2 ADC channels at 100 Hz, 50 time "
                          "exchanges/s; emulated at {:.1f} times real time",
                          f.seconds, f.seconds / f.wall_seconds)});
  table.at_most("flash", f.flash_bytes, 32768.0 / 2, "bytes");
  table.at_most("RAM, static", f.static_ram_bytes, 2048.0 / 2, "bytes");
  table.line(fmt::format("stack at its deepest {} bytes, never touched {}", f.stack_used_bytes,
                         f.stack_free_bytes));
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
  for (const auto& [name, cycles] : f.calls) {
    table.line(fmt::format("{:<44} {:>7.1f} us mean, {:>7.1f} us worst, {} calls", name,
                           cycles.mean() / 16, static_cast<double>(cycles.worst) / 16,
                           cycles.calls));
  }
}

}  // namespace tagwrench::bench

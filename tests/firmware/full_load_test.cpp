// The flashable image under its full load: nothing is lost, stamps are true, and it keeps within
// its limits of memory and time.
#include "tests/firmware/full_load.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

namespace tagwrench::emulator {
namespace {

const FullLoadFigures& figures() {
  static const FullLoadFigures kFigures = run_full_load(TAGWRENCH_FIRMWARE_ELF, {12.0, 0, {}});
  return kFigures;
}

void show(const char* what, const StampError& error) {
  fmt::print("  {:<38} rms {:5.2f} us, worst {:5.2f} us, bias {:+5.2f} us ({} samples)\n", what,
             error.rms_us, error.worst_us, error.bias_us, error.samples);
}

TEST(FullLoad, LosesNothing) {
  const FullLoadFigures& f = figures();
  fmt::print("  {:.1f} s: {} frames, {:.0f} bytes/s, {} cell, {} ADC samples, {} time exchanges\n",
             f.seconds, f.frames, f.bytes_per_second, f.cell_samples, f.adc_samples,
             f.time_replies);
  EXPECT_GE(f.seconds, 10.0);
  EXPECT_GT(f.cell_samples, 310 * f.seconds);
  EXPECT_GE(f.adc_samples, 199 * f.seconds);
  EXPECT_EQ(f.cell_lost, 0U);
  EXPECT_EQ(f.cell_wrong, 0U) << "counts that no conversion had";
  EXPECT_EQ(f.adc_lost, 0U);
  EXPECT_EQ(f.adc_wrong, 0U) << "counts that no conversion had";
  EXPECT_EQ(f.time_requests, 600U);
  EXPECT_EQ(f.time_replies, f.time_requests);
  EXPECT_EQ(f.damaged_frames, 0U);
  EXPECT_EQ(f.sequence_gaps, 0U);
  EXPECT_EQ(f.receiver_overruns, 0U) << "bytes that came while two were waiting";
  EXPECT_EQ(f.reported_dropped, 0U);
  EXPECT_EQ(f.reported_overruns, 0U);
}

TEST(FullLoad, StampsAreTrue) {
  const FullLoadFigures& f = figures();
  show("cell: data ready", f.cell_stamp);
  show("ADC: start of conversion", f.adc_stamp);
  show("time request: end of its last byte", f.time_received);
  show("time reply: begin of its first byte", f.time_sent);
  fmt::print("  spacing of ADC samples: {:.2f} us rms\n", f.adc_spacing_rms_us);
  EXPECT_GT(f.cell_stamp.samples, 3000U);
  EXPECT_LT(f.cell_stamp.rms_us, 15);
  EXPECT_LT(f.cell_stamp.worst_us, 50);
  EXPECT_LT(f.adc_stamp.worst_us, 20);
  EXPECT_LT(f.adc_spacing_rms_us, 20);
  EXPECT_LT(f.time_received.worst_us, 50);
  EXPECT_LT(f.time_received.rms_us, 10);
  EXPECT_LT(f.time_sent.worst_us, 25);
  EXPECT_LT(f.time_sent.rms_us, 10);
}

TEST(FullLoad, KeepsWithinItsShareOfTheMemory) {
  const FullLoadFigures& f = figures();
  fmt::print("  flash {} of 32768 bytes, static RAM {} and stack {} of 2048 bytes\n", f.flash_bytes,
             f.static_ram_bytes, f.stack_used_bytes);
  EXPECT_LE(f.flash_bytes, 27U * 1024) << "of the 30 kB that a boot loader leaves";
  EXPECT_LE(f.static_ram_bytes + f.stack_used_bytes, 2048U / 2) << "static data and stack";
  EXPECT_GT(f.stack_used_bytes, 20U);
  EXPECT_GE(f.stack_free_bytes, 256U) << "between the static data and the deepest stack";
}

TEST(FullLoad, AnswersInterruptsInTime) {
  const FullLoadFigures& f = figures();
  fmt::print(
      "  interrupts: latency {:.1f} us, of the receiver {:.1f} us, longest handler {:.1f} us, "
      "{:.1f} % of the time\n",
      f.worst_latency_us, f.worst_receive_latency_us, f.longest_handler_us, 100 * f.interrupt_load);
  fmt::print(
      "  main loop: longest {:.0f} us, mean {:.0f} us; load-cell read-out: mean {:.0f}, worst "
      "{:.0f} us\n",
      f.longest_loop_us, f.mean_loop_us, f.cell_read_mean_us, f.cell_read_worst_us);
  // The receiver holds two bytes, 40 us at 500 kbaud, while the third comes.
  EXPECT_LT(f.worst_receive_latency_us, 40);
  EXPECT_LT(f.worst_latency_us, 60);
  EXPECT_GT(f.worst_latency_us, 1);
  EXPECT_LT(f.longest_loop_us, 10000) << "80 conversions a second leave 12.5 ms";
  EXPECT_GT(f.longest_loop_us, 100);
  EXPECT_NEAR(f.reported_longest_loop_us, f.longest_loop_us, 0.2 * f.longest_loop_us + 3000)
      << "what the board reports of itself";
}

TEST(FullLoad, BearsAFastStrobeAndBurstsOfRequestsToo) {
  FullLoadOptions options;
  options.strobe_period_us = 2000;
  options.burst = 3;
  const FullLoadFigures f = run_full_load(TAGWRENCH_FIRMWARE_ELF, options);
  fmt::print(
      "  interrupts: latency {:.1f} us, of the receiver {:.1f} us, {:.1f} % of the time; longest "
      "loop {:.0f} us; lost: {} conversions, {} ADC samples\n",
      f.worst_latency_us, f.worst_receive_latency_us, 100 * f.interrupt_load, f.longest_loop_us,
      f.cell_lost, f.adc_lost);
  EXPECT_EQ(f.receiver_overruns, 0U);
  EXPECT_EQ(f.reported_overruns, 0U);
  EXPECT_EQ(f.time_replies, f.time_requests);
  EXPECT_EQ(f.burst_requests, 300U);
  EXPECT_EQ(f.burst_answers, f.burst_requests);
  EXPECT_EQ(f.cell_lost + f.cell_wrong + f.adc_lost + f.adc_wrong, 0U);
  EXPECT_EQ(f.sequence_gaps + f.damaged_frames, 0U);
  EXPECT_LT(f.worst_receive_latency_us, 40);
}

}  // namespace
}  // namespace tagwrench::emulator

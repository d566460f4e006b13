// Figures of the flashable image under its full load: four cells at 80/s, two ADC channels at 100
// Hz, fifty time exchanges a second. Virtual time, so that they do not depend on this machine.
#pragma once

#include <map>
#include <string>

#include "tests/firmware/avr_core.h"

namespace tagwrench::emulator {

/// Errors of board time stamps against the truth: stamp minus event.
struct StampError {
  std::size_t samples = 0;
  double bias_us = 0;   ///< mean
  double rms_us = 0;    ///< about the truth, bias included
  double worst_us = 0;  ///< largest magnitude
};

struct FullLoadFigures {
  double seconds = 0;
  double wall_seconds = 0;  ///< that the emulation took

  std::uint32_t flash_bytes = 0;
  std::uint32_t static_ram_bytes = 0;
  unsigned stack_used_bytes = 0;
  unsigned stack_free_bytes = 0;

  std::uint64_t frames = 0;
  double bytes_per_second = 0;
  std::uint64_t damaged_frames = 0;
  std::uint64_t sequence_gaps = 0;
  std::uint64_t cell_conversions = 0;  ///< that the amplifiers made
  std::uint64_t cell_samples = 0;      ///< that arrived
  std::uint64_t cell_lost = 0;
  std::uint64_t cell_wrong = 0;  ///< counts that are not the conversion's
  std::uint64_t adc_samples = 0;
  std::uint64_t adc_lost = 0;
  std::uint64_t adc_wrong = 0;
  std::uint64_t time_requests = 0;
  std::uint64_t time_replies = 0;
  std::uint64_t burst_requests = 0;
  std::uint64_t burst_answers = 0;
  std::uint64_t receiver_overruns = 0;
  std::uint16_t reported_dropped = 0;  ///< Status.dropped_reports
  std::uint16_t reported_overruns = 0;
  std::uint32_t reported_longest_loop_us = 0;
  std::uint16_t reported_stack_free_bytes = 0;

  StampError cell_stamp;
  StampError adc_stamp;
  double adc_spacing_rms_us = 0;  ///< of the conversions' starts, about an even grid
  StampError time_received;       ///< TimeReply.received_us against the stop bit of the request
  StampError time_sent;           ///< previous_sent_us against the start bit of the reply

  double worst_latency_us = 0;  ///< of any interrupt but "data register empty"
  double worst_receive_latency_us = 0;
  double longest_handler_us = 0;
  double longest_loop_us = 0;
  double mean_loop_us = 0;
  double interrupt_load = 0;                ///< part of the time
  std::map<std::string, CycleCount> calls;  ///< cycles of functions, interrupts subtracted
  double cell_read_mean_us = 0;             ///< first to last clock pulse of a read-out
  double cell_read_worst_us = 0;
};

struct FullLoadOptions {
  double seconds = 10;
  double clock_ppm = 0;
  /// Parts of the (mangled) names of functions whose cycles are counted, where the image still has
  /// them.
  std::vector<std::string> functions;
  /// Besides: a strobe of this period (0: none), and every 100 ms so many requests at once.
  std::uint32_t strobe_period_us = 0;
  unsigned burst = 0;
};

/// Throws std::runtime_error if the board does not answer or the image cannot be read.
FullLoadFigures run_full_load(const std::filesystem::path& elf, const FullLoadOptions& options);

}  // namespace tagwrench::emulator

// The link's clock against the flashable image in lockstep: the real BoardSession talks to the
// emulated board over a synthetic path with known delays, so that every host time it states can be
// compared with the truth.
#pragma once

#include <optional>

#include "tests/firmware/emulated_board.h"

namespace tagwrench::emulator {

/// Delays of a path, each way: a fixed one, uniform jitter, and now and then an exponential tail.
struct PathDelays {
  double fixed_us = 60;
  double jitter_us = 125;
  double tail_probability = 0.05;
  double tail_us = 500;
  bool usb_frames = false;  ///< handed over only at multiples of 1 ms, as USB does
};

struct ClockRunOptions {
  PathDelays to_board;
  PathDelays to_host;
  double clock_ppm = -40;  ///< the board's crystal is fast by so much
  double seconds = 40;
  double settled_after_s = 10;       ///< figures count from then on
  std::optional<double> reset_at_s;  ///< the board's button
  std::optional<double> told_asymmetry_us;
  unsigned seed = 1;
};

struct ClockRunFigures {
  std::size_t readings = 0;
  double bias_us = 0;  ///< stated host time minus true time of a conversion
  double rms_us = 0;   ///< about the truth, bias included
  double worst_us = 0;
  double sigma_us = 0;           ///< mean of what was stated
  double normalised_rms = 0;     ///< of error over stated sigma
  double within_3_sigma = 0;     ///< part of the readings
  double worst_ever_sigmas = 0;  ///< from the first reading on, not only when settled
  double skew_ppm = 0;
  double skew_sigma_ppm = 0;
  double converged_after_s = -1;   ///< ClockReport::converged
  double below_50_us_after_s = 0;  ///< last reading before which an error exceeded 50 us
  double first_reading_s = -1;
  unsigned restarts = 0;
  std::uint64_t lost_conversions = 0;
};

/// Throws std::runtime_error if the image cannot be read.
ClockRunFigures run_clock(const std::filesystem::path& elf, const ClockRunOptions& options);

}  // namespace tagwrench::emulator

// Host times of samples, as the link states them, against the truth: symmetric paths, adapters that
// collect bytes, an asymmetry that is told, a board that starts anew.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include "tests/firmware/clock_run.h"

namespace tagwrench::emulator {
namespace {

ClockRunFigures run(const ClockRunOptions& options) {
  const ClockRunFigures f = run_clock(TAGWRENCH_FIRMWARE_ELF, options);
  fmt::print(
      "  {} readings: rms {:.1f} us, worst {:.1f} us, bias {:+.1f} us; stated +-{:.1f} us, error "
      "over sigma {:.2f} rms, {:.1f} % within 3; skew {:+.1f} +- {:.1f} ppm; converged after "
      "{:.2f} s, below 50 us after {:.2f} s\n",
      f.readings, f.rms_us, f.worst_us, f.bias_us, f.sigma_us, f.normalised_rms,
      100 * f.within_3_sigma, f.skew_ppm, f.skew_sigma_ppm, f.converged_after_s,
      f.below_50_us_after_s);
  return f;
}

ClockRunOptions symmetric(double jitter_us, unsigned seed) {
  ClockRunOptions options;
  options.to_board.jitter_us = options.to_host.jitter_us = jitter_us;
  options.seed = seed;
  return options;
}

struct Symmetric : testing::TestWithParam<std::pair<double, unsigned>> {};

TEST_P(Symmetric, TimesAreWithin50UsAndTheStatedUncertaintyCoversThem) {
  const ClockRunFigures f = run(symmetric(GetParam().first, GetParam().second));
  EXPECT_GT(f.readings, 9000U);
  EXPECT_EQ(f.lost_conversions, 0U);
  EXPECT_LT(f.rms_us, 50);
  EXPECT_LT(f.normalised_rms, 1.3);
  EXPECT_GT(f.within_3_sigma, 0.99);
  EXPECT_LT(f.worst_ever_sigmas, 6) << "nor does it claim too much while it settles";
  EXPECT_LT(f.sigma_us, 350) << "what covers anything says nothing";
  EXPECT_NEAR(f.skew_ppm, -40, 4 * f.skew_sigma_ppm);
  EXPECT_LT(f.skew_sigma_ppm, 5);
  EXPECT_GE(f.converged_after_s, 0);
  EXPECT_LT(f.converged_after_s, 5);
}

INSTANTIATE_TEST_SUITE_P(Paths, Symmetric,
                         testing::Values(std::pair{0.0, 1U}, std::pair{125.0, 2U},
                                         std::pair{125.0, 3U}, std::pair{1000.0, 4U},
                                         std::pair{1000.0, 5U}));

TEST(Clock, AnAdapterThatCollectsBytesIsCovered) {
  ClockRunOptions options;
  options.to_host.usb_frames = true;
  options.seed = 6;
  const ClockRunFigures f = run(options);
  EXPECT_GT(f.within_3_sigma, 0.99);
  EXPECT_LT(f.rms_us, 600);
  EXPECT_NEAR(f.skew_ppm, -40, 4 * f.skew_sigma_ppm);
}

TEST(Clock, AnAsymmetryIsCoveredUntoldAndGoneOnceTold) {
  ClockRunOptions options;
  options.to_board.fixed_us = 1060;
  options.seed = 7;
  ClockRunFigures f = run(options);
  EXPECT_NEAR(std::abs(f.bias_us), 500, 60) << "no exchange can show it";
  EXPECT_GT(f.within_3_sigma, 0.99);
  options.told_asymmetry_us = 1000;
  f = run(options);
  EXPECT_LT(f.rms_us, 50);
  EXPECT_LT(f.sigma_us, 60) << "then it is known better";
  EXPECT_GT(f.within_3_sigma, 0.98);
}

TEST(Clock, AResetIsNoticedAndTheClockIsFoundAgain) {
  ClockRunOptions options = symmetric(125, 8);
  options.seconds = 40;
  options.reset_at_s = 20;
  options.settled_after_s = 26;
  const ClockRunFigures f = run(options);
  EXPECT_EQ(f.restarts, 1U);
  EXPECT_GT(f.readings, 4000U);
  EXPECT_LT(f.rms_us, 50);
  EXPECT_LT(f.worst_ever_sigmas, 6) << "no reading takes the new clock for the old one";
}

TEST(Clock, AFastAndAWarmCrystalAreFollowed) {
  for (const double ppm : {-2000.0, 300.0}) {
    ClockRunOptions options = symmetric(125, 9);
    options.clock_ppm = ppm;
    options.seconds = 25;
    const ClockRunFigures f = run(options);
    EXPECT_NEAR(f.skew_ppm, ppm, 4 * f.skew_sigma_ppm + 1);
    EXPECT_LT(f.rms_us, 50);
  }
}

}  // namespace
}  // namespace tagwrench::emulator

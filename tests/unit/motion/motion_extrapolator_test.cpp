// Motion between the frames of a slow camera: nearer to the truth than the newest frame, and never
// beyond it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "host/motion/shaping.h"
#include "tests/unit/motion/pushed.h"

namespace tagwrench {
namespace {

constexpr double kLatency = 0.013;  // s, from a picture to its motion, as measured with a webcam
constexpr double kTick = 0.008;     // s, 125 Hz

/// A hand's push to `size` and back, 0 before and after.
struct Stroke {
  double begin = 0;
  double up = 0;
  double hold = 0;
  double down = 0;
  double size = 0;

  double end() const { return begin + up + hold + down; }
  double at(double t) const {
    return size * (minimum_jerk((t - begin) / up) - minimum_jerk((t - begin - up - hold) / down));
  }
};

std::vector<Stroke> strokes_of(bool taps, int count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto between = [&](double low, double high) { return low + (high - low) * unit(random); };
  std::vector<Stroke> all;
  double t = 0.5;
  for (int i = 0; i < count; ++i) {
    Stroke s = taps ? Stroke{t, between(.03, .08), between(0, .02), between(.03, .09), 0}
                    : Stroke{t, between(.15, .75), between(.2, 1), between(.1, .5), 0};
    s.size = between(0.2, 0.95) * (random() % 2 == 0 ? 1 : -1);
    all.push_back(s);
    t = s.end() + between(0.3, 0.8);
  }
  return all;
}

struct FillScore {
  double rms = 0;              ///< of full scale, at 125 Hz
  double worst_overshoot = 0;  ///< of a stroke's size
  double mean_overshoot = 0;
};

/// What a device reports at 125 Hz of strokes before a camera, against what the same shaping would
/// make of the hand at that very moment, without a filter and noise.
FillScore score_of(const ShapingOptions& options, double noise, double fps,
                   const std::vector<Stroke>& strokes) {
  ShapingOptions straight = options;
  straight.filter.kind = FilterKind::none;
  Shaping shaping(options);
  Shaping truth(straight);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, noise);
  FillScore score;
  double squares = 0;
  int ticks = 0;
  int frames = 0;
  for (const Stroke& stroke : strokes) {
    double peak = 0;
    double true_peak = 0;
    for (; ticks * kTick < stroke.end() + 0.25; ++ticks) {
      const double t = ticks * kTick;
      for (; frames / fps + kLatency <= t; ++frames) {
        Sample s =
            pushed(0, stroke.at(frames / fps) + normal(random), seconds_as_duration(frames / fps));
        shaping.shape(s);
      }
      Sample now = pushed(0, stroke.at(t), seconds_as_duration(t));
      truth.shape(now);
      const double moved = shaping.motion_at(now.capture_time)[0];
      squares += std::pow(moved - now.deflection[0], 2);
      EXPECT_GE(moved * stroke.size, 0) << "never across zero, at " << t << " s";
      peak = std::max(peak, std::abs(moved));
      true_peak = std::max(true_peak, std::abs(now.deflection[0]));
    }
    const double over = std::max(0.0, peak / true_peak - 1);
    score.worst_overshoot = std::max(score.worst_overshoot, over);
    score.mean_overshoot += over / static_cast<double>(strokes.size());
  }
  score.rms = std::sqrt(squares / ticks);
  return score;
}

ShapingOptions bare_shaping(Fill fill) {
  ShapingOptions o = plain_shaping();
  o.dead_zone.setConstant(5e-4);
  o.fill = fill;
  return o;
}

TEST(MotionExtrapolator, PredictionHasLessErrorThanHoldingAndDoesNotOvershoot) {
  struct Case {
    bool taps;
    double fps;
    double most_rms;  ///< of that of holding
    double most_overshoot;
    double most_mean_overshoot;
  };
  for (const Case& c : {Case{false, 25, 0.78, 0.03, 0.001}, Case{false, 30, 0.73, 0.01, 0.001},
                        Case{false, 60, 0.55, 0.01, 0.001}, Case{true, 25, 1.01, 0.05, 0.01},
                        Case{true, 30, 1.01, 0.15, 0.01}, Case{true, 60, 1.0, 0.25, 0.03}}) {
    const std::vector<Stroke> strokes = strokes_of(c.taps, 150);
    const FillScore hold = score_of(bare_shaping(Fill::none), 0, c.fps, strokes);
    const FillScore predict = score_of(bare_shaping(Fill::predict), 0, c.fps, strokes);
    std::printf(
        "%s, %.0f fps: rms error held %.4f, predicted %.4f (%.0f %%); overshoot %.3f at "
        "worst, %.4f on average\n",
        c.taps ? "taps" : "pushes", c.fps, hold.rms, predict.rms, 100 * predict.rms / hold.rms,
        predict.worst_overshoot, predict.mean_overshoot);
    EXPECT_LT(predict.rms, c.most_rms * hold.rms);
    EXPECT_LE(predict.worst_overshoot, c.most_overshoot);
    EXPECT_LE(predict.mean_overshoot, c.most_mean_overshoot);
    EXPECT_LT(hold.worst_overshoot, 2e-3) << "else this test cannot tell";
  }
}

TEST(MotionExtrapolator, SoItIsBehindFilterCurveAndNoiseToo) {
  ShapingOptions o = bare_shaping(Fill::none);
  o.dead_zone.setConstant(0.03);
  o.filter = {};
  for (AxisOptions& axis : o.axes) axis.curve = {.kind = CurveKind::power, .power = 1.6};
  constexpr double kNoise_n = 1e-3;  // of full scale: three times what was measured in Fz
  for (const double fps : {25.0, 30.0}) {
    const std::vector<Stroke> strokes = strokes_of(false, 150);
    o.fill = Fill::none;
    const FillScore hold = score_of(o, kNoise_n, fps, strokes);
    o.fill = Fill::predict;
    const FillScore predict = score_of(o, kNoise_n, fps, strokes);
    std::printf(
        "pushes through One Euro and a curve, %.0f fps: rms error held %.4f, predicted "
        "%.4f (%.0f %%); overshoot held %.3f, predicted %.3f at worst, %.4f on average\n",
        fps, hold.rms, predict.rms, 100 * predict.rms / hold.rms, hold.worst_overshoot,
        predict.worst_overshoot, predict.mean_overshoot);
    EXPECT_LT(predict.rms, 0.85 * hold.rms);
    EXPECT_LT(predict.worst_overshoot, 0.05);
    EXPECT_LT(predict.mean_overshoot, 0.01);
  }
}

TimePoint ms(double t) { return TimePoint(std::chrono::seconds(9) + seconds_as_duration(t / 1e3)); }

/// Four frames of a steady pull, 40 ms apart, up to `last`.
MotionExtrapolator steady_pull(double last, double step) {
  MotionExtrapolator fill;
  for (int i = 0; i < 4; ++i) fill.add(ms(40 * i), Vector6::Constant(last - (3 - i) * step));
  return fill;
}

const Vector6 kNoLimit = Vector6::Ones();

TEST(MotionExtrapolator, GoesOnForOneAndAHalfPeriodsAndThenStays) {
  const MotionExtrapolator fill = steady_pull(0.8, 0.1);
  EXPECT_NEAR(fill.at(ms(140), kNoLimit)[2], 0.85, 1e-9);
  EXPECT_NEAR(fill.at(ms(180), kNoLimit)[2], 0.95, 1e-9);
  EXPECT_NEAR(fill.at(ms(900), kNoLimit)[2], 0.95, 1e-9);
  EXPECT_EQ(fill.at(ms(120), kNoLimit)[2], 0.8);
  EXPECT_EQ(fill.at(ms(60), kNoLimit)[2], 0.8) << "of an earlier moment: the newest";
}

TEST(MotionExtrapolator, ALostFrameDoesNotMakeThePeriodLonger) {
  MotionExtrapolator fill = steady_pull(0.6, 0.05);
  fill.add(ms(200), Vector6::Constant(0.7));
  EXPECT_NEAR(fill.at(ms(900), kNoLimit)[0], 0.7 + 1.5 * 0.05, 1e-9);
}

TEST(MotionExtrapolator, KeepsToLimitsAndToItsSideOfZero) {
  EXPECT_EQ(steady_pull(0.95, 0.1).at(ms(180), Vector6::Constant(0.97))[0], 0.97);
  EXPECT_EQ(steady_pull(-0.95, -0.1).at(ms(180), Vector6::Constant(0.97))[0], -0.97);
  for (double size = 0.01; size < 1; size += 0.05) {
    EXPECT_GE(steady_pull(size, -0.3).at(ms(180), kNoLimit)[0], 0);
    EXPECT_LE(steady_pull(-size, 0.3).at(ms(180), kNoLimit)[0], 0);
  }
}

TEST(MotionExtrapolator, NeverLeavesRest) {
  EXPECT_EQ(steady_pull(0, 0.1).at(ms(180), kNoLimit), Vector6::Zero().eval());
  EXPECT_EQ(steady_pull(0, -0.1).at(ms(180), kNoLimit), Vector6::Zero().eval());
}

TEST(MotionExtrapolator, AJumpIsNoMovementToGoOnWith) {
  MotionExtrapolator fill;
  for (int i = 0; i < 3; ++i) fill.add(ms(40 * i), Vector6::Zero());
  fill.add(ms(120), Vector6::Constant(0.5));
  EXPECT_EQ(fill.at(ms(160), kNoLimit)[0], 0.5);
}

TEST(MotionExtrapolator, ATurnIsNotGoneOnWith) {
  MotionExtrapolator fill = steady_pull(0.6, 0.1);
  fill.add(ms(160), Vector6::Constant(0.55));
  EXPECT_EQ(fill.at(ms(200), kNoLimit)[0], 0.55);
}

TEST(MotionExtrapolator, ForgetsWhenToldTo) {
  MotionExtrapolator fill = steady_pull(0.6, 0.1);
  fill.reset();
  EXPECT_EQ(fill.at(ms(200), kNoLimit), Vector6::Zero().eval());
}

}  // namespace
}  // namespace tagwrench

// What is put into a camera of numbers comes out of the estimator, within what it says of itself.
#include "host/tools/camera_timing/camera_timing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "tests/unit/tools/camera_timing/flashed_camera.h"

namespace tagwrench::test {
namespace {

struct Played {
  FlashedTruth truth;
  CameraTimingInput input;
  CameraTimingResult result;
};

Played play(const FlashedCamera& camera) {
  Played played;
  played.input = flash(camera, played.truth);
  played.result = measure_camera_timing(played.input);
  return played;
}

/// Frames that are stale or not and were taken for the other.
int wrongly_judged(const Played& played) {
  int wrong = 0;
  for (std::size_t i = 0; i < played.truth.stale.size(); ++i) {
    const bool found = played.result.times[i].freshness == Freshness::stale;
    wrong += found != played.truth.stale[i] ? 1 : 0;
  }
  return wrong;
}

void expect_within(const char* what, const Figure& figure, double truth, double tolerance) {
  EXPECT_TRUE(figure.known) << what;
  EXPECT_NEAR(figure.value, truth, tolerance) << what;
}

TEST(Bandwidth, ARollingShutterTellsEverything) {
  FlashedCamera camera;
  camera.stale = 0.02;
  camera.lost = 0.02;
  const Played played = play(camera);
  const CameraTimingResult& r = played.result;
  ASSERT_EQ(r.refusal, "");
  expect_within("frame rate, Hz", r.frame_rate, 24.87, 24.87e-3);
  expect_within("latency, s", r.latency, 0.023, 0.5e-3);
  expect_within("jitter, s", r.jitter, 0.001, 0.25e-3);
  expect_within("read-out, s", r.readout, 0.018, 2e-6);
  expect_within("exposure, s", r.exposure, 0.004, 2e-6);
  EXPECT_EQ(wrongly_judged(played), 0);
  EXPECT_GT(r.stale, 0);
  EXPECT_GT(played.truth.lost, 0);
  EXPECT_EQ(r.missing, played.truth.lost + r.stale) << "a stale frame took a picture's place";
  EXPECT_EQ(r.dropped_by_driver, played.truth.lost);
  EXPECT_EQ(r.strange, 0);
}

TEST(Bandwidth, EachPicturesTimeIsWithinItsSigma) {
  const Played played = play({});
  ASSERT_EQ(played.result.refusal, "");
  double squares = 0;
  int timed = 0;
  for (std::size_t i = 0; i < played.result.times.size(); ++i) {
    const TimedFrame& frame = played.result.times[i];
    if (!frame.timed) continue;
    ++timed;
    squares += std::pow((frame.exposed - played.truth.exposed[i]) / frame.sigma, 2);
  }
  ASSERT_GT(timed, 240);
  const double normalised = std::sqrt(squares / timed);
  std::printf("error over sigma, rms: %.3f\n", normalised);
  EXPECT_LT(normalised, 1.3);
  EXPECT_GT(normalised, 0.7);
}

TEST(Bandwidth, ReadoutsExposuresAndLatenciesOfManyCameras) {
  struct Case {
    double readout, exposure, jitter, latency;
  };
  for (const Case& c : {Case{0.018, 0.0005, 0.001, 0.023}, Case{0.018, 0.012, 0.003, 0.120},
                        Case{-0.018, 0.012, 0.003, 0.120}, Case{0.030, 0.008, 0.0001, 0.450},
                        Case{0.005, 0.004, 0.0005, 0.001}}) {
    FlashedCamera camera;
    camera.readout = c.readout;
    camera.exposure = c.exposure;
    camera.jitter = c.jitter;
    camera.latency = c.latency;
    camera.stale = 0.02;
    camera.lost = 0.02;
    const Played played = play(camera);
    const CameraTimingResult& r = played.result;
    SCOPED_TRACE("read-out " + std::to_string(c.readout) + " exposure " +
                 std::to_string(c.exposure));
    ASSERT_EQ(r.refusal, "");
    expect_within("frame rate, Hz", r.frame_rate, 24.87, 24.87e-3);
    expect_within("latency, s", r.latency, c.latency, 4 * c.jitter / std::sqrt(230.0));
    expect_within("read-out, s", r.readout, c.readout, 5e-6);
    expect_within("exposure, s", r.exposure, c.exposure, 5e-6);
    EXPECT_EQ(wrongly_judged(played), 0);
    EXPECT_EQ(r.missing, played.truth.lost + r.stale);
  }
}

// One brightness a picture: what can be told is told, with a sigma that says how well.
TEST(Bandwidth, AGlobalShutterTellsWhatItCan) {
  for (const double jitter : {0.1e-3, 1e-3}) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      FlashedCamera camera;
      camera.readout = 0;
      camera.jitter = jitter;
      camera.stale = 0.02;
      camera.lost = 0.02;
      camera.seed = seed;
      const Played played = play(camera);
      const CameraTimingResult& r = played.result;
      SCOPED_TRACE("jitter " + std::to_string(jitter) + " seed " + std::to_string(seed));
      ASSERT_EQ(r.refusal, "");
      expect_within("frame rate, Hz", r.frame_rate, 24.87, 24.87e-3);
      expect_within("latency, s", r.latency, 0.023, 0.5e-3);
      EXPECT_LT(std::abs(r.latency.value - 0.023), 3 * r.latency.sigma);
      expect_within("exposure, s", r.exposure, 0.004, 3 * r.exposure.sigma);
      EXPECT_LT(r.exposure.sigma, 0.5e-3);
      EXPECT_LT(std::abs(r.readout.value), 3 * r.readout.sigma);
      if (r.jitter.known) {
        EXPECT_LT(std::abs(r.jitter.value - jitter), 3 * r.jitter.sigma);
      }
      int hidden = 0;  // stale, and neither found nor said to be undecided
      for (std::size_t i = 0; i < r.times.size(); ++i)
        hidden += played.truth.stale[i] && r.times[i].freshness == Freshness::fresh ? 1 : 0;
      EXPECT_LE(hidden, 1);
    }
  }
}

FlashedCamera global_camera(double rate, double exposure, unsigned seed) {
  FlashedCamera camera;
  camera.period = 1 / (0.995 * rate);
  camera.announced = 1 / rate;
  camera.exposure = exposure;
  camera.readout = 0;
  camera.stale = 0.02;
  camera.lost = 0.02;
  camera.seed = seed;
  return camera;
}

// One brightness that fits no time to within the noise, but almost, is not another light's; and one
// like that of the picture before need not be the same picture.
TEST(Bandwidth, AGlobalShuttersGoodPicturesAreNeitherStrangeNorStale) {
  int pictures = 0, strange = 0, stale = 0, hidden = 0, timed = 0;
  for (const unsigned seed : {1U, 3U, 4U}) {
    const Played played = play(global_camera(30, 8e-3, seed));
    const CameraTimingResult& r = played.result;
    ASSERT_EQ(r.refusal, "");
    pictures += r.frames;
    strange += r.strange;
    timed += r.timed;
    for (std::size_t i = 0; i < r.times.size(); ++i) {
      const Freshness found = r.times[i].freshness;
      stale += !played.truth.stale[i] && found == Freshness::stale ? 1 : 0;
      hidden += played.truth.stale[i] && found == Freshness::fresh ? 1 : 0;
    }
  }
  std::printf("of %d pictures strange %d, wrongly stale %d, stale and not seen %d, timed %d\n",
              pictures, strange, stale, hidden, timed);
  EXPECT_LE(strange, pictures / 200);
  EXPECT_LE(stale, pictures / 200);
  EXPECT_LE(hidden, pictures / 200);
  EXPECT_GT(timed, pictures / 4);
}

TEST(Bandwidth, AGlobalShuttersPicturesOfAnotherLightAreStrange) {
  FlashedTruth truth;
  FlashedCamera camera = global_camera(30, 8e-3, 1);
  CameraTimingInput input = flash(camera, truth);
  constexpr std::size_t kFlashed[] = {40, 90, 140, 190, 230};
  for (const std::size_t i : kFlashed) {
    for (std::size_t b = 0; b < input.bands.size(); ++b)
      input.frames[i].rows[b] = input.dark[b] + 1.4 * (input.lit[b] - input.dark[b]);
  }
  const CameraTimingResult r = measure_camera_timing(input);
  ASSERT_EQ(r.refusal, "");
  for (const std::size_t i : kFlashed) {
    EXPECT_EQ(r.times[i].freshness, Freshness::strange) << i;
    EXPECT_FALSE(r.times[i].timed) << i;
  }
  EXPECT_LE(r.strange, 6);
}

TEST(Bandwidth, AGlobalShuttersFrameRateIsWithinItsSigma) {
  constexpr int kRuns = 8;
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    const FlashedCamera camera = global_camera(60, 2e-3, 1 + static_cast<unsigned>(run));
    const CameraTimingResult r = play(camera).result;
    ASSERT_TRUE(r.frame_rate.known) << r.refusal;
    EXPECT_NEAR(r.frame_rate.value, 1 / camera.period, 1e-4 / camera.period);
    squares += std::pow((r.frame_rate.value - 1 / camera.period) / r.frame_rate.sigma, 2);
  }
  const double normalised = std::sqrt(squares / kRuns);
  std::printf("error over sigma, rms of %d: %.2f\n", kRuns, normalised);
  // Pictures that do not tell count with the whole jitter, which makes the sigma a careful one.
  EXPECT_GT(normalised, 0.25);
  EXPECT_LT(normalised, 1.45);
}

// A camera's response may bend; edges still lie where they lie, but slopes look shorter.
TEST(Bandwidth, ABentResponseHardlyMovesLatencyAndReadout) {
  FlashedCamera camera;
  camera.bend = 0.25;
  const Played played = play(camera);
  const CameraTimingResult& r = played.result;
  ASSERT_EQ(r.refusal, "");
  std::printf("read-out off by %.1f us (sigma %.1f), exposure by %.1f us (sigma %.1f)\n",
              1e6 * (r.readout.value - 0.018), 1e6 * r.readout.sigma,
              1e6 * (r.exposure.value - 0.004), 1e6 * r.exposure.sigma);
  expect_within("latency, s", r.latency, 0.023, 0.3e-3);
  expect_within("read-out, s", r.readout, 0.018, 0.05 * 0.018);
  EXPECT_EQ(wrongly_judged(played), 0);
}

TEST(Bandwidth, TheStatedSigmasCoverTheErrors) {
  constexpr int kRuns = 24;
  struct Score {
    double squares = 0;
    void add(const Figure& figure, double truth) {
      squares += std::pow((figure.value - truth) / figure.sigma, 2);
    }
    double rms() const { return std::sqrt(squares / kRuns); }
  };
  Score rate, latency, jitter, readout, exposure;
  for (int run = 0; run < kRuns; ++run) {
    FlashedCamera camera;
    camera.frames = 80;
    camera.noise_counts = 0.5;
    camera.jitter = 0.5e-3;
    camera.seed = 100 + static_cast<unsigned>(run);
    const Played played = play(camera);
    ASSERT_EQ(played.result.refusal, "");
    rate.add(played.result.frame_rate, 1 / camera.period);
    latency.add(played.result.latency, camera.latency);
    jitter.add(played.result.jitter, camera.jitter);
    readout.add(played.result.readout, camera.readout);
    exposure.add(played.result.exposure, camera.exposure);
  }
  std::printf(
      "error over sigma, rms of %d: rate %.2f latency %.2f jitter %.2f read-out %.2f "
      "exposure %.2f\n",
      kRuns, rate.rms(), latency.rms(), jitter.rms(), readout.rms(), exposure.rms());
  // Of 24 normal numbers the rms lies within 0.6 and 1.45 but once in a thousand times. A sigma of
  // the jitter of an exponential is itself uncertain.
  for (const Score* score : {&rate, &latency, &readout, &exposure}) {
    EXPECT_GT(score->rms(), 0.5);
    EXPECT_LT(score->rms(), 1.45);
  }
  EXPECT_LT(jitter.rms(), 2.0);
}

TEST(Bandwidth, UncertaintyOfTheClocksIsPartOfTheResult) {
  FlashedCamera camera;
  camera.jitter = 1e-6;
  Played played = play(camera);
  ASSERT_EQ(played.result.refusal, "");
  EXPECT_LT(played.result.latency.sigma, 0.02e-3);
  played.input.edge_sigma = 0.3e-3;
  played.input.clock_rate_sigma = 20e-6;
  const CameraTimingResult r = measure_camera_timing(played.input);
  EXPECT_NEAR(r.latency.sigma, 0.3e-3, 0.02e-3);
  EXPECT_NEAR(r.frame_rate.sigma, 20e-6 * r.frame_rate.value, 2e-6 * r.frame_rate.value);
}

TEST(Bandwidth, RefusesPicturesThatShowNoPattern) {
  FlashedTruth truth;
  FlashedCamera camera;
  CameraTimingInput input = flash(camera, truth);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0, 100);
  for (ObservedFrame& frame : input.frames) {
    for (double& value : frame.rows) value = any(random);
  }
  EXPECT_NE(measure_camera_timing(input).refusal.find("do not show the LED's pattern"),
            std::string::npos);
}

TEST(Bandwidth, RefusesTooFewPictures) {
  FlashedCamera camera;
  camera.frames = kMinBandwidthFrames - 1;
  EXPECT_NE(play(camera).result.refusal.find("59 pictures"), std::string::npos);
}

TEST(Bandwidth, BitsAndFramesShareNoMultiple) {
  for (const double rate : {15.0, 25.0, 30.0, 60.0, 120.0}) {
    const double bits = 1 / rate / bit_period_for(1 / rate);
    for (int frames = 1; frames <= 7; ++frames)
      EXPECT_GT(std::abs(frames * bits - std::round(frames * bits)), 0.05) << frames;
  }
}

}  // namespace
}  // namespace tagwrench::test

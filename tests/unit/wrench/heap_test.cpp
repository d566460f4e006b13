// Newtons of every kind of model, and their shaping, without the heap; and how long one sample
// takes.
#include <gtest/gtest.h>

#include <cstdio>

#include "host/motion/shaping.h"
#include "host/wrench/estimate.h"
#include "tests/support/heap_count.h"

namespace tagwrench {
namespace {

TEST(WrenchHeap, EveryKindOfModelEstimatesWithoutIt) {
  for (int kind = 0; kind < kFeatureKinds; ++kind) {
    WrenchModel model;
    model.K.setIdentity();
    model.features = {.kind = static_cast<FeatureKind>(kind),
                      .time_constant = 10,
                      .play = Vector6::Constant(1e-4)};
    const int count = feature_count(model.features.kind);
    model.extra = Eigen::MatrixXd::Constant(6, count - 6, 0.1);
    model.parameter_covariance = Eigen::MatrixXd::Identity(6 * (count + 1), 6 * (count + 1));
    WrenchEstimator estimator(model);
    Track track;
    track.status = Status::ok;
    track.covariance.setIdentity();
    Sample sample;
    constexpr int kSamples = 20'000;
    test::start_counting_allocations();
    const auto before = std::chrono::steady_clock::now();
    for (int i = 0; i < kSamples; ++i) {
      track.displacement.setConstant(1e-3 * (i % 7));
      sample.capture_time += std::chrono::milliseconds(10);
      estimator.estimate(track, sample);
    }
    const Duration spent = std::chrono::steady_clock::now() - before;
    EXPECT_EQ(test::stop_counting_allocations(), 0) << kind;
    EXPECT_EQ(sample.status, Status::ok);
    std::printf("%s: %.2f us a sample\n", name(model.features.kind).data(),
                static_cast<double>(spent.count()) / 1e3 / kSamples);
  }
}

TEST(WrenchHeap, ShapingDoesWithoutItAlsoWhenItIsChanged) {
  ShapingOptions options;
  for (AxisOptions& axis : options.axes) axis.curve = {.kind = CurveKind::power, .power = 1.6};
  Shaping shaping(options);
  Sample sample;
  sample.status = Status::ok;
  sample.wrench_sigma.setConstant(1e-4);
  constexpr int kSamples = 20'000;
  test::start_counting_allocations();
  const auto before = std::chrono::steady_clock::now();
  for (int i = 0; i < kSamples; ++i) {
    sample.wrench.setConstant(1e-3 * (i % 700));
    sample.capture_time += std::chrono::milliseconds(10);
    shaping.shape(sample);
    sample.deflection = shaping.motion_at(sample.capture_time + std::chrono::milliseconds(5));
    if (i % 100 == 0) shaping.change(options);
  }
  const Duration spent = std::chrono::steady_clock::now() - before;
  EXPECT_EQ(test::stop_counting_allocations(), 0);
  EXPECT_TRUE(sample.deflection.allFinite());
  std::printf("shaping: %.2f us a sample\n", static_cast<double>(spent.count()) / 1e3 / kSamples);
}

}  // namespace
}  // namespace tagwrench

// What is a tap and what is not, by loads drawn by hand; an hour of them is in tests/sim.
#include "host/motion/gestures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <vector>

namespace tagwrench {
namespace {

constexpr double kTapPi = 3.14159265358979323846;
constexpr std::uint32_t kTapButton = 1;
constexpr std::uint32_t kPressButton = 4;

GestureOptions all_gestures() {
  GestureOptions options = gestures_for((Vector6() << 0.9, 0.9, 2.5, 16e-3, 16e-3, 9e-3).finished(),
                                        Eigen::Matrix3d::Identity());
  options.tap.button = 0;
  options.double_tap.button = 1;
  options.press_hold.button = 2;
  options.twist_left.button = 3;
  options.twist_right.button = 4;
  return options;
}

GestureOptions taps_alone() {
  GestureOptions options;
  options.hid_R_camera.setIdentity();
  options.tap.button = 0;
  return options;
}

struct Felt {
  double time;
  GestureResult result;
};

/// The load at a time (s), HID axes.
using Load = std::function<Vector6(double)>;

std::vector<Felt> feel(const GestureOptions& options, double length, double fps, const Load& load,
                       const std::function<void(double, Sample&)>& alter = {}) {
  Gestures gestures(options);
  std::vector<Felt> felt;
  for (int frame = 0; frame < length * fps; ++frame) {
    const double time = (frame + 0.37) / fps;
    Sample sample;
    sample.status = Status::ok;
    sample.capture_time = TimePoint(Duration(std::llround(1e9 * time)));
    sample.wrench = load(time);
    if (alter) alter(time, sample);
    if (sample.sequence == 1) continue;  // lost
    felt.push_back({time, gestures.feel(sample)});
  }
  return felt;
}

std::vector<Gesture> recognised(const std::vector<Felt>& felt) {
  std::vector<Gesture> all;
  for (const Felt& f : felt) {
    if (f.result.recognised != Gesture::none) all.push_back(f.result.recognised);
  }
  return all;
}

double time_of(const std::vector<Felt>& felt, Gesture gesture) {
  for (const Felt& f : felt) {
    if (f.result.recognised == gesture) return f.time;
  }
  return -1;
}

double pulse(double time, double begin, double length, double peak) {
  const double x = (time - begin) / length;
  return x <= 0 || x >= 1 ? 0 : peak * std::pow(std::sin(kTapPi * x), 1.5);
}

double minimum_jerk_bell(double time, double begin, double length, double peak) {
  const double x = (time - begin) / length;
  return x <= 0 || x >= 1 ? 0 : peak * 16 * x * x * (1 - x) * (1 - x);
}

double rising(double time, double begin, double length) {
  const double x = std::clamp((time - begin) / length, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

Vector6 down(double force) { return force * Vector6::Unit(2); }
Vector6 turn(double torque) { return torque * Vector6::Unit(5); }
Load tap_at(double begin, double peak = 1, double length = 0.08) {
  return [=](double t) { return down(pulse(t, begin, length, peak)); };
}

using Found = std::vector<Gesture>;

TEST(Gestures, ATapPressesItsButtonForATenthOfASecondAndOnce) {
  for (const double fps : {25.0, 30.0, 60.0, 120.0}) {
    const auto felt = feel(taps_alone(), 3, fps, tap_at(1));
    EXPECT_EQ(recognised(felt), Found{Gesture::tap}) << fps;
    double first = 0, last = 0;
    for (const Felt& f : felt) {
      EXPECT_TRUE(f.result.buttons == 0 || f.result.buttons == kTapButton);
      if (f.result.buttons == 0) continue;
      first = first == 0 ? f.time : first;
      last = f.time;
    }
    EXPECT_NEAR(last + 1 / fps - first, 0.1, 1 / fps) << "s, at " << fps;
    EXPECT_EQ(first, time_of(felt, Gesture::tap));
  }
}

TEST(Gestures, ATapIsToldWithinFourFramesAtThirtyAndSixOfSixty) {
  // From the finger's leaving: the first frame at rest, and then two or three that it stays there.
  for (int shift = 0; shift < 10; ++shift) {
    const double begin = 1 + 0.0033 * shift;
    const double left = begin + 0.08;
    EXPECT_LE(time_of(feel(taps_alone(), 2, 30, tap_at(begin)), Gesture::tap) - left, 0.1);
    EXPECT_LE(time_of(feel(taps_alone(), 2, 60, tap_at(begin)), Gesture::tap) - left, 0.067);
  }
}

TEST(Gestures, WhereADoubleTapIsLookedForASingleOneWaitsForTheSecond) {
  const auto single = feel(all_gestures(), 3, 60, tap_at(1));
  EXPECT_EQ(recognised(single), Found{Gesture::tap});
  EXPECT_NEAR(time_of(single, Gesture::tap) - 1.08, 0.25, 0.034);  // s
  for (const double gap : {0.08, 0.12, 0.2}) {
    for (const double fps : {30.0, 60.0}) {
      const auto felt = feel(all_gestures(), 3, fps, [&](double t) {
        return down(pulse(t, 1, 0.08, 1) + pulse(t, 1.08 + gap, 0.08, 1.2));
      });
      EXPECT_EQ(recognised(felt), Found{Gesture::double_tap}) << gap << " s, " << fps;
      EXPECT_LE(time_of(felt, Gesture::double_tap) - 1.16 - gap, 0.1);
    }
  }
  const auto twice = feel(all_gestures(), 3, 60, [](double t) {
    return down(pulse(t, 1, 0.08, 1) + pulse(t, 1.6, 0.08, 1));
  });
  EXPECT_EQ(recognised(twice), (Found{Gesture::tap, Gesture::tap}));
}

TEST(Gestures, ATapThatIsFollowedByAPushAtOnceIsStillATap) {
  const auto felt = feel(all_gestures(), 4, 60, [](double t) {
    return down(pulse(t, 1, 0.08, 1) + 1.5 * rising(t, 1.2, 0.3) - 1.5 * rising(t, 2.5, 0.3));
  });
  EXPECT_EQ(recognised(felt), Found{Gesture::tap});
}

TEST(Gestures, APressIsHeldAsLongAsTheFingerIs) {
  for (const double fps : {30.0, 60.0}) {
    const auto felt = feel(all_gestures(), 4, fps, [](double t) {
      return down(1.5 * (rising(t, 1, 0.08) - rising(t, 2.5, 0.08)));
    });
    EXPECT_EQ(recognised(felt), Found{Gesture::press_hold});
    EXPECT_NEAR(time_of(felt, Gesture::press_hold), 1.55, 0.05);  // s
    for (const Felt& f : felt) {
      const bool held = f.time > 1.62 && f.time < 2.5;
      const bool free = f.time < 1.5 || f.time > 2.58 + 1 / fps;
      EXPECT_TRUE(!held || f.result.buttons == kPressButton) << f.time;
      EXPECT_TRUE(!free || f.result.buttons == 0) << f.time;
    }
  }
}

TEST(Gestures, APushThatSwellsAndStaysIsNoPress) {
  for (const double rise : {0.15, 0.2, 0.3, 0.5}) {
    for (const double force : {1.1, 1.5, 2.0, 2.4}) {
      for (const double fps : {30.0, 60.0}) {
        const auto felt = feel(all_gestures(), 4, fps, [&](double t) {
          return down(force * (rising(t, 1, rise) - rising(t, 3, 0.2)));
        });
        EXPECT_EQ(recognised(felt), Found{}) << rise << " s, " << force << " N, " << fps;
      }
    }
  }
}

TEST(Gestures, ShortPushesStraightDownAndShortTurnsAreNone) {
  for (const double fps : {25.0, 30.0, 60.0, 120.0}) {
    for (int step = 0; step < 40; ++step) {
      const double size = 0.2 + 0.055 * step;  // N down, up to 2.4; and of 9 mN m
      const double begin = 1 + 0.0031 * step;
      const auto pressed = feel(all_gestures(), 2.5, fps, [&](double t) {
        return down(minimum_jerk_bell(t, begin, 0.3, size));
      });
      const auto turned = feel(all_gestures(), 2.5, fps, [&](double t) {
        return turn(minimum_jerk_bell(t, begin, 0.3, size * 3.6e-3));
      });
      EXPECT_EQ(recognised(pressed), Found{}) << size << " N at " << fps;
      EXPECT_EQ(recognised(turned), Found{}) << size * 3.6 << " mN m at " << fps;
    }
  }
}

TEST(Gestures, ATwistIsToldWithItsDirection) {
  for (const double fps : {30.0, 60.0}) {
    const auto right = feel(all_gestures(), 2, fps, [](double t) {
      return Vector6(turn(pulse(t, 1, 0.12, 5e-3)) + down(pulse(t, 1, 0.12, 0.2)));
    });
    EXPECT_EQ(recognised(right), Found{Gesture::twist_right});
    EXPECT_LE(time_of(right, Gesture::twist_right) - 1.12, 0.1);  // s
    const auto left =
        feel(all_gestures(), 2, fps, [](double t) { return turn(pulse(t, 1, 0.12, -5e-3)); });
    EXPECT_EQ(recognised(left), Found{Gesture::twist_left});
  }
}

TEST(Gestures, AreTurnedWithTheMounting) {
  GestureOptions options = all_gestures();
  options.hid_R_camera = Eigen::Vector3d(1, -1, -1).asDiagonal();  // the camera looks up
  const auto tap = feel(options, 2, 60, [](double t) { return down(pulse(t, 1, 0.08, -1)); });
  EXPECT_EQ(recognised(tap), Found{Gesture::tap});
  const auto pull = feel(options, 2, 60, [](double t) { return down(pulse(t, 1, 0.08, 1)); });
  EXPECT_EQ(recognised(pull), Found{});
  const auto right = feel(options, 2, 60, [](double t) { return turn(pulse(t, 1, 0.1, -5e-3)); });
  EXPECT_EQ(recognised(right), Found{Gesture::twist_right});
}

TEST(Gestures, ATapBesideTheMiddleOrAslantIsNone) {
  const auto at = [](double x, double side) {
    return feel(taps_alone(), 2, 60, [=](double t) {
      const double force = pulse(t, 1, 0.08, 1);
      return (Vector6() << side * force, 0, force, 0, -x * force, 0).finished();
    });
  };
  EXPECT_EQ(recognised(at(0.008, 0)), Found{Gesture::tap});
  EXPECT_EQ(recognised(at(0.016, 0)), Found{}) << "16 mm off";
  EXPECT_EQ(recognised(at(0, 0.4)), Found{Gesture::tap});
  EXPECT_EQ(recognised(at(0, 0.8)), Found{}) << "39 degrees off";
}

TEST(Gestures, NothingIsTakenForATapThatDoesNotEndWhereItBegan) {
  const auto landed = feel(taps_alone(), 3, 60, [](double t) {
    return down(pulse(t, 1, 0.08, 1) + 0.1 * rising(t, 1, 0.1));  // and a hand stays there
  });
  EXPECT_EQ(recognised(landed), Found{});
  for (int phase = 0; phase < 20; ++phase) {
    const auto knocked = feel(taps_alone(), 3, 60, [&](double t) {  // 84 Hz, 31 ms: springs
      const double since = t - 1 - phase * 1e-3;
      return down(since < 0 ? 0 : std::exp(-since / 0.031) * std::sin(2 * kTapPi * 84 * since));
    });
    EXPECT_EQ(recognised(knocked), Found{}) << phase << " ms";
  }
}

TEST(Gestures, NoneDuringAPushNorShortlyAfterIt) {
  for (const double after : {-0.6, -0.1, 0.05}) {
    const auto felt = feel(all_gestures(), 4, 60, [&](double t) {
      const double push = 0.4 * (rising(t, 1, 0.2) - rising(t, 1.8, 0.2));
      return Vector6(push * Vector6::Unit(0) + down(pulse(t, 2 + after, 0.08, 1)));
    });
    EXPECT_EQ(recognised(felt), Found{}) << after;
  }
}

TEST(Gestures, FramesThatAreNotTrustworthyMakeNone) {
  using Spoil = std::function<void(Sample&)>;
  const Spoil spoils[] = {[](Sample& s) { s.status = Status::acquiring; },
                          [](Sample& s) { s.status = Status::lost; },
                          [](Sample& s) { s.status = Status::saturated; },
                          [](Sample& s) { s.touched = true; },
                          [](Sample& s) { s.wrench[4] = std::numeric_limits<double>::quiet_NaN(); },
                          [](Sample& s) { s.wrench_sigma[2] = 0.1; }};
  int kind = 0;
  for (const Spoil& spoil : spoils) {
    const bool always = ++kind == static_cast<int>(std::size(spoils));
    const auto felt = feel(taps_alone(), 3, 60, tap_at(1), [&](double t, Sample& s) {
      if (always || (t > 1.03 && t < 1.05)) spoil(s);
    });
    EXPECT_EQ(recognised(felt), Found{}) << "spoil " << kind;
  }
  const auto gap = feel(taps_alone(), 3, 60, tap_at(1), [](double t, Sample& s) {
    if (t > 1.02 && t < 1.075) s.sequence = 1;
  });
  EXPECT_EQ(recognised(gap), Found{}) << "a gap";
  for (const int frames : {1, 3}) {  // of 17 ms
    const auto doubtful = feel(taps_alone(), 3, 60, tap_at(1), [&](double t, Sample& s) {
      if (t > 1.015 && t < 1.016 + frames / 60.0) s.status = Status::doubtful;
    });
    EXPECT_EQ(recognised(doubtful), frames == 1 ? Found{Gesture::tap} : Found{}) << frames;
  }
  const auto after = feel(taps_alone(), 3, 60, tap_at(1.6), [](double t, Sample& s) {
    if (t > 1 && t < 1.3) s.status = Status::lost;
  });
  EXPECT_EQ(recognised(after), Found{Gesture::tap}) << "and again, once it was at rest";
}

TEST(Gestures, ButtonsAreReleasedWhenTheSensorIsLost) {
  const auto felt = feel(
      all_gestures(), 3, 60, [](double t) { return down(1.5 * rising(t, 1, 0.08)); },
      [](double t, Sample& s) {
        if (t > 2) s.status = Status::lost;
      });
  for (const Felt& f : felt) {
    EXPECT_TRUE(f.time < 2 || (f.result.buttons == 0 && !f.result.hold_motion)) << f.time;
  }
}

TEST(Gestures, ACommandComesOnceNobodyTouchesIt) {
  GestureOptions options = taps_alone();
  options.tap = {-1, GestureCommand::zero};
  options.press_hold = {-1, GestureCommand::next_profile};
  double when = 0;
  int times = 0;
  for (const Felt& f : feel(options, 3, 60, tap_at(1))) {
    if (f.result.command == GestureCommand::none) continue;
    EXPECT_EQ(f.result.command, GestureCommand::zero);
    when = f.time;
    ++times;
  }
  EXPECT_EQ(times, 1);
  EXPECT_NEAR(when, 1.08 + 0.05 + 0.15, 0.05);  // s
  for (const Felt& f : feel(options, 5, 60, [](double t) {
         return down(1.5 * (rising(t, 1, 0.08) - rising(t, 3, 0.1)));
       })) {
    if (f.result.command == GestureCommand::none) continue;
    EXPECT_EQ(f.result.command, GestureCommand::next_profile);
    EXPECT_GT(f.time, 3.2);
  }
}

TEST(Gestures, MotionIsHeldDuringATapAndNeverForAPushThatSwells) {
  for (const Felt& f : feel(taps_alone(), 3, 60, tap_at(1))) {
    const bool struck = f.time > 1 + 0.02 && f.time < 1.08;
    const bool free = f.time < 1 || f.time > 1.3;
    EXPECT_TRUE(!struck || f.result.hold_motion) << f.time;
    EXPECT_TRUE(!free || !f.result.hold_motion) << f.time;
  }
  for (int axis = 0; axis < 6; ++axis) {
    const double size = axis < 2 ? 0.6 : axis == 2 ? 1.0 : axis < 5 ? 12e-3 : 5e-3;
    for (const Felt& f : feel(all_gestures(), 3, 60, [&](double t) {
           return Vector6(minimum_jerk_bell(t, 1, 1.2, size) * Vector6::Unit(axis));
         })) {
      EXPECT_FALSE(f.result.hold_motion) << "axis " << axis << " at " << f.time;
    }
  }
  double held = 0;  // of a push that is struck
  for (const Felt& f :
       feel(taps_alone(), 3, 60, [](double t) { return down(rising(t, 1, 0.1)); })) {
    if (f.result.hold_motion) held += 1 / 60.0;
  }
  EXPECT_LE(held, 0.12 + 1 / 60.0);  // s
  EXPECT_GT(held, 0.05);
}

TEST(Gestures, WhatDoesNothingIsNotLookedFor) {
  GestureOptions options = all_gestures();
  options.tap = options.double_tap = options.press_hold = options.twist_left = {};
  for (const Felt& f : feel(options, 3, 60, tap_at(1))) {
    EXPECT_FALSE(f.result.hold_motion);
    EXPECT_EQ(f.result.recognised, Gesture::none);
  }
  EXPECT_EQ(
      recognised(feel(options, 2, 60, [](double t) { return turn(pulse(t, 1, 0.1, -5e-3)); })),
      Found{});
}

TEST(Gestures, AreScaledWithTheSensor) {
  const GestureOptions published =
      gestures_for((Vector6() << 0.9, 0.9, 2.5, 16e-3, 16e-3, 9e-3).finished());
  const GestureOptions defaults;
  EXPECT_NEAR(published.tap_force, defaults.tap_force, 1e-12);
  EXPECT_NEAR(published.press_force, defaults.press_force, 1e-12);
  EXPECT_NEAR(published.twist_torque, defaults.twist_torque, 1e-12);
  EXPECT_LT((published.quiet - defaults.quiet).norm(), 1e-12);
  EXPECT_LT((published.twist_others - defaults.twist_others).norm(), 1e-12);
  const GestureOptions stiff = gestures_for(Vector6::Constant(40));
  EXPECT_NEAR(stiff.tap_force, 8, 1e-12);  // N
  EXPECT_EQ(gestures_for(Vector6::Constant(1e9)), defaults) << "a range that nobody knows";
  EXPECT_EQ(gestures_for(Vector6::Zero()), defaults);
}

}  // namespace
}  // namespace tagwrench

#include "host/motion/profile_config.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "host/core/config_error.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

constexpr const char* kWhole = R"(name: test
applications: [FreeCAD, blender]
rate_hz: 100
fill: none
curve: {power: 1.6}
axes:
  x: {full_scale_n: 0.8, dead_zone_n: 0.03, limit: 0.9}
  rz: {from: ry, invert: true, curve: {points: [[0, 0], [0.5, 0.2], [1, 1]]}}
  z: {from: rx, full_scale_nm: 0.02}
dead_zone_release: 0.5
noise_sigmas: 5
swing_ms: 80
translation: 1.5
rotation: 0.5
dominant: {on: true, ratio: 1.5}
lock: rotation
filter: {kind: one_euro, cutoff_hz: 1, hz_per_speed: 10, speed_cutoff_hz: 4}
gestures:
  tap: button 1
  double_tap: next_profile
  press_hold: zero
  tap_force_n: 0.4
  press_ms: 700
  hold_motion: false
)";

Profile parsed(const std::string& text) {
  return parse_profile(text, "p.yaml", default_profile({}));
}

std::string complaint(const std::string& text) {
  try {
    parsed(text);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no complaint";
}

/// The test profile, one line replaced.
std::string with(const std::string& line, const std::string& instead) {
  std::string text = kWhole;
  const std::size_t at = text.find(line);
  EXPECT_NE(at, std::string::npos) << line;
  return text.replace(at, line.size(), instead);
}

TEST(ProfileConfig, AWholeProfileIsReadAsItStands) {
  const Profile p = parsed(kWhole);
  const ShapingOptions& s = p.shaping;
  EXPECT_EQ(p.name, "test");
  EXPECT_EQ(p.applications, (std::vector<std::string>{"FreeCAD", "blender"}));
  EXPECT_EQ(p.rate_hz, 100);
  EXPECT_EQ(s.fill, Fill::none);
  EXPECT_EQ(s.full_scale[0], 0.8);
  EXPECT_EQ(s.dead_zone[0], 0.03);
  EXPECT_EQ(s.axes[0].limit, 0.9);
  EXPECT_EQ(s.axes[0].curve, (CurveOptions{.kind = CurveKind::power, .power = 1.6}));
  EXPECT_EQ(s.axes[5].source, 4);
  EXPECT_TRUE(s.axes[5].invert);
  EXPECT_EQ(s.axes[5].curve.count, 3u);
  EXPECT_EQ(s.axes[5].curve.points[1], (CurvePoint{0.5, 0.2}));
  EXPECT_EQ(s.release, 0.5);
  EXPECT_EQ(s.noise_sigmas, 5);
  EXPECT_DOUBLE_EQ(s.swing, 0.08);
  EXPECT_EQ(s.translation, 1.5);
  EXPECT_EQ(s.rotation, 0.5);
  EXPECT_EQ(s.dominant, (DominantOptions{true, 1.5}));
  EXPECT_EQ(s.lock, Lock::rotation);
  EXPECT_EQ(s.filter.cutoff_hz, 1);
  EXPECT_EQ(s.filter.hz_per_speed, 10);
  EXPECT_EQ(s.filter.speed_cutoff_hz, 4);
  EXPECT_EQ(p.gestures.tap.button, 0) << "people count from one";
  EXPECT_EQ(p.gestures.double_tap.command, GestureCommand::next_profile);
  EXPECT_EQ(p.gestures.press_hold.command, GestureCommand::zero);
  EXPECT_FALSE(p.gestures.twist_left.does_something());
  EXPECT_EQ(p.gestures.tap_force, 0.4);
  EXPECT_EQ(p.gestures.press_time, milliseconds(700));
  EXPECT_FALSE(p.gestures.hold_motion);
}

TEST(ProfileConfig, WhatIsLeftOutIsTheSensors) {
  SensorConfig sensor;
  sensor.shaping.full_scale << 5, 6, 7, .1, .2, .3;
  sensor.shaping.dead_zone << .5, .6, .7, .01, .02, .03;
  sensor.shaping.hid_R_camera = Eigen::Vector3d(-1, 1, -1).asDiagonal();
  const Profile p = parse_profile("name: bare\n", "p.yaml", default_profile(sensor));
  EXPECT_TRUE(p.shaping == sensor.shaping);
  EXPECT_EQ(p.gestures.hid_R_camera, sensor.shaping.hid_R_camera);
  EXPECT_EQ(p.rate_hz, 125);
  EXPECT_TRUE(p.applications.empty());
}

TEST(ProfileConfig, ARemappedAxisHasTheScaleOfWhatFeedsIt) {
  SensorConfig sensor;
  const Profile p = parsed("axes: {rz: {from: x}, x: {from: rz}}\n");
  EXPECT_EQ(p.shaping.full_scale[5], sensor.shaping.full_scale[0]);
  EXPECT_EQ(p.shaping.dead_zone[5], sensor.shaping.dead_zone[0]);
  EXPECT_EQ(p.shaping.full_scale[0], sensor.shaping.full_scale[5]) << "in any order";
}

TEST(ProfileConfig, EveryFaultIsOneLineWithFileLineAndKey) {
  struct Fault {
    std::string text;
    const char* where;
    const char* what;
  };
  for (const Fault& fault : {
           Fault{with("lock: rotation", "lok: rotation"), "p.yaml:16: lok: ", "unknown key"},
           Fault{with("limit: 0.9", "limits: 0.9"), "p.yaml:7: axes.x.limits: ", "unknown key"},
           Fault{with("  rz:", "  w:"), "p.yaml:8: axes.w: ", "unknown key"},
           Fault{with("[0.5, 0.2]", "[0.5, 1.2]"), "axes.rz.curve.points: ", "beyond 1"},
           Fault{with("[0.5, 0.2], [1, 1]", "[0.5, 0.2], [1, 0.1]"),
                 "axes.rz.curve.points: ", "goes backwards"},
           Fault{with("[0.5, 0.2], [1, 1]", "[0.5, 0.2], [0.4, 0.3], [1, 1]"),
                 "p.yaml:8: axes.rz.curve.points: ", "goes backwards"},
           Fault{with("[0, 0], [0.5", "[0, 0.1], [0.5"), "curve.points: ", "begin with [0, 0]"},
           Fault{with(", [1, 1]", ""), "curve.points: ", "end with [1, ...]"},
           Fault{with("curve: {power: 1.6}", "curve: {}"), "p.yaml:5: curve.power: ", "either"},
           Fault{with("dead_zone_n: 0.03", "dead_zone_n: 0.8"),
                 "p.yaml:7: axes.x.dead_zone_n: ", "smaller than the full scale"},
           Fault{with("full_scale_n: 0.8, dead_zone_n: 0.03", "full_scale_n: 0.01"),
                 "p.yaml:7: axes.x.full_scale_n: ", "smaller than the full scale"},
           Fault{with("full_scale_nm", "full_scale_n"),
                 "p.yaml:9: axes.z.full_scale_n: ", "fed with a torque"},
           Fault{with("from: rx", "from: roll"), "axes.z.from: ", "x, y, z, rx, ry, rz"},
           Fault{with("one_euro", "two_euro"), "p.yaml:17: filter.kind: ", "exponential"},
           Fault{with("cutoff_hz: 1", "weight: 1"), "filter.weight: ", "unknown key"},
           Fault{with("fill: none", "fill: guess"), "p.yaml:4: fill: ", "none, predict"},
           Fault{with("rate_hz: 100", "rate_hz: 1000"), "p.yaml:3: rate_hz: ", "20 to 125"},
           Fault{with("tap: button 1", "tap: button 17"), "p.yaml:19: gestures.tap: ", "button 16"},
           Fault{with("translation: 1.5", "translation: .nan"), "translation: ", "finite"},
           Fault{with("ratio: 1.5", "ratio: 0.5"), "dominant.ratio: ", "1 to 10"},
           Fault{with("name: test", "name: \"a\\nb\""), "p.yaml:1: name: ", "printable"},
           Fault{with("name: test", "name: \"\""), "p.yaml:1: name: ", "1 to 64"},
           Fault{with("[FreeCAD, blender]", "FreeCAD"), "p.yaml:2: applications: ", "list"},
           Fault{with("lock: rotation", "lock: rotation\nlock: none"),
                 "p.yaml:17: lock: ", "twice"},
       }) {
    const std::string line = complaint(fault.text);
    EXPECT_NE(line.find(fault.where), std::string::npos) << line;
    EXPECT_NE(line.find(fault.what), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

void expect_same(const Profile& a, const Profile& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.applications, b.applications);
  EXPECT_EQ(a.rate_hz, b.rate_hz);
  EXPECT_TRUE(a.shaping == b.shaping);
  EXPECT_EQ(profile_text(a), profile_text(b));
}

TEST(ProfileConfig, WhatIsWrittenReadsBackToTheSame) {
  Profile odd = parsed(kWhole);
  odd.name = "it's \"odd\" \\ ü";
  odd.shaping.full_scale[1] = 1.0 / 3;
  for (const Profile& p : {odd, parsed(kWhole), default_profile({}),
                           parsed("filter: {kind: exponential, weight: 0.3}"),
                           parsed("filter: {kind: none}\ncurve: {power: 1}\nrate_hz: 0")}) {
    expect_same(parsed(profile_text(p)), p);
    // Whatever is in force before.
    expect_same(parse_profile(profile_text(p), "p.yaml", parsed(kWhole)), p);
  }
}

TEST(ProfileConfig, EveryReadyProfileLoadsForEverySensor) {
  ASSERT_EQ(ready_profiles().size(), 3u);
  for (const ReadyProfile& ready : ready_profiles()) {
    for (const double strength : {1.0, 8.0, 70.0}) {
      SensorConfig sensor;
      sensor.shaping.full_scale *= strength;
      sensor.shaping.dead_zone *= strength;
      const Profile p = load_profile(ready.name, default_profile(sensor));
      EXPECT_EQ(p.name, ready.name);
      EXPECT_EQ(p.shaping.full_scale, sensor.shaping.full_scale) << "newtons are the sensor's";
      expect_same(parse_profile(profile_text(p), "p.yaml", default_profile(sensor)), p);
    }
  }
}

TEST(ProfileConfig, AFileIsNamedAfterItselfUnlessItSaysOtherwise) {
  const std::string file = testing::TempDir() + "my desk.yaml";
  std::ofstream(file) << "lock: translation\n";
  const Profile p = load_profile(file, default_profile({}));
  EXPECT_EQ(p.name, "my desk");
  EXPECT_EQ(p.shaping.lock, Lock::translation);
  std::filesystem::remove(file);
  try {
    load_profile(file, default_profile({}));
    FAIL() << "it is gone";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("cad, game, research"), std::string::npos) << e.what();
  }
}

TEST(ProfileConfig, AProfileServesProgramsByPartOfTheirNames) {
  const Profile p = parsed("applications: [freecad, Blender]\n");
  EXPECT_TRUE(serves(p, "org.freecad.FreeCAD"));
  EXPECT_TRUE(serves(p, "blender"));
  EXPECT_FALSE(serves(p, "firefox"));
  EXPECT_FALSE(serves(p, ""));
  EXPECT_FALSE(serves(parsed("name: for nobody\n"), "blender"));
}

/// A profile that somebody has mistyped, or that has been cut off or mixed up.
std::string mutated(std::string text, std::mt19937& random) {
  static const std::string kLikely = "{}[]:,-#&*!|>'\"%@ \n\t0123456789.eExyzr~";
  const int edits = 1 + static_cast<int>(random() % 4);
  for (int i = 0; i < edits; ++i) {
    const std::size_t at = random() % (text.size() + 1);
    const std::size_t length = std::min<std::size_t>(random() % 12, text.size() - at);
    switch (random() % 6) {
      case 0: text.insert(at, 1, kLikely[random() % kLikely.size()]); break;
      case 1: text.insert(at, 1, static_cast<char>(random())); break;
      case 2: text.erase(at, length); break;
      case 3: text.insert(at, text.substr(random() % (text.size() + 1), length)); break;
      case 4:
        if (at < text.size()) text[at] = kLikely[random() % kLikely.size()];
        break;
      case 5: text.resize(at); break;
    }
  }
  return text;
}

TEST(ProfileConfig, AnyMutationIsEitherAProfileOrOneLine) {
  std::mt19937 random(1);
  int good = 0;
  constexpr int kRounds = 6000;
  for (int i = 0; i < kRounds; ++i) {
    const std::string text = mutated(kWhole, random);
    try {
      const Profile p = parsed(text);
      ++good;
      expect_same(parsed(profile_text(p)), p);
      Shaping shaping(p.shaping);
      Sample s;
      s.status = Status::ok;
      s.wrench.setConstant(0.4);
      shaping.shape(s);
      ASSERT_TRUE((s.deflection.array().abs() <= 1).all()) << text;
    } catch (const ConfigError& e) {
      const std::string line = e.what();
      ASSERT_EQ(line.rfind("p.yaml", 0), 0u) << line << "\n" << text;
      ASSERT_EQ(line.find('\n'), std::string::npos) << line << "\n" << text;
    }
  }
  std::printf("%d of %d mutations are still profiles\n", good, kRounds);
  EXPECT_GT(good, kRounds / 50);
  EXPECT_LT(good, kRounds / 2);
}

}  // namespace
}  // namespace tagwrench

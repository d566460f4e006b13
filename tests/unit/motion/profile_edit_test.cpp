#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "host/motion/profile_config.h"
#include "tests/unit/motion/own_profile.h"

namespace tagwrench {
namespace {

using test::profile_of;

struct Change {
  const char* what;
  std::function<void(Profile&)> make;
};

/// One of each key that a page has a slider, a switch or a choice for.
std::vector<Change> changes() {
  std::vector<Change> all = {
      {"translation", [](Profile& p) { p.shaping.translation = 0.3; }},
      {"rotation", [](Profile& p) { p.shaping.rotation = 2.2; }},
      {"curve",
       [](Profile& p) {
         for (AxisOptions& axis : p.shaping.axes)
           axis.curve = {.kind = CurveKind::power, .power = 1.7};
       }},
      {"dominant, on", [](Profile& p) { p.shaping.dominant.on = !p.shaping.dominant.on; }},
      {"dominant, ratio", [](Profile& p) { p.shaping.dominant.ratio = 1.7; }},
      {"lock", [](Profile& p) { p.shaping.lock = Lock::translation; }},
      {"no filter", [](Profile& p) { p.shaping.filter = {.kind = FilterKind::none}; }},
      {"exponential",
       [](Profile& p) { p.shaping.filter = {.kind = FilterKind::exponential, .weight = 0.4}; }},
      {"one euro",
       [](Profile& p) { p.shaping.filter = {.kind = FilterKind::one_euro, .cutoff_hz = 3}; }},
      {"tap", [](Profile& p) { p.gestures.tap_force *= 1.21; }},
      {"press", [](Profile& p) { p.gestures.press_force *= 1.21; }},
      {"twist", [](Profile& p) { p.gestures.twist_torque *= 1.21; }},
      {"press time", [](Profile& p) { p.gestures.press_time = std::chrono::milliseconds(650); }},
  };
  for (std::size_t i = 0; i < 6; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    all.push_back({"full scale", [axis](Profile& p) { p.shaping.full_scale[axis] *= 1.5; }});
    all.push_back({"dead zone", [axis](Profile& p) { p.shaping.dead_zone[axis] *= 0.5; }});
    all.push_back(
        {"invert", [i](Profile& p) { p.shaping.axes[i].invert = !p.shaping.axes[i].invert; }});
  }
  return all;
}

std::vector<std::string> texts() {
  std::vector<std::string> all = {"name: bare\n", test::kMine, "{name: flow, lock: rotation}\n"};
  for (const ReadyProfile& ready : ready_profiles()) all.push_back(ready.text);
  return all;
}

TEST(ProfileEdit, EachChangeReadsBackAndCommentsStay) {
  for (const std::string& text : texts()) {
    const Profile before = profile_of(text);
    for (const Change& change : changes()) {
      Profile wanted = before;
      change.make(wanted);
      const std::string changed = with_changes(text, "mine.yaml", before, wanted);
      const Profile read = profile_of(changed);
      EXPECT_EQ(read.shaping, wanted.shaping) << change.what << " in\n" << changed;
      EXPECT_EQ(read.gestures, wanted.gestures) << change.what << " in\n" << changed;
      EXPECT_EQ(std::count(changed.begin(), changed.end(), '#'),
                std::count(text.begin(), text.end(), '#'))
          << changed;
    }
  }
}

TEST(ProfileEdit, WithoutAChangeTheTextStaysAsItWas) {
  const Profile before = profile_of(test::kMine);
  EXPECT_EQ(with_changes(test::kMine, "mine.yaml", before, before), test::kMine);
}

}  // namespace
}  // namespace tagwrench

#include "host/verbs/tune/knobs.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/unit/tune/tuned_profile.h"

namespace tagwrench {
namespace {

using test::profile_of;

std::size_t comments_in(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '#'));
}

const Knob& knob_called(const std::vector<Knob>& knobs, const std::string& label) {
  for (const Knob& knob : knobs) {
    if (knob.label == label) return knob;
  }
  throw std::runtime_error("no knob " + label);
}

std::vector<std::string> texts() {
  std::vector<std::string> all = {"name: bare\n", test::kMine, "{name: flow, lock: rotation}\n"};
  for (const ReadyProfile& ready : ready_profiles()) all.push_back(ready.text);
  return all;
}

TEST(Knobs, EachMoveIsWrittenSoThatItReadsBackAndCommentsStay) {
  for (const std::string& text : texts()) {
    const Profile before = profile_of(text);
    for (const Knob& knob : tuning_knobs(before)) {
      if (!knob.applies) continue;
      for (const int steps : {-3, -1, 1, 5}) {
        Profile wanted = before;
        knob.set(wanted, moved(knob, steps));
        const std::string changed = with_changes(text, "mine.yaml", before, wanted);
        const Profile read = with_unsaid(profile_of(changed), wanted);
        EXPECT_EQ(read.shaping, wanted.shaping) << knob.label << " in\n" << changed;
        EXPECT_EQ(read.gestures, wanted.gestures) << knob.label << " in\n" << changed;
        EXPECT_EQ(comments_in(changed), comments_in(text)) << changed;
      }
    }
  }
}

TEST(Knobs, WhatIsMovedBackLeavesTheTextAsItWas) {
  const Profile before = profile_of(test::kMine);
  EXPECT_EQ(with_changes(test::kMine, "mine.yaml", before, before), test::kMine);
}

TEST(Knobs, StopAtTheirEndsAndChoicesGoRound) {
  const Profile profile = profile_of(test::kMine);
  for (const Knob& knob : tuning_knobs(profile)) {
    if (knob.kind == Knob::Kind::choice) {
      EXPECT_EQ(moved(knob, static_cast<int>(knob.names.size())), knob.value) << knob.label;
      continue;
    }
    EXPECT_EQ(moved(knob, 1000), knob.highest) << knob.label;
    EXPECT_EQ(moved(knob, -1000), knob.lowest) << knob.label;
    EXPECT_GE(place(knob), 0) << knob.label;
    EXPECT_LE(place(knob), 1) << knob.label;
    if (!knob.applies) continue;
    Knob end = knob;
    for (const double value : {knob.lowest, knob.highest}) {
      end.value = value;
      Profile wanted = profile;
      end.set(wanted, value);
      EXPECT_NO_THROW(profile_of(with_changes(test::kMine, "mine.yaml", profile, wanted)))
          << knob.label << " at " << value;
    }
  }
}

TEST(Knobs, SayNewtonsOrNewtonMetresAsTheAxisIsFed) {
  const std::vector<Knob> knobs = tuning_knobs(profile_of(test::kMine));
  EXPECT_EQ(shown(knob_called(knobs, "full scale, x")), "0.5 N");
  EXPECT_EQ(shown(knob_called(knobs, "full scale, rx")), "0.6 N") << "it is fed from x";
  EXPECT_EQ(shown(knob_called(knobs, "dead zone, rx")), "0.01 N");
  EXPECT_TRUE(shown(knob_called(knobs, "full scale, ry")).ends_with(" mN m"));
  EXPECT_EQ(shown(knob_called(knobs, "one axis at a time")), "on");
  EXPECT_EQ(shown(knob_called(knobs, "  weight of the newest")), "-") << "of another filter";
}

}  // namespace
}  // namespace tagwrench

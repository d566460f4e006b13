#include "host/verbs/tune/tuning.h"

#include <gtest/gtest.h>

#include "tests/unit/tune/tuned_profile.h"

namespace tagwrench {
namespace {

using Wish = Tuning::Wish;
constexpr Key kUp{Key::Kind::up};
constexpr Key kDown{Key::Kind::down};
constexpr Key kLeft{Key::Kind::left};
constexpr Key kRight{Key::Kind::right};
constexpr Key kEnter{Key::Kind::enter};

/// With a line more, behind the last one that says something.
std::string mine_with(const std::string& line) {
  std::string text = test::kMine;
  return text.insert(text.find("# the end"), line + "\n");
}

class TuningTest : public testing::Test {
 protected:
  explicit TuningTest(const std::string& file = "mine.yaml")
      : tuning_({"mine", file, false, test::kMine, test::profile_of(test::kMine)}) {}

  /// In the sensor's place: what is tried comes in force.
  Wish press(Key key) {
    const Wish wish = tuning_.press(key);
    if (wish == Wish::attempt) tuning_.granted(test::profile_of(tuning_.text()));
    return wish;
  }
  Wish press(char character) { return press(Key{Key::Kind::character, character}); }
  double translation() const { return tuning_.profile().shaping.translation; }
  double rotation() const { return tuning_.profile().shaping.rotation; }

  Tuning tuning_;
};

class TuningWithoutFile : public TuningTest {
 protected:
  TuningWithoutFile() : TuningTest("") {}
  void type(const std::string& name) {
    for (int i = 0; i < 100; ++i) press(Key{Key::Kind::erase});
    for (const char c : name) press(c);
  }
};

TEST_F(TuningTest, AKeyMovesTheChosenKnobAndAsksForTheText) {
  EXPECT_FALSE(tuning_.unsaved());
  EXPECT_EQ(press(kRight), Wish::attempt);
  EXPECT_EQ(translation(), 1.1);
  EXPECT_EQ(tuning_.text(), mine_with("translation: 1.1"));
  EXPECT_TRUE(tuning_.unsaved());
  EXPECT_EQ(press(kDown), Wish::none);
  press(kLeft);
  EXPECT_EQ(rotation(), 0.909);
  press('k');
  press('h');
  EXPECT_EQ(translation(), 1);
  EXPECT_EQ(tuning_.text(), mine_with("rotation: 0.909"));
  press(kUp);
  EXPECT_EQ(tuning_.chosen(), tuning_.knobs().size() - 1) << "round";
}

TEST_F(TuningTest, SpaceSwitches) {
  EXPECT_EQ(press(' '), Wish::none) << "no slider";
  for (int i = 0; i < 3; ++i) press(kDown);
  ASSERT_TRUE(tuning_.profile().shaping.dominant.on);
  EXPECT_EQ(press(' '), Wish::attempt);
  EXPECT_FALSE(tuning_.profile().shaping.dominant.on);
  press(kDown);
  EXPECT_EQ(press(kRight), Wish::none) << "its ratio does not apply now";
  EXPECT_FALSE(tuning_.line().empty());
}

TEST_F(TuningTest, AFilterThatIsTriedOffComesBackWithItsOwnNumbers) {
  const std::string text = "name: mine\nfilter: {kind: one_euro, cutoff_hz: 7}\n";
  tuning_ = Tuning({"mine", "mine.yaml", false, text, test::profile_of(text)});
  while (tuning_.knobs()[tuning_.chosen()].label != "filter") press(kDown);
  press(kRight);
  EXPECT_EQ(tuning_.profile().shaping.filter.kind, FilterKind::none);
  press(kLeft);
  EXPECT_EQ(tuning_.profile().shaping.filter.cutoff_hz, 7);
  EXPECT_FALSE(tuning_.unsaved());
}

TEST_F(TuningTest, UndoTakesBackAKnobsMovesTogetherThenTheEarlierOnes) {
  press(kRight);
  press(kRight);
  press(kDown);
  press(kRight);
  EXPECT_EQ(press('u'), Wish::attempt);
  EXPECT_EQ(rotation(), 1);
  EXPECT_EQ(translation(), 1.21);
  EXPECT_EQ(press('u'), Wish::attempt);
  EXPECT_EQ(translation(), 1);
  EXPECT_FALSE(tuning_.unsaved());
  EXPECT_EQ(press('u'), Wish::none);
  EXPECT_EQ(tuning_.line(), "nothing to undo");
}

TEST_F(TuningTest, WhatTheSensorRefusesIsAsItWas) {
  press(kRight);
  ASSERT_EQ(tuning_.press(kRight), Wish::attempt);
  tuning_.refused("mine.yaml:3: no");
  EXPECT_EQ(translation(), 1.1);
  EXPECT_EQ(tuning_.line(), "mine.yaml:3: no");
  EXPECT_EQ(press('s'), Wish::save);
  EXPECT_EQ(tuning_.text(), mine_with("translation: 1.1"));
}

TEST_F(TuningTest, WhereTheProfileSaysOtherwiseTheViewShowsWhatIsInForce) {
  const std::string text = "name: mine\naxes: {x: {curve: {power: 2}}, y: {curve: {power: 3}}}\n";
  Tuning tuning({"mine", "mine.yaml", false, text, test::profile_of(text)});
  tuning.press(kDown);
  tuning.press(kDown);
  ASSERT_EQ(tuning.press(kRight), Wish::attempt);
  tuning.granted(test::profile_of(tuning.text()));
  EXPECT_EQ(tuning.profile().shaping.axes[0].curve.power, 2) << "its own, whatever the root says";
  EXPECT_FALSE(tuning.line().empty());
}

TEST_F(TuningTest, IsSavedToItsFile) {
  press(kRight);
  EXPECT_EQ(press('s'), Wish::save);
  EXPECT_FALSE(tuning_.new_file());
  EXPECT_EQ(tuning_.saved(), Wish::none);
  EXPECT_FALSE(tuning_.unsaved());
  EXPECT_EQ(tuning_.line(), "saved: mine.yaml");
  EXPECT_EQ(press('q'), Wish::leave);
}

TEST_F(TuningTest, LeavingAsksIfSomethingIsNotSaved) {
  press(kRight);
  EXPECT_EQ(press('q'), Wish::none);
  EXPECT_EQ(press('x'), Wish::none) << "any other key stays";
  EXPECT_EQ(tuning_.mode(), Tuning::Mode::moving);
  press('q');
  EXPECT_EQ(press('q'), Wish::leave);
  press('x');
  press('q');
  EXPECT_EQ(press('s'), Wish::save);
  EXPECT_EQ(tuning_.saved(), Wish::leave);
}

TEST_F(TuningTest, ControlCLeavesAtOnce) {
  press(kRight);
  EXPECT_EQ(press(Key{Key::Kind::stop}), Wish::leave);
}

TEST_F(TuningTest, AProfileThatIsNotWhatWasSavedIsTheBeginning) {
  Profile kept = tuning_.profile();
  kept.shaping.rotation = 3;
  ASSERT_EQ(tuning_.start_from(kept), Wish::attempt);
  tuning_.granted(test::profile_of(tuning_.text()));
  EXPECT_EQ(rotation(), 3);
  EXPECT_TRUE(tuning_.unsaved());
}

TEST_F(TuningWithoutFile, IsSavedUnderANameThatIsAskedFor) {
  press(kRight);
  EXPECT_EQ(press('s'), Wish::none);
  EXPECT_EQ(tuning_.line(), "save as (Return; Esc: not): mine-mine.yaml_");
  type("/tmp/q s/easy.yaml");
  EXPECT_EQ(press(kEnter), Wish::save);
  EXPECT_EQ(tuning_.file(), "/tmp/q s/easy.yaml");
  EXPECT_TRUE(tuning_.new_file());
  const Profile read = test::profile_of(tuning_.text());
  EXPECT_EQ(read.name, "easy") << "two of one name cannot run";
  EXPECT_EQ(read.shaping.translation, 1.1);
  tuning_.saved();
  EXPECT_FALSE(tuning_.unsaved());
  press(kRight);
  EXPECT_EQ(press('s'), Wish::save) << "from now on it has a file";
  EXPECT_FALSE(tuning_.new_file());
}

TEST_F(TuningWithoutFile, ANameThatWillNotDoIsAskedForAgain) {
  press(kRight);
  press('s');
  type("");
  EXPECT_EQ(press(kEnter), Wish::none);
  press('s');
  type("there.yaml");
  EXPECT_EQ(press(kEnter), Wish::save);
  tuning_.refused("there.yaml: is there already");
  EXPECT_EQ(tuning_.file(), "");
  EXPECT_TRUE(tuning_.unsaved());
  press('s');
  EXPECT_EQ(tuning_.mode(), Tuning::Mode::naming);
  press(Key{Key::Kind::escape});
  EXPECT_EQ(tuning_.mode(), Tuning::Mode::moving);
  EXPECT_EQ(translation(), 1.1);
}

}  // namespace
}  // namespace tagwrench

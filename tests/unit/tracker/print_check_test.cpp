// Another tag of the family, most of whose bits are those of the target's, is not the target; a tag
// that is dirty is.
#include "host/tracker/print_check.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <string>

#include "host/tracker/reference.h"
#include "host/tracker/tracker.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

std::vector<std::string> rows_of(TagFamily family, int id) {
  const TagPattern pattern = tag_pattern(family, id, 1, 0);
  std::vector<std::string> rows(static_cast<std::size_t>(pattern.cells));
  for (int row = 0; row < pattern.cells; ++row)
    for (int column = 0; column < pattern.cells; ++column)
      rows[static_cast<std::size_t>(row)] += pattern.is_white(row, column) ? '.' : '#';
  return rows;
}

/// The roof with these tags of a family on it.
render::Scene printed(TagFamily family, int upper, int lower) {
  render::Scene scene = render::roof();
  scene.tags[0].rows = rows_of(family, upper);
  scene.tags[1].rows = rows_of(family, lower);
  return scene;
}

/// Of tags 5 and 2.
struct TwoTags {
  TagFamily family;
  bool given;  ///< places, rest pose and picture, of `at_rest`
  std::mt19937 random{3};
  TargetDescription target{};
  ReferenceOptions rest{};

  TwoTags(TagFamily of, bool all_given, const render::Scene& at_rest)
      : family(of), given(all_given) {
    target.family = family;
    if (!given) return;
    for (std::size_t t = 0; t < 2; ++t)
      target.tags[t].platform_T_tag =
          render::rest_pose(at_rest).inverse() * at_rest.tags[t].camera_T_tag;
    rest.camera_T_platform = render::rest_pose(at_rest);
    rest.appearance =
        ReferenceImage{at_rest.width, at_rest.height, 25, render::rest_picture(at_rest)};
  }
};

struct PrintShown {
  int ok = 0;
  std::vector<Track> said;
};

class PrintPlayer {
 public:
  PrintPlayer(const TwoTags& bench, const render::Scene& scene)
      : tracker_(render::camera_of(scene), bench.target, bench.rest) {}

  PrintShown show(const render::Scene& scene, int frames) {
    PrintShown out;
    const std::vector<float> light = render::expose(scene, Vector6::Zero());
    for (int i = 0; i < frames; ++i) {
      const render::Picture picture = render::develop(scene, light, random_);
      Frame frame;
      frame.image = picture.view();
      frame.capture_time = TimePoint{} + std::chrono::milliseconds(40) * shown_++;
      const Track track = tracker_.track(frame);
      out.ok += track.status == Status::ok ? 1 : 0;
      if (track.diagnostic != Diagnostic::none && track.diagnostic != Diagnostic::rest_learned)
        out.said.push_back(track);
    }
    return out;
  }

 private:
  Tracker tracker_;
  std::mt19937 random_{4};
  int shown_ = 0;
};

struct Replaced {
  TagFamily family;
  bool given;
};

class AnotherTag : public testing::TestWithParam<Replaced> {};

TEST_P(AnotherTag, IsRefusedAndNamed) {
  const auto [family, given] = GetParam();
  const render::Scene right = printed(family, 5, 2);
  for (const int lower : {false, true}) {
    const render::Scene wrong = lower != 0 ? printed(family, 5, 7) : printed(family, 7, 2);
    const TwoTags bench(family, given, right);
    PrintPlayer player(bench, right);
    if (!given) {
      EXPECT_GT(player.show(right, 40).ok, 10);
    }
    const PrintShown shown = player.show(wrong, 100);
    // Learned and held, the sheet is exchanged between two looks.
    EXPECT_LE(shown.ok, given ? 0 : 16);
    ASSERT_FALSE(shown.said.empty());
    const Track& said = shown.said.front();
    const std::string text = diagnostic_text(said.diagnostic, said.details);
    EXPECT_NE(text.find("tag 7 is seen"), std::string::npos) << text;
    EXPECT_NE(text.find(lower != 0 ? "has tag 2" : "has tag 5"), std::string::npos) << text;
    EXPECT_NE(text.find("calibrate target"), std::string::npos) << text;
    EXPECT_EQ(shown.said.size(), 1U);
    // Put right, it goes on.
    EXPECT_GE(player.show(right, 10).ok, 9);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, AnotherTag,
                         testing::Values(Replaced{TagFamily::aruco_original, true},
                                         Replaced{TagFamily::aruco_4x4_50, true},
                                         Replaced{TagFamily::aruco_4x4_1000, true},
                                         Replaced{TagFamily::apriltag_36h11, true},
                                         Replaced{TagFamily::grid_10x10, true},
                                         Replaced{TagFamily::aruco_original, false},
                                         Replaced{TagFamily::aruco_4x4_50, false}),
                         [](const auto& param) {
                           return std::string(name(param.param.family)) +
                                  (param.param.given ? "_given" : "_learned");
                         });

TEST(PrintCheck, EveryIdOfAFamilyIsToldFromEveryOther) {
  const render::Scene scene = render::roof();
  for (const TagFamily family : {TagFamily::aruco_original, TagFamily::aruco_4x4_50,
                                 TagFamily::aruco_4x4_250, TagFamily::apriltag_36h11}) {
    std::vector<TagPattern> patterns;
    for (int id = 0; id < 12; ++id)
      patterns.push_back(tag_pattern(family, id, scene.tags[0].size, scene.tags[0].border));
    const PrintCheck check(render::camera_of(scene), family, patterns);
    for (int id = 0; id < 12; ++id) {
      render::Scene shown = scene;
      shown.tags[0].rows = rows_of(family, id);
      const std::vector<float> light = render::rest_picture(shown);
      for (std::size_t t = 0; t < patterns.size(); ++t) {
        const PrintReading seen = check.read({light.data(), scene.width, scene.height, scene.width},
                                             t, scene.tags[0].camera_T_tag);
        EXPECT_EQ(seen.verdict == PrintReading::Verdict::agrees, static_cast<int>(t) == id);
        EXPECT_EQ(seen.other_id, id) << name(family) << " as " << t;
      }
    }
  }
}

TEST(PrintCheck, AnyCellThatIsCoveredLeavesTheTagHeld) {
  const render::Scene right = printed(TagFamily::aruco_4x4_50, 5, 2);
  const TwoTags bench(TagFamily::aruco_4x4_50, true, right);
  for (int cell = 0; cell < 16; ++cell) {
    render::Scene dirty = right;
    char& ink =
        dirty.tags[0]
            .rows[static_cast<std::size_t>(1 + cell / 4)][static_cast<std::size_t>(1 + cell % 4)];
    ink = ink == '#' ? '.' : '#';
    PrintPlayer player(bench, right);
    const PrintShown shown = player.show(dirty, 20);
    EXPECT_GE(shown.ok, 19) << cell;  // the first may not be found near enough
    EXPECT_TRUE(shown.said.empty()) << cell;
  }
}

/// Grey of a hand over all columns of a picture from `first` on.
void cover(std::vector<float>& light, int width, int first) {
  for (std::size_t p = 0; p < light.size(); ++p)
    if (static_cast<int>(p) % width >= first) light[p] = 70;
}

TEST(PrintCheck, AHandThatComesOverATagDoesNotMakeItAnother) {
  const render::Scene scene = render::roof();
  for (const TagFamily family : {TagFamily::aruco_original, TagFamily::aruco_4x4_1000}) {
    for (const int id : {2, 5, 17}) {
      render::Scene shown = scene;
      shown.tags[0].rows = rows_of(family, id);
      const PrintCheck check(render::camera_of(scene), family,
                             {tag_pattern(family, id, scene.tags[0].size, scene.tags[0].border)});
      const std::vector<float> clear = render::rest_picture(shown);
      for (int first = 180; first < 460; first += 4) {
        std::vector<float> light = clear;
        cover(light, scene.width, first);
        const PrintReading seen = check.read({light.data(), scene.width, scene.height, scene.width},
                                             0, scene.tags[0].camera_T_tag);
        EXPECT_NE(seen.verdict, PrintReading::Verdict::other) << first << " as " << seen.other_id;
      }
    }
  }
}

TEST(PrintCheck, PictureAtRestOfAnotherTagDoesNotFit) {
  for (const TagFamily family : {TagFamily::aruco_original, TagFamily::aruco_4x4_50}) {
    const render::Scene wrong = printed(family, 7, 2);
    const TwoTags bench(family, true, wrong);
    const auto mismatch = check_appearance(render::camera_of(wrong), bench.target, bench.rest);
    ASSERT_TRUE(mismatch) << name(family);
    EXPECT_EQ(mismatch->id, 5);
    EXPECT_EQ(mismatch->seen_id, 7);
  }
}

}  // namespace
}  // namespace tagwrench

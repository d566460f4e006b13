// Why the target is not held: each cause on pictures that have it, and none on those that do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "host/tracker/diagnostics.h"
#include "host/tracker/tracker.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

using render::Picture;
using render::Scene;
using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(100);
constexpr int kLook = 25;  ///< frames, 2.5 s

TargetDescription target_of(TagFamily family, const std::vector<int>& ids) {
  TargetDescription target;
  target.family = family;
  target.tags.clear();
  for (const int id : ids) target.tags.push_back({id, {}, Vector6::Zero()});
  return target;
}

TargetDescription roof_target() { return target_of(TagFamily::aruco_original, {5, 2}); }

/// The roof's tags placed where `scene` has them.
TargetDescription placed_target(const Scene& scene) {
  TargetDescription target = roof_target();
  for (std::size_t t = 0; t < 2; ++t)
    target.tags[t].platform_T_tag = render::rest_pose(scene).inverse() * scene.tags[t].camera_T_tag;
  return target;
}

DiagnosticDetails::Ids ids(const std::vector<int>& list) {
  DiagnosticDetails::Ids out;
  for (const int id : list) out.add(id);
  return out;
}

/// A tracker and all that it said.
struct Watch {
  Tracker tracker;
  std::mt19937 random{17};
  int shown = 0;
  Track last;
  std::vector<Track> said;

  explicit Watch(const Scene& scene, const TargetDescription& target = roof_target(),
                 const ReferenceOptions& rest = {5, {}, {}})
      : tracker(render::camera_of(scene), target, rest) {}

  void show(const Picture& picture, int frames = 1) {
    for (int i = 0; i < frames; ++i) {
      Frame frame;
      frame.image = picture.view();
      frame.capture_time = TimePoint{} + kPeriod * shown++;
      last = tracker.track(frame);
      if (last.diagnostic != Diagnostic::none) said.push_back(last);
    }
  }
  Picture take(const Scene& scene, const Vector6& displacement = Vector6::Zero()) {
    return render::take(scene, displacement, random);
  }
  void hold(const Scene& scene) {
    const std::vector<float> light = render::expose(scene, Vector6::Zero());
    for (int i = 0; i < 8; ++i) show(render::develop(scene, light, random));
    ASSERT_EQ(last.status, Status::ok);
    said.clear();
  }
  /// That, and nothing else.
  DiagnosticDetails only(Diagnostic diagnostic) const {
    EXPECT_EQ(said.size(), 1U);
    if (said.size() != 1) {
      for (const Track& track : said)
        ADD_FAILURE() << "said " << static_cast<int>(track.diagnostic);
      return {};
    }
    EXPECT_EQ(static_cast<int>(said.front().diagnostic), static_cast<int>(diagnostic));
    return said.front().details;
  }
};

DiagnosticDetails look(const Picture& picture, Diagnostic diagnostic,
                       const Scene& scene = render::roof(),
                       const TargetDescription& target = roof_target(),
                       const ReferenceOptions& rest = {5, {}, {}}) {
  Watch watch(scene, target, rest);
  watch.show(picture, kLook);
  return watch.only(diagnostic);
}

Picture roof_picture(const Scene& scene = render::roof()) {
  std::mt19937 random(3);
  return render::take(scene, Vector6::Zero(), random);
}

/// A picture made pixel by pixel, with noise.
Picture paint(const std::function<double(int x, int y)>& level, double noise = 2) {
  Picture picture{640, 480, std::vector<std::uint8_t>(640 * 480)};
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, noise);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      picture.pixels[static_cast<std::size_t>(640 * y + x)] =
          static_cast<std::uint8_t>(std::clamp(level(x, y) + normal(random), 0.0, 255.0));
    }
  }
  return picture;
}

Picture repaint(const Picture& from, const std::function<double(double)>& level) {
  return paint(
      [&](int x, int y) { return level(from.pixels[static_cast<std::size_t>(640 * y + x)]); }, 0);
}

Picture blurred(const Picture& from, double sigma_px) {
  Picture out = from;
  const cv::Mat in(480, 640, CV_8UC1, const_cast<std::uint8_t*>(from.pixels.data()));
  cv::Mat result(480, 640, CV_8UC1, out.pixels.data());
  cv::GaussianBlur(in, result, {}, sigma_px);
  return out;
}

/// Covers all rows from `top` on.
Picture covered(Picture picture, int top) {
  std::fill(picture.pixels.begin() + top * 640, picture.pixels.end(), std::uint8_t{90});
  return picture;
}

/// Boards, squares and discs, sharp: a workshop, but no tags.
double workshop(int x, int y) {
  if (x < 200 && y < 200) return (x / 25 + y / 25) % 2 == 0 ? 210 : 40;
  if (x > 300 && x < 420 && y > 60 && y < 180) return 30;
  if (std::hypot(x - 450, y - 350) < 70) return 35;
  if (x > 80 && x < 240 && y > 280 && y < 440)
    return x > 110 && x < 210 && y > 310 && y < 410 ? 200 : 45;
  return 150 + 40 * std::sin(0.02 * x) + 10 * std::sin(0.4 * y);
}

TEST(Diagnosis, LensCapOrNoLight) {
  EXPECT_LT(look(paint([](int, int) { return 6; }, 3), Diagnostic::image_black).amount, 40);
}

TEST(Diagnosis, TooMuchLight) {
  const Picture washed_out = repaint(roof_picture(), [](double level) { return level + 220; });
  EXPECT_GT(look(washed_out, Diagnostic::image_saturated).amount, 0.4);
}

TEST(Diagnosis, SomethingRightBeforeTheLens) {
  look(paint([](int, int) { return 120; }), Diagnostic::image_empty);
  look(paint([](int x, int y) { return 60 + 0.1 * x + 0.1 * y; }), Diagnostic::image_empty);
}

TEST(Diagnosis, FocusLost) {
  for (const double sigma_px : {9.0, 11.0}) {
    const double blur_px =
        look(blurred(roof_picture(), sigma_px), Diagnostic::image_unsharp).amount;
    EXPECT_NEAR(blur_px, sigma_px, 0.5 * sigma_px);
  }
}

TEST(Diagnosis, NoTagInAPictureThatIsFine) {
  const DiagnosticDetails details = look(paint(workshop), Diagnostic::no_tag);
  EXPECT_EQ(details.expected, ids({5, 2}));
  EXPECT_EQ(details.expected_family, "aruco_original");
}

TEST(Diagnosis, TagsOfAnotherFamilyAreNamed) {
  const Scene april = render::alone(render::april_seven());
  const DiagnosticDetails one = look(roof_picture(april), Diagnostic::wrong_family, april);
  EXPECT_EQ(one.family, "apriltag_36h11");
  EXPECT_EQ(one.seen, ids({7}));
  EXPECT_EQ(one.expected_family, "aruco_original");
  for (const bool mirrored : {false, true}) {
    Scene roof = render::roof();
    roof.mirrored = mirrored;
    DiagnosticDetails two = look(roof_picture(roof), Diagnostic::wrong_family, roof,
                                 target_of(TagFamily::apriltag_36h11, {5, 2}));
    EXPECT_EQ(two.family, "aruco_original");
    std::sort(two.seen.id.begin(), two.seen.id.begin() + two.seen.count);
    EXPECT_EQ(two.seen, ids({2, 5}));
  }
}

TEST(Diagnosis, OtherIdsThanDescribed) {
  const DiagnosticDetails all = look(roof_picture(), Diagnostic::wrong_ids, render::roof(),
                                     target_of(TagFamily::aruco_original, {17, 18}));
  EXPECT_EQ(all.seen.count, 2);
  EXPECT_EQ(all.expected, ids({17, 18}));
  const DiagnosticDetails half = look(roof_picture(), Diagnostic::wrong_ids, render::roof(),
                                      target_of(TagFamily::aruco_original, {5, 18}));
  EXPECT_EQ(half.seen, ids({5, 2}));
  EXPECT_EQ(half.concerned, ids({18}));
}

TEST(Diagnosis, OneOfTwoTags) {
  const DiagnosticDetails details = look(covered(roof_picture(), 245), Diagnostic::tag_missing);
  EXPECT_EQ(details.seen, ids({5}));
  EXPECT_EQ(details.concerned, ids({2}));
}

TEST(Diagnosis, OneIdTwice) {
  Scene scene = render::roof();
  scene.tags[1].rows = scene.tags[0].rows;
  EXPECT_EQ(look(roof_picture(scene), Diagnostic::tag_twice).concerned, ids({5}));
}

TEST(Diagnosis, OneTagPrintedMirrored) {
  Scene scene = render::roof();
  for (std::string& row : scene.tags[1].rows) std::reverse(row.begin(), row.end());
  const DiagnosticDetails details = look(roof_picture(scene), Diagnostic::tag_printed_mirrored);
  EXPECT_EQ(details.concerned, ids({2}));
  EXPECT_EQ(details.seen, ids({5}));
}

TEST(Diagnosis, AMirroredImageIsLeftToTheHintThatSaysSo) {
  Scene flipped = render::roof();
  flipped.mirrored = true;
  Watch watch(render::roof());
  watch.show(roof_picture(flipped), kLook);
  ASSERT_FALSE(watch.said.empty());
  for (const Track& track : watch.said)
    EXPECT_EQ(track.diagnostic, Diagnostic::image_looks_mirrored);
}

/// Tags printed at another scale and glued at the same centres.
Scene printed_at(double scale) {
  Scene scene = render::roof();
  for (render::PrintedTag& tag : scene.tags) tag.size *= scale;
  return scene;
}

TEST(Diagnosis, TagsPrintedAtAnotherScale) {
  const Scene described = render::roof();
  for (const double scale : {0.9, 0.94, 1.06, 1.1}) {
    for (const bool rest_given : {false, true}) {
      ReferenceOptions rest{5, {}, {}};
      if (rest_given) rest.camera_T_platform = render::rest_pose(described);
      const Picture picture = roof_picture(printed_at(scale));
      const DiagnosticDetails details =
          look(picture, Diagnostic::other_scale, described, placed_target(described), rest);
      EXPECT_NEAR(details.amount, scale, 0.01) << rest_given;
    }
  }
  ReferenceOptions rest{5, render::rest_pose(described), {}};
  Watch watch(described, placed_target(described), rest);
  watch.show(roof_picture(printed_at(1.01)), kLook);
  EXPECT_TRUE(watch.said.empty()) << "a printer's tolerance";
}

TEST(Diagnosis, TagsInEachOthersPlaces) {
  const Scene described = render::roof();
  Scene swapped = described;
  std::swap(swapped.tags[0].camera_T_tag, swapped.tags[1].camera_T_tag);
  ReferenceOptions rest{5, render::rest_pose(described), {}};
  look(roof_picture(swapped), Diagnostic::other_places, described, placed_target(described), rest);
}

TEST(Diagnosis, RestPoseElsewhere) {
  const Scene scene = render::roof();
  ReferenceOptions rest{5, render::rest_pose(scene), {}};
  rest.camera_T_platform->translation() += Eigen::Vector3d(-16e-3, 0, 3e-3);
  const DiagnosticDetails details =
      look(roof_picture(), Diagnostic::rest_elsewhere, scene, placed_target(scene), rest);
  EXPECT_NEAR(details.offset[0], 16e-3, 0.3e-3);
  EXPECT_NEAR(details.offset[1], 0, 0.3e-3);
  EXPECT_NEAR(details.offset[2], -3e-3, 0.3e-3);
  EXPECT_TRUE(details.rest_given);
}

TEST(Diagnosis, HeldButFarFromTheGivenRest) {
  const Scene scene = render::roof();
  ReferenceOptions rest{5, render::rest_pose(scene), {}};
  rest.camera_T_platform->translation().x() -= 0.8e-3;
  Watch watch(scene, placed_target(scene), rest);
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  for (int i = 0; i < 2 * kLook; ++i) watch.show(render::develop(scene, light, watch.random));
  EXPECT_NEAR(watch.only(Diagnostic::far_from_rest).offset[0], 0.8e-3, 0.05e-3);
  EXPECT_EQ(watch.last.status, Status::ok);
}

TEST(Diagnosis, HeldButFarFromTheGivenRestAfterAPushAndAHandBeforeTheLens) {
  const Scene scene = render::roof();
  ReferenceOptions rest{5, render::rest_pose(scene), {}};
  rest.camera_T_platform->translation().x() -= 0.8e-3;
  Watch watch(scene, placed_target(scene), rest);
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  for (int i = 0; i < kLook; ++i) {
    watch.show(render::develop(scene, light, watch.random));
    if (i == kLook / 3) watch.show(paint([](int, int) { return 90; }));
    if (i == kLook / 2)
      watch.show(watch.take(scene, (Vector6() << 0, 1e-4, 0, 0, 0, 0).finished()));
  }
  EXPECT_TRUE(watch.said.empty());  // it has not stood still for long
  for (int i = 0; i < 2 * kLook; ++i) watch.show(render::develop(scene, light, watch.random));
  EXPECT_NEAR(watch.only(Diagnostic::far_from_rest).offset[0], 0.8e-3, 0.05e-3);
}

TEST(Diagnosis, NearTheGivenRestNothingIsSaid) {
  const Scene scene = render::roof();
  ReferenceOptions rest{5, render::rest_pose(scene), {}};
  rest.camera_T_platform->translation().x() -= 0.1e-3;
  Watch watch(scene, placed_target(scene), rest);
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  for (int i = 0; i < 2 * kLook; ++i) watch.show(render::develop(scene, light, watch.random));
  // Pushed and held there.
  const Vector6 pushed = (Vector6() << 0.8e-3, 0, 0, 0, 0, 0).finished();
  const std::vector<float> away = render::expose(scene, pushed);
  for (int i = 0; i < kLook; ++i) watch.show(render::develop(scene, away, watch.random));
  EXPECT_TRUE(watch.said.empty());
  EXPECT_EQ(watch.last.status, Status::ok);
}

TEST(Diagnosis, AHandThatPassesBySaysNothing) {
  const Scene scene = render::roof();
  Watch watch(scene);
  watch.hold(scene);
  const Picture fine = watch.take(scene);
  for (int i = 0; i < 4; ++i) {
    watch.show(paint([](int, int) { return 90; }), 6);
    watch.show(fine, 2);
    EXPECT_EQ(watch.last.status, Status::ok);
  }
  EXPECT_TRUE(watch.said.empty());
}

TEST(Diagnosis, SaidOnceAndAgainWhenItComesBackAfterTheTargetWasHeld) {
  const Scene scene = render::roof();
  Watch watch(scene);
  watch.hold(scene);
  const Picture fine = watch.take(scene);
  const Picture none = paint(workshop);
  watch.show(none, 2 * kLook);
  EXPECT_EQ(watch.said.size(), 1U);
  watch.show(fine, 5);
  EXPECT_EQ(watch.last.status, Status::ok);
  watch.show(none, kLook);
  ASSERT_EQ(watch.said.size(), 2U);
  for (const Track& track : watch.said) EXPECT_EQ(track.diagnostic, Diagnostic::no_tag);
  watch.show(paint([](int, int) { return 4; }), kLook);
  ASSERT_EQ(watch.said.size(), 3U);
  EXPECT_EQ(watch.said.back().diagnostic, Diagnostic::image_black);
}

TEST(Diagnosis, ALongRestIsNotATrouble) {
  const Scene scene = render::roof();
  Watch watch(scene, roof_target(), {40, {}, {}});
  const std::vector<float> light = render::expose(scene, Vector6::Zero());
  for (int i = 0; i < 39; ++i) watch.show(render::develop(scene, light, watch.random));
  EXPECT_TRUE(watch.said.empty());
}

TEST(Diagnosis, GarbageOfAnySizeIsNoCrash) {
  CameraModel camera;
  camera.width_px = 3;
  camera.height_px = 2;
  Tracker tracker(camera, roof_target(), {});
  const Picture tiny{3, 2, std::vector<std::uint8_t>(6, 128)};
  for (int i = 0; i < kLook; ++i) {
    Frame frame;
    frame.image = tiny.view();
    frame.capture_time = TimePoint{} + kPeriod * i;
    EXPECT_EQ(tracker.track(frame).status, Status::acquiring);
  }
}

}  // namespace
}  // namespace tagwrench

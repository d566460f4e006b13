#include "host/calibration/check/in_situ.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <initializer_list>

namespace tagwrench {
namespace {

Vector6 range() { return (Vector6() << 1, 1, 3, 0.02, 0.02, 0.01).finished(); }

/// Two tags on a roof, all as it was when calibrated, the platform where drift has brought it.
AtRest healthy() {
  AtRest rest;
  rest.frames = 50;
  rest.rest_frames = 25;
  for (const int side : {-1, 1}) {
    TagAtRest tag;
    tag.id = side < 0 ? 2 : 5;
    tag.held = true;
    tag.centre << 0, side * 2.2e-3, 0.5e-3;
    tag.displacement << 3e-6, -2e-6, 8e-6, 1e-3, 0, -1e-3;
    tag.covariance.diagonal() << 1e-14, 1e-14, 1e-12, 1e-8, 1e-8, 1e-9;
    tag.residual_fraction = 0.01;
    rest.tags.push_back(tag);
  }
  rest.now = rest.then = {.white_counts = 180, .clipped_fraction = 0.01, .blur_px = 1.2};
  rest.held = true;
  rest.residual_fraction = 0.01;
  rest.wrench = 0.01 * range();
  rest.range = range();
  return rest;
}

InSituFinding find(const AtRest& rest, Subject subject) {
  for (const InSituFinding& f : judge(rest)) {
    if (f.subject == subject) return f;
  }
  ADD_FAILURE() << "no such subject";
  return {};
}

/// Exactly these are not fine.
void expect_only(const AtRest& rest, std::initializer_list<Subject> wrong) {
  for (const InSituFinding& f : judge(rest)) {
    const bool expected = std::find(wrong.begin(), wrong.end(), f.subject) != wrong.end();
    EXPECT_EQ(f.fine(), !expected) << static_cast<int>(f.subject);
  }
}

TEST(InSitu, ASensorAsItWasCalibratedIsFine) {
  EXPECT_EQ(judge(healthy()).size(), 5u);
  expect_only(healthy(), {});
}

TEST(InSitu, TheTagThatIsFarFromRestHasSlipped) {
  for (const std::size_t slipped : {0u, 1u}) {
    AtRest rest = healthy();
    rest.tags[slipped].displacement[0] += 20e-6;
    expect_only(rest, {Subject::tags, Subject::zero});
    EXPECT_EQ(find(rest, Subject::zero).fault, Fault::not_known) << "not to be zeroed away";
    const InSituFinding f = find(rest, Subject::tags);
    EXPECT_EQ(f.fault, Fault::tag_moved);
    EXPECT_EQ(f.tag, rest.tags[slipped].id);
    EXPECT_NEAR(f.move[0], 20e-6, 1e-9);  // m
  }
}

TEST(InSitu, ATurnOfATagInItsPlaneIsASlipToo) {
  AtRest rest = healthy();
  // About its own centre, which stays.
  const Eigen::Vector3d turn(0, 0, 8e-3);
  rest.tags[1].displacement.tail<3>() += turn;
  rest.tags[1].displacement.head<3>() -= turn.cross(rest.tags[1].centre);
  const InSituFinding f = find(rest, Subject::tags);
  EXPECT_EQ(f.fault, Fault::tag_moved);
  EXPECT_EQ(f.tag, 5);
  EXPECT_LT(f.move.head<3>().norm(), 2e-6);  // m
}

TEST(InSitu, ThePlatformMayMoveButItsTagsMoveAlike) {
  AtRest rest = healthy();
  for (TagAtRest& tag : rest.tags)
    tag.displacement += (Vector6() << 50e-6, -30e-6, 80e-6, 4e-3, -5e-3, 2e-3).finished();
  EXPECT_TRUE(find(rest, Subject::tags).fine());
}

TEST(InSitu, WhereBothAreFarFromRestNobodyIsAccused) {
  AtRest rest = healthy();
  rest.tags[0].displacement[0] = -20e-6;
  rest.tags[1].displacement[0] = 20e-6;
  EXPECT_EQ(find(rest, Subject::tags).fault, Fault::some_tag_moved);
}

TEST(InSitu, OfThreeTagsTheOthersAgreement) {
  AtRest rest = healthy();
  TagAtRest third = rest.tags[0];
  third.id = 7;
  third.centre << 4e-3, 0, 0;
  rest.tags.push_back(third);
  // The platform stands far from rest; the tag that slipped happens to be near it.
  for (TagAtRest& tag : rest.tags) tag.displacement[1] += 60e-6;
  rest.tags[1].displacement[1] -= 60e-6;
  const InSituFinding f = find(rest, Subject::tags);
  EXPECT_EQ(f.fault, Fault::tag_moved);
  EXPECT_EQ(f.tag, 5);
}

TEST(InSitu, NoiseOfATagIsNoSlip) {
  AtRest rest = healthy();
  rest.tags[0].covariance *= 1e6;  // 0.1 mm a frame
  rest.tags[0].displacement[0] += 20e-6;
  EXPECT_TRUE(find(rest, Subject::tags).fine());
}

TEST(InSitu, ATagThatIsNotHeldIsNamedAndOneAloneIsNotJudged) {
  AtRest rest = healthy();
  rest.tags[1].held = false;
  EXPECT_EQ(find(rest, Subject::tags).fault, Fault::tag_not_seen);
  EXPECT_EQ(find(rest, Subject::tags).tag, 5);
  rest.tags.pop_back();
  EXPECT_EQ(find(rest, Subject::tags).fault, Fault::not_known);
}

TEST(InSitu, BlurThatHasChangedIsAMovedLens) {
  for (const double change : {0.5, -0.5}) {  // px^2
    AtRest rest = healthy();
    for (TagAtRest& tag : rest.tags) tag.blur_px2 = change;
    expect_only(rest, {Subject::focus});
  }
  AtRest lost = healthy();
  for (TagAtRest& tag : lost.tags) tag.held = false;
  lost.held = false;
  EXPECT_TRUE(find(lost, Subject::focus).fine());
  lost.now.blur_px = 3;
  const InSituFinding f = find(lost, Subject::focus);
  EXPECT_EQ(f.fault, Fault::out_of_focus);
  EXPECT_EQ(f.expected, 1.2);
}

TEST(InSitu, LightTooDarkOrTooBright) {
  AtRest rest = healthy();
  rest.now.white_counts = 70;
  expect_only(rest, {Subject::light});
  EXPECT_EQ(find(rest, Subject::light).fault, Fault::too_dark);
  rest = healthy();
  rest.now.clipped_fraction = 0.3;
  expect_only(rest, {Subject::light});
  EXPECT_EQ(find(rest, Subject::light).fault, Fault::too_bright);
  // A calibration in the same glare.
  rest.then.clipped_fraction = 0.3;
  expect_only(rest, {});
}

TEST(InSitu, AResidualThatHasGrownNamesTheTag) {
  AtRest rest = healthy();
  rest.tags[0].residual_fraction = 0.07;
  expect_only(rest, {Subject::residual});
  EXPECT_EQ(find(rest, Subject::residual).tag, 2);
}

TEST(InSitu, AZeroThatHasDriftedAndARestThatIsElsewhere) {
  AtRest rest = healthy();
  rest.wrench[4] = -0.03 * range()[4];
  expect_only(rest, {Subject::zero});
  InSituFinding f = find(rest, Subject::zero);
  EXPECT_EQ(f.fault, Fault::zero_drifted);
  EXPECT_EQ(f.axis, 4);
  EXPECT_NEAR(f.amount, -0.03, 1e-12);
  rest.wrench[2] = 0.2 * range()[2];
  f = find(rest, Subject::zero);
  EXPECT_EQ(f.fault, Fault::rest_elsewhere);
  EXPECT_EQ(f.axis, 2);
}

TEST(InSitu, AZeroOnAnAxisWithoutARangeIsNotJudged) {
  AtRest rest = healthy();
  rest.wrench[5] = 1;
  rest.range[5] = 1e9;
  EXPECT_TRUE(find(rest, Subject::zero).fine());
  rest.range.setConstant(1e9);
  EXPECT_EQ(find(rest, Subject::zero).fault, Fault::not_known);
}

/// 0.5 N down at a point 10 mm off in x.
ProofLoad load() {
  ProofLoad l;
  l.known << 0, 0, -0.5, 0, 5e-3, 0;
  l.known_covariance.diagonal() << 1e-5, 1e-5, 6e-6, 2e-8, 2e-8, 2e-8;
  l.measured = l.known;
  l.measured_covariance.diagonal() << 1e-7, 1e-7, 4e-6, 1e-11, 1e-11, 1e-12;
  l.range = range();
  return l;
}

TEST(InSitu, AScaleWithinTwoPercentIsFine) {
  ProofLoad l = load();
  l.measured *= 1.015;
  const InSituFinding f = judge(l);
  EXPECT_TRUE(f.fine());
  EXPECT_NEAR(f.amount, 1.015, 1e-9);
  EXPECT_GT(f.sigma, 1e-3);
}

TEST(InSitu, AScaleBeyondIsWrongIfItIsKnownWellEnough) {
  ProofLoad l = load();
  l.measured *= 0.96;
  EXPECT_EQ(judge(l).fault, Fault::scale_wrong);
  l.known_covariance += 0.0004 * l.known * l.known.transpose();  // 2 %
  EXPECT_TRUE(judge(l).fine()) << "two standard deviations";
}

TEST(InSitu, ALoadThatHangsElsewhereIsNotAScale) {
  ProofLoad l = load();
  l.measured[4] = -5e-3;  // on the other side
  const InSituFinding f = judge(l);
  EXPECT_EQ(f.fault, Fault::load_elsewhere);
  EXPECT_EQ(f.axis, 4);
}

TEST(InSitu, NothingKnownGivesNoScale) {
  ProofLoad l = load();
  l.known.setZero();
  EXPECT_EQ(judge(l).fault, Fault::not_known);
}

}  // namespace
}  // namespace tagwrench

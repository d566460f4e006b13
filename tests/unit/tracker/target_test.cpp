#include "host/tracker/target.h"

#include <gtest/gtest.h>

#include "host/core/config_error.h"
#include "host/tracker/acquire.h"

namespace tagwrench {
namespace {

TEST(TagFamilies, NamesGoThereAndBack) {
  for (int i = 0; i < kTagFamilies; ++i) {
    const auto family = static_cast<TagFamily>(i);
    EXPECT_EQ(family_from_name(name(family)), family) << name(family);
  }
  EXPECT_EQ(family_from_name("aruco_4x4_1000"), TagFamily::aruco_4x4_1000);
  EXPECT_EQ(family_from_name("apriltag_36h11"), TagFamily::apriltag_36h11);
  EXPECT_FALSE(family_from_name("aruco"));
  EXPECT_FALSE(family_from_name(""));
}

TEST(TagFamilies, LastIdOfEachFamilyExistsAndTheNextDoesNot) {
  for (int i = 0; i < kTagFamilies; ++i) {
    TargetDescription target;
    target.family = static_cast<TagFamily>(i);
    target.tags = {{id_count(target.family) - 1, {}, Vector6::Zero()}};
    const Acquirer acquirer(CameraModel{}, target);
    EXPECT_EQ(acquirer.patterns().at(0).cells, bits_per_side(target.family) + 2)
        << name(target.family);
    target.tags[0].id += 1;
    EXPECT_THROW(Acquirer(CameraModel{}, target), ConfigError) << name(target.family);
  }
}

TEST(Target, IdListedTwiceIsRefusedByName) {
  TargetDescription target;
  target.tags = {{5, {}, Vector6::Zero()}, {5, {}, Vector6::Zero()}};
  try {
    const Acquirer acquirer(CameraModel{}, target);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("id 5"), std::string::npos) << error.what();
  }
}

TEST(Target, WithoutTagsIsRefused) {
  TargetDescription target;
  target.tags.clear();
  EXPECT_THROW(Acquirer(CameraModel{}, target), ConfigError);
}

}  // namespace
}  // namespace tagwrench

#include "host/core/yaml/yaml_edit.h"

#include <gtest/gtest.h>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

std::string with(const std::string& yaml, const std::vector<std::string>& path,
                 const std::string& value = "2") {
  return with_value(yaml, path, value, "mine.yaml");
}

TEST(WithValue, IsPutWhereItsKeysLeadAndAllElseStays) {
  const std::string yaml =
      "# mine\ntranslation: 1   # times\naxes:\n  x: {full_scale_n: 0.5}   # light\nlock: none\n";
  const auto with = [&](const std::vector<std::string>& path) {
    return with_value(yaml, path, "2", "mine.yaml");
  };
  const auto replaced = [&](const std::string& old, const std::string& by) {
    std::string text = yaml;
    return text.replace(text.find(old), old.size(), by);
  };
  EXPECT_EQ(with({"translation"}), replaced("translation: 1", "translation: 2"));
  EXPECT_EQ(with({"rotation"}), yaml + "rotation: 2\n");
  EXPECT_EQ(with({"axes", "x", "full_scale_n"}), replaced("0.5", "2"));
  EXPECT_EQ(with({"axes", "x", "limit"}), replaced("0.5}", "0.5, limit: 2}"));
  EXPECT_EQ(with({"axes", "y", "limit"}), replaced("lock", "  y: {limit: 2}\nlock"));
  EXPECT_EQ(with({"gestures", "press_ms"}), yaml + "gestures: {press_ms: 2}\n");
  EXPECT_EQ(with({"lock", "deep", "er"}), replaced("none", "{deep: {er: 2}}"))
      << "what should be a mapping becomes one";
  EXPECT_EQ(with_value("{a: {}}", {"a", "b"}, "2", "mine.yaml"), "{a: {b: 2}}");
  EXPECT_THROW(with_value("- 1\n", {"a"}, "2", "mine.yaml"), ConfigError);
}

TEST(WithValue, ReplacesABlockListByOneThatStandsDeeperThanItsKey) {
  EXPECT_EQ(with("tags:  # left, right\n- {id: 5}\n- {id: 2}\nb: 1\n", {"tags"}, "[1,\n 2]"),
            "tags:  # left, right\n  [1,\n   2]\nb: 1\n");
}

TEST(WithValue, AddsBehindACommentOnTheLastLine) {
  const std::string text = "camera:\n    fx: 1 # about\n# next\ntarget: {}\n";
  EXPECT_EQ(with(text, {"camera", "fy"}),
            "camera:\n    fx: 1 # about\n    fy: 2\n# next\ntarget: {}\n");
  EXPECT_EQ(with("camera:\n  fx: 0.07", {"camera", "fy"}), "camera:\n  fx: 0.07\n  fy: 2\n");
}

TEST(WithValue, FillsAnEmptyValue) {
  EXPECT_EQ(with("camera:\n  fx:\n  fy: 3\n", {"camera", "fx"}), "camera:\n  fx: 2\n  fy: 3\n");
}

TEST(WithValue, RefusesWhatIsNoMapping) {
  for (const char* text : {"- a\n", "", "camera: {fx: [1\n", "\xFF\xFE", "a: 1\n--- \nb: 2\n",
                           "\xEF\xBB\xBF"
                           "camera: {}\n"}) {
    EXPECT_THROW(with(text, {"camera", "fx"}), ConfigError) << text;
  }
  EXPECT_THROW(with(std::string(100'000, '['), {"camera"}), ConfigError);
}

}  // namespace
}  // namespace tagwrench

#include "host/sensor/sensor_edit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

const char* const kSensor =
    "# My sensor: \xC3\xA9t\xC3\xA9.\n"
    "camera:  {width: 640, height: 480, fx: 805.0, fy: 806.0, # guessed\n"
    "          cx: 319.5, cy: 239.5, mirrored: false}\n"
    "target:  # glued by hand\n"
    "  family: aruco_original\n"
    "  tag_size_mm: 3.8   # measured\n"
    "  tags:  # left, right\n"
    "  - {id: 5}\n"
    "  - {id: 2}\n"
    "  border_mm: 0.35 # roughly\n"
    "\n"
    "# the springs\n"
    "wrench:\n"
    "  springs:\n"
    "    centres_mm: [[11, 8, -10], [-11, 8, -10], [11, -8, -10], [-11, -8, -10]]\n"
    "    axial_n_per_mm: 0.7\n"
    "    lateral_n_per_mm: 0.07\n";

std::string edited(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("test text lacks " + from);
  return text.replace(at, from.size(), to);
}

class SensorFile : public testing::Test {
 protected:
  SensorFile() {
    std::string name = (fs::temp_directory_path() / "tagwrench-edit-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~SensorFile() override { fs::remove_all(folder_); }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

TEST(WithKeys, ReplacesAndAddsInAFlowSection) {
  const std::string out = with_keys(
      kSensor,
      {"camera", {{"fx", "812.25"}, {"mirrored", "true"}, {"distortion", "[1, 0, 0, 0, 0]"}}},
      "sensor.yaml");
  EXPECT_EQ(out, edited(edited(kSensor, "805.0", "812.25"), "mirrored: false}",
                        "mirrored: true, distortion: [1, 0, 0, 0, 0]}"));
  EXPECT_EQ(parse_sensor(out, "sensor.yaml").camera.fx_px, 812.25);
}

TEST(WithKeys, ReplacesABlockListAndAddsToABlockSection) {
  const std::string out =
      with_keys(kSensor, {"target", {{"tags", "[{id: 5},\n {id: 2}]"}, {"tag_size_mm", "3.81"}}},
                "sensor.yaml");
  EXPECT_EQ(out, edited(edited(kSensor, "3.8 ", "3.81 "), "  - {id: 5}\n  - {id: 2}\n",
                        "    [{id: 5},\n     {id: 2}]\n"));
  EXPECT_EQ(parse_sensor(out, "sensor.yaml").target.tags.size(), 2u);
  const std::string added =
      with_keys(kSensor, {"wrench", {{"range_n", "[1, 1, 3]"}}}, "sensor.yaml");
  EXPECT_EQ(added, std::string(kSensor) + "  range_n: [1, 1, 3]\n");
  EXPECT_EQ(with_keys(edited(kSensor, "0.07\n", "0.07"), {"wrench", {{"range_n", "[1, 1, 3]"}}},
                      "sensor.yaml"),
            added);
}

TEST(WithKeys, AddsBehindACommentOnTheLastLine) {
  const std::string text = "camera:\n    fx: 1 # about\n# next\ntarget: {}\n";
  EXPECT_EQ(with_keys(text, {"camera", {{"fx", "2"}, {"fy", "3"}}}, "s"),
            "camera:\n    fx: 2 # about\n    fy: 3\n# next\ntarget: {}\n");
  EXPECT_EQ(with_keys(text, {"target", {{"family", "x"}, {"tags", "[]"}}}, "s"),
            "camera:\n    fx: 1 # about\n# next\ntarget: {family: x, tags: []}\n");
}

TEST(WithKeys, AddsAMissingSectionAtTheEnd) {
  const SectionEdit rest{"rest", {{"frames", "25"}, {"position_mm", "[0, 0, 21]"}}};
  EXPECT_EQ(with_keys(kSensor, rest, "s"),
            std::string(kSensor) + "rest:\n  frames: 25\n  position_mm: [0, 0, 21]\n");
  EXPECT_EQ(with_keys("a: 1", rest, "s"), "a: 1\nrest:\n  frames: 25\n  position_mm: [0, 0, 21]\n");
  EXPECT_EQ(with_keys("{a: 1}\n", rest, "s"),
            "{a: 1, rest: {frames: 25, position_mm: [0, 0, 21]}}\n");
  EXPECT_EQ(with_keys("a: 1\n...\n", rest, "s"),
            "a: 1\nrest:\n  frames: 25\n  position_mm: [0, 0, 21]\n...\n");
}

TEST(WithKeys, FillsAnEmptyValue) {
  EXPECT_EQ(with_keys("camera:\n  fx:\n  fy: 2\n", {"camera", {{"fx", "1"}}}, "s"),
            "camera:\n  fx: 1\n  fy: 2\n");
}

TEST(WithKeys, RefusesWhatIsNoSensorFile) {
  for (const char* text :
       {"camera: 5\n", "- a\n", "", "camera: {fx: [1\n", "\xFF\xFE", "a: 1\n--- \nb: 2\n",
        "\xEF\xBB\xBF"
        "camera: {}\n"}) {
    EXPECT_THROW(with_keys(text, {"camera", {{"fx", "1"}}}, "s"), ConfigError) << text;
  }
  EXPECT_THROW(with_keys(std::string(100'000, '['), {"camera", {}}, "s"), ConfigError);
}

TEST(CheckEditable, SaysBeforeTheWorkWhatCouldNotBeWrittenAfterIt) {
  const std::vector<SectionEdit> edits = {{"camera", {{"fx", "1"}}}, {"rest", {{"frames", "9"}}}};
  EXPECT_NO_THROW(check_editable(kSensor, edits, "sensor.yaml"));
  const std::string anchored = edited(edited(kSensor, "fx: 805.0", "fx: &f 805.0"),
                                      "axial_n_per_mm: 0.7", "axial_n_per_mm: *f");
  for (const std::string& text :
       {anchored, "\xEF\xBB\xBF" + std::string(kSensor), std::string(kSensor) + "---\na: 1\n"}) {
    ASSERT_NO_THROW(parse_sensor(text, "sensor.yaml"));
    try {
      check_editable(text, edits, "sensor.yaml");
      ADD_FAILURE() << "accepted: " << text;
    } catch (const ConfigError& e) {
      const std::string line = e.what();
      EXPECT_EQ(line.rfind("sensor.yaml:", 0), 0u) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    }
  }
}

TEST_F(SensorFile, IsReplacedAsAWholeKeepingItsMode) {
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, kSensor);
  ::chmod(file.c_str(), 0640);
  write_sensor(read_text(file), {{"camera", {{"fx", "900"}}}, {"rest", {{"frames", "30"}}}}, file);
  EXPECT_EQ(load_sensor(file).camera.fx_px, 900);
  EXPECT_EQ(load_sensor(file).rest.frames, 30);
  struct stat now {};
  ::stat(file.c_str(), &now);
  EXPECT_EQ(now.st_mode & 07777, 0640u);
  EXPECT_EQ(files(), 1u);
}

TEST_F(SensorFile, BehindASymbolicLinkIsReplacedThere) {
  fs::create_directory(folder_ / "real");
  write_atomically(folder_ / "real" / "a.yaml", kSensor);
  fs::create_symlink("real/a.yaml", folder_ / "sensor.yaml");
  write_sensor(kSensor, {{"camera", {{"fx", "900"}}}}, folder_ / "sensor.yaml");
  EXPECT_TRUE(fs::is_symlink(folder_ / "sensor.yaml"));
  EXPECT_EQ(load_sensor(folder_ / "real" / "a.yaml").camera.fx_px, 900);
}

TEST_F(SensorFile, StaysWhenTheResultWouldNotBeUsable) {
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, kSensor);
  EXPECT_THROW(write_sensor(kSensor, {{"camera", {{"fx", "-1"}}}}, file), ConfigError);
  EXPECT_THROW(write_sensor(kSensor, {{"camera", {{"f", "1"}}}}, file), ConfigError);
  EXPECT_EQ(read_text(file), kSensor);
  EXPECT_EQ(files(), 1u);
}

TEST_F(SensorFile, StaysWhenTheDiskIsFull) {
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, kSensor);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  ::getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{100, old.rlim_max};  // bytes
  ::setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write_sensor(kSensor, {{"camera", {{"fx", "900"}}}}, file), std::runtime_error);
  ::setrlimit(RLIMIT_FSIZE, &old);
  EXPECT_EQ(read_text(file), kSensor);
  EXPECT_EQ(files(), 1u);
}

TEST_F(SensorFile, StaysWhenItIsWriteProtected) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everything";
  const fs::path file = folder_ / "sensor.yaml";
  write_atomically(file, kSensor);
  EXPECT_NO_THROW(check_replaceable(file));
  fs::permissions(file, fs::perms::owner_read);
  EXPECT_THROW(check_replaceable(file), ConfigError);
}

TEST_F(SensorFile, IsCheckedBeforeTheWork) {
  EXPECT_NO_THROW(check_replaceable(folder_ / "new.yaml"));
  EXPECT_THROW(check_replaceable(folder_ / "none" / "new.yaml"), ConfigError);
  EXPECT_THROW(check_replaceable(folder_), ConfigError);
  EXPECT_THROW(check_replaceable("/dev/null"), ConfigError);
  EXPECT_THROW(read_text(folder_), ConfigError);
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

}  // namespace
}  // namespace tagwrench

// The build guide's commands: they exist as printed, and from the first zero on they work with the
// simulated sensor in place of the camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "documents.h"

namespace tagwrench {
namespace {

const std::string kGuide = "hardware/README.md";

/// Indented lines from one heading to the next one named, without comments.
std::vector<std::string> commands(const std::string& from = "", const std::string& to = "") {
  std::istringstream lines(documents::text_of(kGuide));
  std::vector<std::string> out;
  bool inside = from.empty();
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ")) inside = from.empty() || (inside ? line != to : line == from);
    if (inside && line.starts_with("    "))
      out.push_back(std::regex_replace(line.substr(4), std::regex(R"(\s+#.*)"), ""));
  }
  return out;
}

/// Exit status of a shell command in a folder; what it said is in FOLDER/said.
int shell(const std::filesystem::path& folder, const std::string& command) {
  const std::string path = std::filesystem::path(TAGWRENCH_PROGRAM).parent_path();
  return std::system(("cd '" + folder.string() + "' && PATH='" + path + "':\"$PATH\" && { " +
                      command + "\n} >said 2>&1 </dev/null")
                         .c_str());
}

std::string said(const std::filesystem::path& folder) {
  std::ifstream file(folder / "said");
  return {std::istreambuf_iterator<char>(file), {}};
}

class Guide : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::filesystem::create_directory_symlink(TAGWRENCH_SOURCE_DIR "/hardware",
                                              folder_ / "hardware");
  }
  const std::filesystem::path folder_ =
      std::filesystem::path(TAGWRENCH_SCRATCH_DIR) /
      testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(Guide, NamesVerbsAndOptionsThatExist) {
  int found = 0;
  for (const std::string& command : commands()) {
    std::istringstream words(command);
    std::string word, verb;
    words >> word;
    if (word != "tagwrench") continue;
    SCOPED_TRACE(command);
    const std::regex plain("[a-z]+");
    std::vector<std::string> options;
    bool in_verb = true;
    while (words >> word) {
      in_verb = in_verb && std::regex_match(word, plain);
      if (in_verb) verb += " " + word;
      if (word.starts_with("--")) options.push_back(word);
    }
    ASSERT_EQ(shell(folder_, "tagwrench" + verb + " --help"), 0) << said(folder_);
    const std::string help = said(folder_);
    for (const std::string& option : options)
      EXPECT_TRUE(std::regex_search(help, std::regex(option + "\\b"))) << option;
    ++found;
  }
  EXPECT_GE(found, 12);
}

TEST_F(Guide, LeadsTheSimulatedSensorFromTheFirstZeroToTheFirstNewtons) {
  std::string set_up;
  int run = 0;
  for (const std::string& command : commands("## 8 First zero", "## With an Arduino")) {
    if (command.find("SOURCE=") != std::string::npos) {
      if (command.ends_with(".yaml")) set_up = command + "; ";
      continue;
    }
    SCOPED_TRACE(command);
    ASSERT_FALSE(set_up.empty());
    ASSERT_EQ(shell(folder_, set_up + command), 0) << said(folder_);
    ++run;
  }
  EXPECT_GE(run, 8);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "twin/measured/wrench.json"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "twin/certificate.pdf"));
}

TEST_F(Guide, PointsOnlyToWhatThereIs) {
  const std::string text = documents::text_of(kGuide) + documents::text_of("hardware/light.md");
  const std::regex link(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  int found = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it, ++found) {
    const std::string target = (*it)[1];
    EXPECT_TRUE(std::filesystem::exists(TAGWRENCH_SOURCE_DIR "/hardware/" + target)) << target;
  }
  EXPECT_GE(found, 6);
}

TEST_F(Guide, HasTheVariantsThatAreShipped) {
  const std::string text = documents::text_of(kGuide);
  for (const auto& row : documents::markdown_table(text, "| variant | what for |"))
    EXPECT_TRUE(
        std::filesystem::exists(TAGWRENCH_SOURCE_DIR "/hardware/sensors/" + row[0] + ".yaml"))
        << row[0];
  for (const auto& entry :
       std::filesystem::directory_iterator(TAGWRENCH_SOURCE_DIR "/hardware/sensors"))
    EXPECT_NE(text.find("| `" + entry.path().stem().string() + "` |"), std::string::npos)
        << entry.path();
}

}  // namespace
}  // namespace tagwrench

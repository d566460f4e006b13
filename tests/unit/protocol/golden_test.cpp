// The bytes of every kind, written down: other versions and other programs depend on them. A change
// here is a change of the protocol.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "tests/unit/protocol/messages.h"

namespace tagwrench::link {
namespace {

/// Frames of Examples, in order and with the sequence numbers 0, 1, 2 ...
const std::map<std::string, std::string> kGolden{
    {"HelloRequest", "02 01 0A 08 01 1D 34 12 A5 5E D7 92 00"},
    {"Configure", "0A 02 01 08 88 27 12 04 01 01 0D 03 18 50 20 03 28 64 30 E8 07 82 46 00"},
    {"Led", "08 03 02 08 02 1D 35 82 01 08 20 F4 03 2D EE FF C0 03 D3 C9 00"},
    {"TimeRequest", "05 04 03 A8 E1 00"},
    {"Tare", "09 05 04 08 0B 10 50 A3 E8 00"},
    {"SetId", "07 06 05 0A 08 54 57 01 01 01 01 04 2A 05 09 00"},
    {"Hello",
     "1C 81 06 08 01 1A 0A 61 74 6D 65 67 61 33 32 38 70 22 05 30 2E 31 2E 30 2A 08 54 57 01 01 01 "
     "01 10 2A 35 07 B0 07 B0 38 04 45 34 12 A5 5E 37 7B 00"},
    {"Capabilities",
     "2A 82 07 08 04 10 02 18 0A 20 02 28 80 02 30 AC 02 38 90 4E 40 14 48 B0 EA 01 50 E8 07 58 C0 "
     "84 3D 60 F4 03 68 01 70 01 7C EB 00"},
    {"CellSample", "13 83 08 08 02 10 FF 88 0F 1D 04 03 02 01 20 B4 24 86 12 00"},
    {"AdcSample", "0B 84 09 08 01 10 80 04 1D FF FF 01 06 20 AC 02 29 50 00"},
    {"ButtonEvent", "0B 85 0A 08 01 10 01 1D C0 C6 2D 05 20 07 73 FC 00"},
    {"TimeReply", "17 86 0B 08 C8 01 15 F0 FF FF FF 18 C7 01 25 E0 B2 FF FF 28 01 0E 7D 00"},
    {"Status",
     "04 87 0C 0D 1E 87 93 03 15 34 12 A5 5E 18 AC 02 20 01 28 3B 30 F9 26 38 F3 03 40 01 62 07 CC "
     "3E B6 3E 0B C3 3E 68 CF 07 70 FC 11 AD 6C 00"},
    {"Answer", "0B 88 0D 08 7E 10 09 18 01 CE F8 00"},
    {"TareResult", "10 89 0E 08 03 10 EA A3 0A 18 BE 01 20 50 A9 C7 00"},
    {"Fault", "0C 8A 0F 08 01 1D 40 D2 DF 03 A5 32 00"},
};

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (!text.empty()) text += ' ';
    text += fmt::format("{:02X}", byte);
  }
  return text;
}

std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

const std::filesystem::path kSource{TAGWRENCH_SOURCE_DIR};

TEST(Golden, BytesOfEveryKindAreWhatTheyAlwaysWere) {
  std::uint8_t sequence = 0;
  Examples{}.each([&](Kind, const char* name, const auto& message) {
    EXPECT_EQ(hex(frame_of(message, sequence++)), kGolden.at(name)) << name;
  });
  EXPECT_EQ(sequence, kGolden.size());
}

TEST(Golden, BytesOfEveryKindReadAsTheExample) {
  std::uint8_t sequence = 0;
  Examples{}.each([&]<class Message>(Kind kind, const char* name, const Message& message) {
    std::istringstream words(kGolden.at(name));
    words >> std::hex;
    FrameReader reader;
    Received received = Received::nothing;
    for (int byte = 0; words >> byte;) received = reader.take(static_cast<std::uint8_t>(byte));
    ASSERT_EQ(received, Received::frame) << name;
    EXPECT_EQ(reader.kind(), static_cast<std::uint8_t>(kind)) << name;
    EXPECT_EQ(reader.sequence(), sequence++) << name;
    Message read;
    ASSERT_TRUE(decode(reader.message(), reader.message_bytes(), read)) << name;
    EXPECT_TRUE(same(read, message)) << name;
  });
}

/// An example in the README: a heading with the kind's name, and under it lines of bytes, two
/// spaces and what they mean.
TEST(Readme, ShowsTheGoldenBytesOfEveryKind) {
  std::istringstream lines(file_text(kSource / "protocol/README.md"));
  const std::regex heading("### (\\w+)");
  const std::regex bytes("    ((?:[0-9A-F]{2} )*[0-9A-F]{2})(?:  .*|)");
  std::map<std::string, std::string> shown;
  std::string kind;
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, heading)) {
      kind = match[1];
    } else if (line.starts_with("#")) {
      kind.clear();
    } else if (!kind.empty() && std::regex_match(line, match, bytes)) {
      std::string& text = shown[kind];
      if (!text.empty()) text += ' ';
      text += match[1].str();
    }
  }
  EXPECT_EQ(shown, kGolden);
}

/// `Suite.Name` in the README is a test that somewhere is written, or `fuzz.NAME` a fuzz target.
TEST(Readme, EveryInvariantNamesATestThatExists) {
  std::set<std::string> tests;
  const std::regex test("TEST(?:_F|_P)?\\(\\s*(\\w+),\\s*(\\w+)\\)");
  const std::regex fuzzer("tagwrench_fuzzer\\(\\s*NAME (\\w+)");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kSource / "tests")) {
    const bool cmake = entry.path().filename() == "CMakeLists.txt";
    if (!cmake && entry.path().extension() != ".cpp") continue;
    const std::string text = file_text(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), cmake ? fuzzer : test), end; at != end;
         ++at) {
      const std::string suite = cmake ? "fuzz" : at->str(1);
      tests.insert(fmt::format("{}.{}", suite, at->str(cmake ? 1 : 2)));
    }
  }
  std::istringstream lines(file_text(kSource / "protocol/README.md"));
  const std::regex name("`(\\w+\\.\\w+)`");
  const std::regex number("(\\d+)\\. .*");
  int invariants = 0;
  bool within = false;
  bool named = true;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#")) within = line == "## Invariants";
    if (!within) continue;
    if (std::regex_match(line, number)) {
      EXPECT_TRUE(named) << "invariant " << invariants << " names no test";
      ++invariants;
      named = false;
    }
    for (std::sregex_iterator at(line.begin(), line.end(), name), end; at != end; ++at) {
      EXPECT_TRUE(tests.contains(at->str(1))) << at->str(1) << " of invariant " << invariants;
      named = true;
    }
  }
  EXPECT_TRUE(named) << "invariant " << invariants << " names no test";
  EXPECT_GE(invariants, 8);
}

}  // namespace
}  // namespace tagwrench::link

#include "host/output/spnav_protocol.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace tagwrench {
namespace {

using DialogueRecord = std::array<std::int32_t, 8>;
constexpr const char* kToldPath = "/run/user/1000/tagwrench/spnav.sock";

SpnavDevice puck() {
  SpnavDevice device;
  std::string("tagwrench SpaceMouse on a desk").copy(device.name.data(), device.name.size() - 1);
  device.vendor = 0x256f;
  device.product = 0xc62e;
  return device;
}

/// Gives `bytes` in pieces of at most `piece`, and gathers the answers.
std::vector<std::uint8_t> converse(SpnavDialogue& dialogue, const std::vector<std::uint8_t>& bytes,
                                   std::size_t piece, const SpnavDevice* device) {
  std::vector<std::uint8_t> answers;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t count = std::min({piece, dialogue.wanted(), bytes.size() - at});
    const auto said = dialogue.take({bytes.data() + at, count}, device, kToldPath);
    answers.insert(answers.end(), said.begin(), said.end());
    at += count;
  }
  return answers;
}

std::vector<std::uint8_t> as_bytes(std::uint32_t word) {
  const auto four = std::bit_cast<std::array<std::uint8_t, 4>>(word);
  return {four.begin(), four.end()};
}

std::vector<DialogueRecord> ask(SpnavDialogue& dialogue, DialogueRecord request,
                                const SpnavDevice* device, std::size_t piece = 32) {
  const auto bytes = std::bit_cast<std::array<std::uint8_t, 32>>(request);
  const auto answers = converse(dialogue, {bytes.begin(), bytes.end()}, piece, device);
  std::vector<DialogueRecord> records(answers.size() / 32);
  if (!records.empty()) std::memcpy(records.data(), answers.data(), records.size() * 32);
  EXPECT_EQ(answers.size() % 32, 0U);
  return records;
}

SpnavDialogue in_version_1() {
  SpnavDialogue dialogue;
  converse(dialogue, as_bytes(0x7faa5501), 4, nullptr);
  return dialogue;
}

std::int32_t tagged(int request) { return 0x7faa0000 | request; }

TEST(SpnavAxes, AreThoseThatSpacenavdMakesOfOurSpaceMouse) {
  // HID X Y Z RX RY RZ -> where it appears among x y z rx ry rz, and with which sign.
  const std::array<std::pair<std::size_t, int>, 6> expected{
      {{0, +1}, {2, -1}, {1, -1}, {3, +1}, {5, -1}, {4, -1}}};
  for (int axis = 0; axis < 6; ++axis) {
    Vector6 motion = Vector6::Zero();
    motion[axis] = 1;
    Counts6 wanted{};
    const auto [index, sign] = expected[static_cast<std::size_t>(axis)];
    wanted[index] = static_cast<std::int16_t>(sign * 500);
    EXPECT_EQ(spnav_counts(motion), wanted) << "HID axis " << axis;
  }
}

TEST(SpnavAxes, AreRoundedClampedAndNeverMadeUp) {
  Vector6 motion = Vector6::Zero();
  motion[0] = 0.5009;
  motion[3] = -7;
  EXPECT_EQ(spnav_counts(motion), (Counts6{250, 0, 0, -500, 0, 0}));
  motion[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(spnav_counts(motion), Counts6{});
}

TEST(SpnavDialogue, EchoesTheVersionThatItCanSpeak) {
  for (const auto& [request, answer] : {std::pair{0x7faa5500U, 0x7faa5500U},
                                        {0x7faa5501U, 0x7faa5501U},
                                        {0x7faa55ffU, 0x7faa5501U}}) {
    SpnavDialogue dialogue;
    EXPECT_FALSE(dialogue.has_spoken());
    EXPECT_EQ(converse(dialogue, as_bytes(request), 1, nullptr), as_bytes(answer));
    EXPECT_EQ(dialogue.version(), static_cast<int>(answer & 1));
    EXPECT_TRUE(dialogue.has_spoken());
    EXPECT_EQ(dialogue.wants(SpnavDialogue::kDevice), dialogue.version() == 1);
  }
}

TEST(SpnavDialogue, TakesAVersion0WordForASensitivityIfItIsASensibleOne) {
  SpnavDialogue dialogue;
  const auto say = [&](float f) {
    EXPECT_TRUE(converse(dialogue, as_bytes(std::bit_cast<std::uint32_t>(f)), 3, nullptr).empty());
    return dialogue.sensitivity();
  };
  EXPECT_EQ(say(2.5F), 2.5F);
  EXPECT_EQ(say(-0.5F), -0.5F);
  for (const float nonsense : {0.F, 3e23F, -1e-23F, std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(say(nonsense), -0.5F);
}

TEST(SpnavDialogue, AnswersARequestOnceInWhateverPiecesItComes) {
  for (std::size_t piece = 1; piece <= 32; ++piece) {
    SpnavDialogue dialogue = in_version_1();
    const SpnavDevice device = puck();
    const auto answers = ask(dialogue, {tagged(0x2002)}, &device, piece);
    ASSERT_EQ(answers.size(), 1U) << piece;
    EXPECT_EQ(answers[0], (DialogueRecord{tagged(0x2002), 6}));
  }
}

TEST(SpnavDialogue, TellsWhatTheDeviceIs) {
  SpnavDialogue dialogue = in_version_1();
  const SpnavDevice device = puck();
  EXPECT_EQ(ask(dialogue, {tagged(0x2003)}, &device)[0], (DialogueRecord{tagged(0x2003), 16}));
  EXPECT_EQ(ask(dialogue, {tagged(0x2004)}, &device)[0],
            (DialogueRecord{tagged(0x2004), 0x256f, 0xc62e}));
  EXPECT_EQ(ask(dialogue, {tagged(0x2005)}, &device)[0], (DialogueRecord{tagged(0x2005), 0x20c}));
  SpnavDevice own = device;
  own.vendor = 0x1209;
  EXPECT_EQ(ask(dialogue, {tagged(0x2005)}, &own)[0], (DialogueRecord{tagged(0x2005), 0}));
}

TEST(SpnavDialogue, SendsALongNameInMarkedPieces) {
  SpnavDialogue dialogue = in_version_1();
  const SpnavDevice device = puck();  // a name of 30 bytes
  const auto pieces = ask(dialogue, {tagged(0x2000)}, &device);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_EQ(pieces[0][7], 30);
  EXPECT_EQ(pieces[1][7], 0x10006);
  EXPECT_EQ(std::memcmp(&pieces[0][1], "tagwrench SpaceMouse on ", 24), 0);
  EXPECT_EQ(std::memcmp(&pieces[1][1], "a desk\0\0", 8), 0);
}

TEST(SpnavDialogue, TruncatesAPathThatIsLongerThanAnAnswerMayBe) {
  SpnavDialogue dialogue = in_version_1();
  const SpnavDevice device = puck();
  const auto request = std::bit_cast<std::array<std::uint8_t, 32>>(DialogueRecord{tagged(0x2001)});
  EXPECT_EQ(dialogue.take(request, &device, std::string(4000, 'x')).size(), 5U * 32);
}

TEST(SpnavDialogue, RefusesWhatItHasNot) {
  SpnavDialogue dialogue = in_version_1();
  const SpnavDevice device = puck();
  for (int request = 0x2000; request <= 0x2005; ++request)
    EXPECT_EQ(ask(dialogue, {tagged(request)}, nullptr)[0][7], -1) << std::hex << request;
  for (const int request : {0x3000, 0x3001, 0x3005, 0x3017, 0x3ffe, 0x4000, 0x5501, 0xffff, 0x0})
    EXPECT_EQ(ask(dialogue, {tagged(request)}, &device)[0][7], -1) << std::hex << request;
  EXPECT_EQ(ask(dialogue, {0x12341002}, &device)[0],
            (DialogueRecord{0x12341002, 0, 0, 0, 0, 0, 0, -1}));
}

TEST(SpnavDialogue, KeepsTheEventMaskAndTheSensitivityOfItsClient) {
  SpnavDialogue dialogue = in_version_1();
  ask(dialogue, {tagged(0x1003), 5}, nullptr);
  EXPECT_EQ(ask(dialogue, {tagged(0x1004)}, nullptr)[0], (DialogueRecord{tagged(0x1004), 5}));
  EXPECT_FALSE(dialogue.wants(SpnavDialogue::kButton));
  const auto half = std::bit_cast<std::int32_t>(0.5F);
  EXPECT_EQ(ask(dialogue, {tagged(0x1001), half}, nullptr)[0][7], 0);
  EXPECT_EQ(ask(dialogue, {tagged(0x1001), 0}, nullptr)[0][7], -1);
  EXPECT_EQ(ask(dialogue, {tagged(0x1002)}, nullptr)[0], (DialogueRecord{tagged(0x1002), half}));
}

TEST(SpnavDialogue, DoesNotAnswerATextForWhichLibspnavDoesNotWait) {
  SpnavDialogue dialogue = in_version_1();
  EXPECT_TRUE(ask(dialogue, {0x1000, 0x65657266}, nullptr).empty());
  EXPECT_TRUE(ask(dialogue, {0x3016, 0x7665642f}, nullptr).empty());
}

TEST(SpnavMotion, IsScaledByTheSensitivityOfTheClient) {
  EXPECT_EQ(spnav_motion({1, -1, 500, 0, 3, -3}, 0.5F, 8),
            (SpnavRecord{0, 1, -1, 250, 0, 2, -2, 8}));
  EXPECT_EQ(spnav_motion({500, 0, 0, 0, 0, 0}, 1e3F, 8)[1], 500'000);
}

}  // namespace
}  // namespace tagwrench

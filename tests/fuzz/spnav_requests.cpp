// Any bytes from a program on the spnav socket, in any pieces; and the same bytes as a bridge's
// message.
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

#include "host/output/spnav_daemon.h"
#include "host/output/spnav_protocol.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;

void check_answer(const SpnavDialogue& dialogue, std::span<const std::uint8_t> answer) {
  if (answer.empty()) return;
  expect(answer.size() <= SpnavDialogue::kMaxAnswers * sizeof(SpnavRecord), "an answer is bounded");
  const bool version = answer.size() == 4;
  expect(version || (answer.size() % sizeof(SpnavRecord) == 0 && dialogue.version() == 1),
         "an answer is a version, or whole records in version 1");
}

void check_messages(std::span<const std::uint8_t> bytes) {
  const auto hello = spnav_message<SpnavHello>(bytes);
  expect(!hello || bytes.size() == sizeof(SpnavHello), "a hello has its size");
  const auto update = spnav_message<SpnavUpdate>(bytes);
  expect(!update || !hello, "a message is of one kind");
  if (!update) return;
  const SpnavRecord record = spnav_motion(update->state.motion, 1e3F, 8);
  for (std::size_t i = 0; i < 6; ++i)
    expect(record[i + 1] == update->state.motion[i] * 1000, "counts fit a record");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  check_messages({bytes, count});
  SpnavDevice device;
  device.name.fill('x');  // without an end
  SpnavDialogue dialogue;
  if (count % 4 != 0) {  // the word that random bytes do not hit upon
    const auto request = std::bit_cast<std::array<std::uint8_t, 4>>(0x7faa5501);
    check_answer(dialogue, dialogue.take(request, nullptr, ""));
    expect(dialogue.version() == 1, "version 1 is granted");
  }
  std::span<const std::uint8_t> left(bytes, count);
  while (!left.empty()) {
    expect(dialogue.wanted() >= 1 && dialogue.wanted() <= 32, "it wants some bytes, and few");
    const std::size_t piece =
        std::min({left.size(), dialogue.wanted(), std::size_t{1} + left[0] % 40});
    const bool present = (left[0] & 1) != 0;
    const int before = dialogue.version();
    check_answer(dialogue, dialogue.take(left.first(piece), present ? &device : nullptr, "/run/s"));
    expect(dialogue.version() >= before, "nobody goes back to version 0");
    const float sensitivity = std::abs(dialogue.sensitivity());
    expect(sensitivity >= 1e-3F && sensitivity <= 1e3F, "a sensitivity is a sensible one");
    left = left.subspan(piece);
  }
  return 0;
}

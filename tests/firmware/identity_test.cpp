// Who the board says it is, after every way to start.
#include <gtest/gtest.h>

#include <set>

#include "tests/firmware/board_client.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct Identity : testing::Test {
  EmulatedBoard board{TAGWRENCH_FIRMWARE_ELF};
  BoardClient client{board};
};

TEST_F(Identity, SaysWhoItIsAndWhatItCan) {
  const auto hello = client.greet(0xCAFE1234);
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->protocol_major, link::kProtocolMajor);
  EXPECT_STREQ(hello->board, "atmega328p");
  EXPECT_NE(hello->firmware[0], 0);
  EXPECT_EQ(hello->unique_id.count, 0);
  EXPECT_EQ(hello->session, 0xCAFE1234U);
  EXPECT_EQ(hello->reset_cause, link::ResetCause::power_on);
  const link::Capabilities& can = client.all<link::Capabilities>().back().message;
  EXPECT_EQ(can.cells, 4);
  EXPECT_EQ(can.adc_channels, 2);
  EXPECT_EQ(can.adc_bits, 10);
  EXPECT_EQ(can.buttons, 2);
  EXPECT_EQ(can.led_sustained_permille, 300);
  EXPECT_EQ(can.led_full_time_ms, 10000);
  EXPECT_LT(can.strobe_width_min_us, can.strobe_width_max_us);
  EXPECT_TRUE(can.measures_supply);
}

TEST_F(Identity, TheLampBlinksUntilAHostIsThere) {
  bool was = board.lamp();
  int changes = 0;
  for (int i = 0; i < 400; ++i) {
    board.advance_by(milliseconds(10));
    changes += board.lamp() != was ? 1 : 0;
    was = board.lamp();
  }
  EXPECT_GE(changes, 2);
  EXPECT_LE(changes, 16);
  ASSERT_TRUE(client.greet());
  for (int i = 0; i < 300; ++i) {
    client.run(milliseconds(10));
    EXPECT_TRUE(board.lamp());
  }
}

TEST_F(Identity, EveryStartHasAnotherBootId) {
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 6; ++i) {
    const auto hello = client.greet();
    ASSERT_TRUE(hello);
    EXPECT_TRUE(seen.insert(hello->boot_id).second) << "start " << i;
    if (i % 2 == 0) {
      board.power_cycle();
    } else {
      board.press_reset();
    }
  }
}

TEST_F(Identity, ResetsByTheWatchdogHaveOtherBootIdsAndWriteNothing) {
  std::set<std::uint32_t> seen;
  ASSERT_TRUE(client.greet());
  const std::vector<std::uint8_t> before = board.core().eeprom();
  for (int i = 0; i < 20; ++i) {
    board.hang(i % 2 == 0);
    board.advance_by(milliseconds(400));
    const auto hello = client.greet();
    ASSERT_TRUE(hello);
    EXPECT_EQ(hello->reset_cause, link::ResetCause::watchdog);
    EXPECT_TRUE(seen.insert(hello->boot_id).second) << "reset " << i;
  }
  EXPECT_EQ(board.core().eeprom(), before) << "a memory that bears 100,000 writes";
}

/// Bytes of the EEPROM that differ, by their address.
std::vector<std::size_t> changed(const std::vector<std::uint8_t>& from,
                                 const std::vector<std::uint8_t>& to) {
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < from.size(); ++i)
    if (from[i] != to[i]) at.push_back(i);
  return at;
}

TEST_F(Identity, AStartWithPowerIsCountedOnceItHasLivedEachInItsOwnCells) {
  constexpr std::size_t kSlot = 4;  // bytes
  std::size_t last = 0;
  for (int start = 0; start < 5; ++start) {
    board.power_cycle();
    const std::vector<std::uint8_t> before = board.core().eeprom();
    client.run(seconds(4));
    EXPECT_EQ(board.core().eeprom(), before) << "start " << start;
    client.run(seconds(2));
    const std::vector<std::size_t> cells = changed(before, board.core().eeprom());
    ASSERT_FALSE(cells.empty()) << "start " << start;
    EXPECT_GE(cells.front() / kSlot, last / kSlot + (start > 0 ? 1 : 0)) << "start " << start;
    EXPECT_EQ(cells.back() / kSlot, cells.front() / kSlot) << "start " << start;
    last = cells.back();
  }
}

TEST_F(Identity, PowerThatGoesWhileAStartIsCountedCostsNoBootId) {
  std::set<std::uint32_t> seen;
  for (const int written_ms : {2, 5, 9, 12, 20, 0}) {  // a byte takes 3.4 ms
    board.power_cycle();
    const auto hello = client.greet();
    ASSERT_TRUE(hello);
    EXPECT_TRUE(seen.insert(hello->boot_id).second) << "before " << written_ms << " ms";
    while (!board.core().eeprom_busy() && board.board_us() < 6e6) board.advance_by(milliseconds(1));
    EXPECT_TRUE(board.core().eeprom_busy());
    board.advance_by(milliseconds(written_ms));
  }
}

TEST_F(Identity, SaysHowItWasReset) {
  ASSERT_TRUE(client.greet());
  board.press_reset();
  auto hello = client.greet();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->reset_cause, link::ResetCause::pin);
  board.core().reset(1 << 2);
  hello = client.greet();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->reset_cause, link::ResetCause::brown_out);
}

TEST_F(Identity, AnIdIsGivenOnceAndKept) {
  ASSERT_TRUE(client.greet());
  const link::UniqueId id{{1, 2, 3, 4, 5, 6, 7, 0x88}, 8};
  EXPECT_EQ(client.ask(link::SetId{id}), link::Result::ok);
  const link::UniqueId other{{9, 9, 9, 9, 9, 9, 9, 9}, 8};
  EXPECT_EQ(client.ask(link::SetId{other}), link::Result::already_set);
  client.run(milliseconds(100));
  for (int i = 0; i < 2; ++i) {
    board.power_cycle();
    const auto hello = client.greet();
    ASSERT_TRUE(hello);
    ASSERT_EQ(hello->unique_id.count, 8);
    EXPECT_EQ(std::vector<int>(hello->unique_id.bytes, hello->unique_id.bytes + 8),
              std::vector<int>(id.bytes, id.bytes + 8));
  }
  EXPECT_EQ(client.ask(link::SetId{other}), link::Result::already_set);
}

TEST_F(Identity, KeepingAnIdDoesNotStopTheSamples) {
  ASSERT_TRUE(client.greet());
  ASSERT_EQ(client.ask(full_configuration()), link::Result::ok);
  client.run(milliseconds(500));
  board.core().clear_figures();
  ASSERT_EQ(client.ask(link::SetId{{{1, 2, 3, 4, 5, 6, 7, 8}, 8}}), link::Result::ok);
  client.run(milliseconds(200));
  EXPECT_LT(static_cast<double>(board.figures().loop.worst) / 16, 10000)
      << "an EEPROM byte takes 3.4 ms and must be written in the background (us)";
  EXPECT_EQ(client.sequence_gaps(), 0U);
}

TEST_F(Identity, AnotherMajorVersionIsRefusedAndSaid) {
  board.advance_by(milliseconds(50));
  const auto result =
      client.ask(link::HelloRequest{static_cast<std::uint8_t>(link::kProtocolMajor + 1), 0, 1});
  EXPECT_EQ(result, link::Result::wrong_version);
  client.run(milliseconds(50));
  ASSERT_FALSE(client.all<link::Hello>().empty()) << "so that the host can say which is older";
  EXPECT_EQ(client.all<link::Hello>().back().message.protocol_major, link::kProtocolMajor);
  link::Led steady{};
  steady.mode = link::LedMode::steady;
  steady.level_permille = 200;
  EXPECT_NE(client.ask(steady), link::Result::ok);
  EXPECT_EQ(board.led().level(), 0);
}

}  // namespace
}  // namespace tagwrench::emulator

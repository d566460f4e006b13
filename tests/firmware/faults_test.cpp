// Load cells, buttons and voltages as they are wired, mis-wired and worn; the clock's wrap; noise
// on the line.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/firmware/board_client.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

double us_of(VirtualTime time) { return static_cast<double>(time.count()) * 1e-3; }

struct Inputs : testing::Test {
  EmulatedBoard board{TAGWRENCH_FIRMWARE_ELF};
  BoardClient client{board};

  void SetUp() override { ASSERT_TRUE(client.greet()); }
  void configure(const link::Configure& configuration = full_configuration()) {
    ASSERT_EQ(client.ask(configuration), link::Result::ok);
  }
  std::vector<Arrived<link::CellSample>> samples_of(std::uint8_t channel) {
    std::vector<Arrived<link::CellSample>> found;
    for (const auto& sample : client.all<link::CellSample>()) {
      if (sample.message.channel == channel) found.push_back(sample);
    }
    return found;
  }
  std::vector<link::Fault> faults_of(std::uint8_t channel) {
    std::vector<link::Fault> found;
    for (const auto& fault : client.all<link::Fault>()) {
      if (fault.message.channel == channel) found.push_back(fault.message);
    }
    return found;
  }
};

TEST_F(Inputs, EachCellTellsItsForce) {
  for (unsigned i = 0; i < kCells; ++i) board.set_force(i, 0.5 * (i + 1.0) * (i % 2 == 0 ? 1 : -1));
  configure();
  client.run(seconds(1));
  for (std::uint8_t i = 0; i < kCells; ++i) {
    const auto samples = samples_of(i);
    ASSERT_GT(samples.size(), 70U);
    const double expected = 20000 + 100000 * 0.5 * (i + 1.0) * (i % 2 == 0 ? 1 : -1);
    EXPECT_EQ(samples.back().message.counts, expected);
    EXPECT_FALSE(samples.back().message.saturated);
  }
}

TEST_F(Inputs, TheFirstSampleAfterConfigureIsAWholeConversion) {
  board.set_force(0, 1.0);
  for (int i = 0; i < 5; ++i) {
    client.forget();
    board.cell(0).forget_conversions();
    configure();
    client.run(milliseconds(400 + 7 * i));
    const auto samples = samples_of(0);
    ASSERT_FALSE(samples.empty());
    const auto& first = samples.front().message;
    bool real = false;
    for (const Conversion& conversion : board.cell(0).conversions()) {
      const double stamped = us_of(board.true_time(first.time_us));
      real = real || std::abs(us_of(conversion.ready) - stamped) < 100;
    }
    EXPECT_TRUE(real) << "its stamp is no conversion's";
    EXPECT_EQ(first.counts, 120000);
  }
}

TEST_F(Inputs, TheRateFollowsTheConfiguration) {
  link::Configure slow = full_configuration();
  slow.cell_rate_sps = 10;
  configure(slow);
  EXPECT_FALSE(board.fast_cells());
  client.run(milliseconds(1500));
  client.forget();
  client.run(seconds(3));
  EXPECT_NEAR(static_cast<double>(samples_of(1).size()), 30, 1.01);
  const link::Status& status = client.all<link::Status>().back().message;
  EXPECT_NEAR(status.cell_rate_centihertz[1], 1000 * (1 - 0.011), 15) << "its oscillator's";
  configure();
  EXPECT_TRUE(board.fast_cells());
  client.run(milliseconds(1500));
  client.forget();
  client.run(seconds(3));
  EXPECT_NEAR(static_cast<double>(samples_of(1).size()), 240, 5);
}

TEST_F(Inputs, GainAndInputFollowTheConfiguration) {
  link::Configure configuration = full_configuration();
  configuration.cells[1] = link::CellInput::a64;
  configuration.cells[2] = link::CellInput::b32;
  configuration.cells[3] = link::CellInput::off;
  configure(configuration);
  client.run(seconds(1));
  EXPECT_EQ(board.cell(0).gain(), 128U);
  EXPECT_EQ(board.cell(1).gain(), 64U);
  EXPECT_EQ(board.cell(2).gain(), 32U);
  EXPECT_TRUE(board.cell(3).powered_down());
  EXPECT_TRUE(samples_of(3).empty());
  EXPECT_TRUE(faults_of(3).empty()) << "what is off is not missed";
  EXPECT_EQ(samples_of(1).front().message.counts, 10000) << "from the first sample on";
  EXPECT_EQ(samples_of(2).front().message.counts, 5000);
}

TEST_F(Inputs, ACellThatIsNotWiredIsSaidNotZero) {
  board.cell(2).set_wiring(Hx711::Wiring::disconnected);
  configure();
  client.run(seconds(3));
  EXPECT_TRUE(samples_of(2).empty());
  ASSERT_EQ(faults_of(2).size(), 1U) << "said once";
  EXPECT_EQ(faults_of(2)[0].code, link::FaultCode::cell_silent);
  EXPECT_GT(samples_of(1).size(), 200U) << "the others go on";
}

TEST_F(Inputs, ACellThatComesBackGoesOn) {
  configure();
  client.run(seconds(1));
  board.cell(1).set_wiring(Hx711::Wiring::disconnected);
  client.run(seconds(3));
  ASSERT_FALSE(faults_of(1).empty());
  EXPECT_EQ(faults_of(1)[0].code, link::FaultCode::cell_silent);
  const std::size_t before = samples_of(1).size();
  board.cell(1).set_wiring(Hx711::Wiring::connected);
  client.run(seconds(1));
  EXPECT_GT(samples_of(1).size(), before + 40);
}

TEST_F(Inputs, AStuckLineIsSaidAndSendsNoNumbers) {
  board.cell(0).set_wiring(Hx711::Wiring::stuck_low);
  configure();
  client.run(seconds(3));
  EXPECT_TRUE(samples_of(0).empty());
  ASSERT_EQ(faults_of(0).size(), 1U);
  EXPECT_EQ(faults_of(0)[0].code, link::FaultCode::cell_stuck);
  EXPECT_GT(samples_of(3).size(), 200U);
}

TEST_F(Inputs, SaturationIsSaid) {
  board.set_force(0, 500);
  board.set_force(1, -500);
  configure();
  client.run(seconds(1));
  ASSERT_FALSE(samples_of(0).empty());
  EXPECT_TRUE(samples_of(0).back().message.saturated);
  EXPECT_EQ(samples_of(0).back().message.counts, 0x7FFFFF);
  EXPECT_TRUE(samples_of(1).back().message.saturated);
  EXPECT_EQ(samples_of(1).back().message.counts, -0x800000);
  EXPECT_FALSE(samples_of(2).back().message.saturated);
}

TEST_F(Inputs, TareIsTheMeanOfTheNextConversions) {
  configure();
  board.set_force(3, -0.25);
  board.cell(3).bridge().noise_counts = 50;
  client.run(milliseconds(500));
  ASSERT_EQ(client.ask(link::Tare{1 << 3, 40}), link::Result::ok);
  const auto result = client.next<link::TareResult>();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->message.channel, 3);
  EXPECT_EQ(result->message.conversions, 40);
  EXPECT_NEAR(result->message.mean_counts, -5000, 50 / std::sqrt(40.0) * 4);
  EXPECT_NEAR(result->message.spread_counts, 50 * 4.3, 50 * 2.5);
  EXPECT_EQ(client.ask(link::Tare{1 << 5, 40}), link::Result::out_of_range);
}

TEST_F(Inputs, VoltagesAndSupplyAreMeasured) {
  board.set_adc(0, 1.25);
  board.set_adc(1, 4.0);
  configure();
  client.run(seconds(3));
  std::array<int, 2> last{};
  for (const auto& sample : client.all<link::AdcSample>())
    last.at(sample.message.channel) = sample.message.counts;
  EXPECT_NEAR(last[0], 1.25 / 5 * 1024, 1);
  EXPECT_NEAR(last[1], 4.0 / 5 * 1024, 1);
  EXPECT_NEAR(client.all<link::Status>().back().message.supply_mv, 5000, 25);
  board.adc().set_supply(4.0);
  client.run(seconds(3));
  EXPECT_NEAR(client.all<link::Status>().back().message.supply_mv, 4000, 25);
  bool low = false;
  for (const auto& fault : client.all<link::Fault>())
    low = low || fault.message.code == link::FaultCode::supply_low;
  EXPECT_TRUE(low);
}

TEST_F(Inputs, ABouncingButtonIsOneEventAtItsFirstEdge) {
  configure();
  client.run(milliseconds(300));
  int events = 0;
  for (int i = 0; i < 6; ++i) {
    const unsigned button = i % 2;
    for (const bool pressed : {true, false}) {
      const VirtualTime at = board.now() + milliseconds(10) + microseconds(137 * i);
      board.move_button(button, pressed, at, 6, milliseconds(3));
      client.run(milliseconds(120));
      const auto& all = client.all<link::ButtonEvent>();
      ASSERT_EQ(all.size(), static_cast<std::size_t>(++events));
      EXPECT_EQ(all.back().message.button, button);
      EXPECT_EQ(all.back().message.pressed, pressed);
      const VirtualTime stamped = board.true_time(all.back().message.time_us);
      EXPECT_NEAR(us_of(stamped - at), 0, 50) << "us";
      EXPECT_LT(us_of(all.back().end - at), 60e3) << "us until it is told";
    }
  }
}

TEST_F(Inputs, AResetIsNoButton) {
  board.move_button(1, true, board.now());
  client.run(milliseconds(100));
  client.forget();
  board.press_reset();
  ASSERT_TRUE(client.greet());
  client.run(milliseconds(200));
  for (const auto& event : client.all<link::ButtonEvent>()) EXPECT_EQ(event.message.button, 1);
  board.move_button(1, false, board.now());
  client.run(milliseconds(200));
  client.forget();
  for (const bool pressed : {true, false}) {
    board.move_button(1, pressed, board.now());
    client.run(milliseconds(200));
  }
  ASSERT_EQ(client.all<link::ButtonEvent>().size(), 2U);
  EXPECT_TRUE(client.all<link::ButtonEvent>()[0].message.pressed);
  EXPECT_FALSE(client.all<link::ButtonEvent>()[1].message.pressed);
}

TEST_F(Inputs, ASpikeOnAButtonIsNone) {
  configure();
  for (int i = 0; i < 5; ++i) {
    board.move_button(0, true, board.now() + microseconds(100));
    board.move_button(0, false, board.now() + microseconds(300));
    client.run(milliseconds(50));
  }
  EXPECT_TRUE(client.all<link::ButtonEvent>().empty());
}

TEST_F(Inputs, TheClockWrapsWithoutAGap) {
  std::string symbol;
  for (const auto& [name, address] : board.core().symbols()) {
    if (name.find("overflows_us") != std::string::npos) symbol = name;
  }
  if (symbol.empty()) GTEST_SKIP() << "the image has no symbol overflows_us to preset";
  const auto at = static_cast<std::uint16_t>(*board.core().symbol(symbol) - 0x800000);
  // Where the clock begins, before the application sees it, it is set to 3.3 s before its end.
  const VirtualTime zero_before = board.clock_zero();
  board.press_reset();
  while (board.clock_zero() == zero_before) board.advance_by(microseconds(2));
  const std::uint32_t near_the_end = 0U - 100 * 32768U;
  for (unsigned i = 0; i < 4; ++i)
    board.core().data(static_cast<std::uint16_t>(at + i)) =
        static_cast<std::uint8_t>(near_the_end >> 8 * i);
  ASSERT_TRUE(client.greet());
  configure();
  client.run(milliseconds(800));
  client.forget();
  ASSERT_EQ(client.ask(link::Led{link::LedMode::steady, 100, 0, 0, 0, 0}), link::Result::ok);
  const VirtualTime heard = board.now();
  const std::uint64_t gaps = client.sequence_gaps();
  client.run(milliseconds(4500));
  bool wrapped = false;
  for (std::uint8_t channel = 0; channel < kCells; ++channel) {
    const auto samples = samples_of(channel);
    ASSERT_GT(samples.size(), 150U);
    const double period = 1e6 * board.cell(channel).period();
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const std::uint32_t before = samples[i - 1].message.time_us;
      const std::uint32_t now = samples[i].message.time_us;
      wrapped = wrapped || now < before;
      ASSERT_NEAR(static_cast<std::int32_t>(now - before), period, 60) << "us";
    }
  }
  EXPECT_TRUE(wrapped);
  EXPECT_NEAR(board.led().level(), 0.1, 0.006) << "silence is counted over the wrap";
  EXPECT_EQ(client.sequence_gaps(), gaps);
  client.run(milliseconds(600));
  EXPECT_EQ(board.led().level(), 0);
  EXPECT_NEAR(us_of(board.led().all().back().time - heard), 5e6, 0.03e6);
}

TEST_F(Inputs, NoiseOnTheLineCostsFramesNotTheBoard) {
  configure();
  std::mt19937 random(7);
  std::uniform_int_distribution<int> bit(0, 999);
  client.run(milliseconds(300));
  client.forget();
  constexpr int kRequests = 300;
  for (int i = 0; i < kRequests; ++i) {
    std::uint8_t body[link::kMaxBodyBytes];
    std::uint8_t frame[link::kMaxFrameBytes];
    const std::uint8_t count =
        link::encode(link::TimeRequest{}, static_cast<std::uint8_t>(i), body);
    const std::uint8_t bytes = link::write_frame(body, count, frame);
    for (std::uint8_t k = 0; k < bytes; ++k) {
      for (int b = 0; b < 8; ++b) {
        if (bit(random) == 0) frame[k] = static_cast<std::uint8_t>(frame[k] ^ 1U << b);
      }
    }
    board.write({frame, bytes});
    client.run(milliseconds(10));
  }
  client.run(milliseconds(1100));
  const std::size_t replies = client.all<link::TimeReply>().size();
  const link::Status& status = client.all<link::Status>().back().message;
  fmt::print("  {} of {} requests answered, {} damaged frames counted\n", replies, kRequests,
             status.bad_frames);
  EXPECT_GT(replies, kRequests * 85U / 100);
  EXPECT_LT(replies, static_cast<std::size_t>(kRequests)) << "or no bit was flipped";
  EXPECT_GT(status.bad_frames, 0);
  EXPECT_EQ(client.sequence_gaps(), 0U);
  EXPECT_EQ(client.ask(link::Led{link::LedMode::steady, 100, 0, 0, 0, 0}), link::Result::ok);
}

TEST_F(Inputs, GarbageAtFullSpeedStopsNothing) {
  configure();
  client.run(milliseconds(500));
  client.forget();
  std::mt19937 random(11);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 100; ++i) {
    std::vector<std::uint8_t> garbage(480);
    for (auto& b : garbage) b = static_cast<std::uint8_t>(byte(random));
    board.write(garbage);
    client.run(milliseconds(10));
  }
  EXPECT_EQ(board.core().resets(), 1U);
  EXPECT_EQ(client.sequence_gaps(), 0U);
  EXPECT_NEAR(static_cast<double>(samples_of(0).size()), 80, 3);
  client.run(milliseconds(100));
  client.send(link::TimeRequest{});  // ends the last piece of garbage and is lost with it
  EXPECT_EQ(client.ask(link::Led{link::LedMode::steady, 100, 0, 0, 0, 0}), link::Result::ok);
}

TEST_F(Inputs, HalfAFrameIsForgottenWithTheNext) {
  const std::uint8_t half[] = {5, 4, 7};
  board.write(half);
  client.run(milliseconds(100));
  const std::size_t before = client.all<link::TimeReply>().size();
  client.send(link::TimeRequest{});
  client.run(milliseconds(20));
  client.send(link::TimeRequest{});
  client.run(milliseconds(20));
  EXPECT_GE(client.all<link::TimeReply>().size(), before + 1);
}

TEST_F(Inputs, AnUnknownRequestIsAnswered) {
  std::uint8_t body[link::kMaxBodyBytes] = {0x55, 200, 1, 2, 3};
  std::uint8_t frame[link::kMaxFrameBytes];
  const std::uint8_t bytes = link::write_frame(body, 5, frame);
  board.write({frame, bytes});
  const auto answer = client.next<link::Answer>();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->message.request_kind, 0x55);
  EXPECT_EQ(answer->message.request_sequence, 200);
  EXPECT_EQ(answer->message.result, link::Result::unknown_kind);
}

TEST_F(Inputs, AWrongBaudIsNoise) {
  board.usart().set_baud(115200);
  for (int i = 0; i < 20; ++i) {
    client.send(link::TimeRequest{});
    client.run(milliseconds(20));
  }
  EXPECT_TRUE(client.all<link::TimeReply>().empty());
  board.usart().set_baud(500000);
  client.run(milliseconds(20));
  EXPECT_TRUE(client.greet());
}

TEST_F(Inputs, TwoHostsSeeThatTheyAreTwo) {
  configure();
  ASSERT_TRUE(client.greet(0x1111));
  client.run(milliseconds(1500));
  EXPECT_EQ(client.all<link::Status>().back().message.session, 0x1111U);
  ASSERT_TRUE(client.greet(0x2222));
  client.run(milliseconds(1500));
  EXPECT_EQ(client.all<link::Status>().back().message.session, 0x2222U);
}

}  // namespace
}  // namespace tagwrench::emulator

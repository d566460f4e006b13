#include <gtest/gtest.h>

#include "tests/cli/bridge.h"

namespace tagwrench {
namespace {

using test::lines_in;
using test::Outcome;
using test::run_bridge;

// What is plugged into the machine that runs this does not matter.
constexpr const char* kNobody = "no-such-serial-71c2";

TEST(ReadCli, ADeviceThatIsNotThereIsOneLineAndStatusTwo) {
  const Outcome outcome = run_bridge({"read", kNobody});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(lines_in(outcome.err), 1u);
  EXPECT_NE(outcome.err.find(kNobody), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("read --list"), std::string::npos) << outcome.err;
}

TEST(ReadCli, WaitingEndsWithTheTimeOrASignal) {
  EXPECT_EQ(run_bridge({"read", kNobody, "--wait", "--seconds", "0.05"}).status, 0);
  test::Bridge waiting({"read", kNobody, "--wait"});
  ASSERT_TRUE(waiting.wait_for_message("waiting for"));
  waiting.signal(SIGTERM);
  EXPECT_EQ(waiting.finish().status, 0);
}

TEST(ReadCli, AListIsAListWhateverIsPluggedIn) {
  const Outcome outcome = run_bridge({"read", "--list"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.empty(), outcome.err.empty());
}

TEST(ReadCli, OptionsThatContradictEachOtherAreWrongUsage) {
  EXPECT_EQ(run_bridge({"read", "--json", "--csv"}).status, 2);
  EXPECT_EQ(run_bridge({"read", "--list", "--wait"}).status, 2);
  EXPECT_EQ(run_bridge({"read", "--seconds", "-1"}).status, 2);
}

TEST(ReadCli, ALogThatCannotBeWrittenIsNamed) {
  const Outcome outcome = run_bridge({"read", kNobody, "--log", "/no/such/folder/log.csv"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("/no/such/folder/log.csv"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tagwrench

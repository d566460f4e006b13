#include "host/web/server/server_timer.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>

namespace tagwrench {
namespace {

/// Both waits are over before anything runs, so both are in the queue when the first is done.
struct TwoTimersAtOnce : testing::Test {
  boost::asio::io_context context;
  ServerTimer first{context};
  std::unique_ptr<ServerTimer> second = std::make_unique<ServerTimer>(context);
  int done = 0;

  void run(std::function<void()> in_between) {
    first.after(-std::chrono::seconds(2), std::move(in_between));
    second->after(-std::chrono::seconds(1), [this] { ++done; });
    context.run();
  }
};

TEST_F(TwoTimersAtOnce, WhatIsOverIsDone) {
  run([] {});
  EXPECT_EQ(done, 1);
}

TEST_F(TwoTimersAtOnce, WhatIsQueuedIsNotDoneOnceItsTimerIsGone) {
  run([this] { second.reset(); });
  EXPECT_EQ(done, 0);
}

TEST_F(TwoTimersAtOnce, WhatIsQueuedIsNotDoneOnceItIsCancelled) {
  run([this] { second->cancel(); });
  EXPECT_EQ(done, 0);
}

TEST_F(TwoTimersAtOnce, WhatIsQueuedIsNotDoneOnceOtherWorkIsInItsPlace) {
  int other = 0;
  run([&] { second->after({}, [&other] { ++other; }); });
  EXPECT_EQ(done, 0);
  EXPECT_EQ(other, 1);
}

}  // namespace
}  // namespace tagwrench

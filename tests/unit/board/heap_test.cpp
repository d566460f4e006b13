// What the frame loop calls of the link does without the heap.
#include <gtest/gtest.h>

#include <cmath>

#include "board_model.h"
#include "host/board/board_link.h"
#include "host/board/cell_calibration.h"
#include "host/board/clock_sync.h"
#include "host/board/optoforce.h"
#include "optoforce_frames.h"
#include "pty.h"
#include "tests/support/heap_count.h"

namespace tagwrench::link {
namespace {

template <class Call>
long allocations_of(Call&& call) {
  test::start_counting_allocations();
  call();
  return test::stop_counting_allocations();
}

TEST(LinkHeapTest, ServingABoardAllocatesNothingEvenWhenItIsUnplugged) {
  SyntheticLink clock(1, {}, 0);
  BoardModel board(clock);
  Pty device;
  BoardLink link(device.path(), new_session());
  SampleHistory history({.period = 1.0 / 80, .delay = 0});
  const auto now = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  long allocations = 0;
  std::uint16_t sequence = 0;
  std::uint64_t taken = 0;
  while (taken < 200) {
    readable(link.poll_fd(), 5);
    board.take(device.read(), now());
    if (board.configured) board.send_cell(0, sequence, now(), sequence);
    ++sequence;
    if (const auto out = board.take_out(); !out.empty()) device.write(out);
    allocations += allocations_of([&] {
      link.service();
      for (CellReading reading; link.session().next(reading); ++taken)
        history.add(reading.time.time, reading.time.sigma, reading.counts);
      history.at(std::chrono::steady_clock::now());
      for (BoardEvent news; link.next(news);) {
      }
    });
  }
  EXPECT_TRUE(link.session().clock().known());
  device.unplug();
  while (link.plugged()) {
    readable(link.poll_fd(), 100);
    allocations += allocations_of([&] { link.service(); });
  }
  const double end = now() + 1;
  while (now() < end) {
    readable(link.poll_fd(), 100);
    allocations += allocations_of([&] { link.service(); });
  }
  EXPECT_EQ(allocations, 0);
}

TEST(LinkHeapTest, ReadingAnOptoforceSensorAllocatesNothing) {
  Bytes stream;
  for (std::uint16_t i = 0; i < 500; ++i) {
    const Bytes frame = optoforce_frame(i, 0, {1, 2, 3, 4, 5, 6});
    stream.insert(stream.end(), frame.begin(), frame.end());
    if (i % 7 == 0) stream.push_back(0xAA);
  }
  OptoforceParser parser;
  CounterClock clock(0.01);
  TimePoint now{std::chrono::seconds(100)};
  EXPECT_EQ(allocations_of([&] {
              parser.take(stream, [&](const OptoforceFrame& frame) {
                now += std::chrono::milliseconds(10);
                clock.take(frame.counter, now);
              });
            }),
            0);
  EXPECT_EQ(parser.counters().frames, 500u);
}

}  // namespace
}  // namespace tagwrench::link

// A session and a model of a board on one line, for the session's tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "board_model.h"
#include "host/board/board_session.h"

namespace tagwrench::link {
inline Led steady(std::uint16_t level_permille) {
  Led out{};
  out.mode = LedMode::steady;
  out.level_permille = level_permille;
  return out;
}

class BoardSessionTest : public ::testing::Test {
 protected:
  BoardSessionTest() : clock(1, {}, 1500e-6), board(clock), session(options()) {}

  static BoardSessionOptions options() {
    BoardSessionOptions out;
    out.session = 0xCAFE0001;
    out.new_id = {{9, 9, 9, 9, 9, 9, 9, 9}, 8};
    return out;
  }

  /// Both sides in steps of 1 ms; a line without delay but that of its bytes.
  void run(double seconds) {
    const double until = now + seconds;
    while (now < until) {
      std::uint8_t bytes[BoardSession::kMaxBytesOut];
      const std::size_t count = session.poll(SyntheticLink::host(now), bytes);
      sent += count;
      const double arrived = now + static_cast<double>(count) * 20e-6;
      board.take({bytes, count}, arrived);
      for (int i = 0; i < chatter && !board.out.empty(); ++i) board.send_cell(1, i, arrived, 0);
      const std::vector<std::uint8_t> reply = board.take_out();
      if (!reply.empty() && connected) {
        session.take(reply,
                     SyntheticLink::host(arrived + static_cast<double>(reply.size()) * 20e-6));
      }
      for (BoardEvent item; session.next(item);) news.push_back(item);
      now += 1e-3;
      if (session.state() == BoardState::ready && status_period > 0 && now > next_status) {
        Status status{};
        status.time_us = clock.board_us(now);
        status.session = board.hello.session;
        board.send(status);
        next_status = now + status_period;
      }
    }
  }
  bool told(BoardEvent::Kind kind) const {
    return std::any_of(news.begin(), news.end(),
                       [&](const BoardEvent& n) { return n.kind == kind; });
  }

  SyntheticLink clock;
  BoardModel board;
  BoardSession session;
  std::vector<BoardEvent> news;
  double now = SyntheticLink::kStart + 1;
  double next_status = 0;
  double status_period = 1;
  bool connected = true;
  int chatter = 0;  ///< samples that come right behind every answer
  std::size_t sent = 0;
};

}  // namespace tagwrench::link

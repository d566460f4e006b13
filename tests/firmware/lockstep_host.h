// The host's side of the link and the emulated board on one virtual clock. The host's clock is the
// virtual time itself; bytes take a constant time each way.
#pragma once

#include "host/board/board_session.h"
#include "tests/firmware/emulated_board.h"

namespace tagwrench::emulator {

class LockstepHost {
 public:
  static constexpr VirtualTime kDelay = std::chrono::microseconds(80);  ///< each way

  explicit LockstepHost(EmulatedBoard& board, const link::BoardSessionOptions& options)
      : board_(board), session_(options) {}

  link::BoardSession& session() { return session_; }
  EmulatedBoard& board() { return board_; }

  static TimePoint host_time(VirtualTime time) { return TimePoint(time); }

  /// Runs both until then; the past is left alone.
  void run_until(VirtualTime time) {
    constexpr VirtualTime kStep = std::chrono::microseconds(500);
    while (board_.now() < time) {
      exchange();
      board_.advance_to(std::min(time, board_.now() + kStep));
    }
    exchange();
  }

  /// Until the session is ready and its clock has had `settling` to be known well; false if it does
  /// not get ready.
  bool settle(VirtualTime settling) {
    const VirtualTime patience = board_.now() + std::chrono::seconds(3);
    while (session_.state() != link::BoardState::ready) {
      if (board_.now() > patience) return false;
      run_until(board_.now() + std::chrono::milliseconds(10));
    }
    run_until(board_.now() + settling);
    return true;
  }

 private:
  void exchange() {
    for (const SentByte& byte : board_.read())
      session_.take({&byte.value, 1}, host_time(byte.end + kDelay));
    std::uint8_t out[link::BoardSession::kMaxBytesOut];
    const std::size_t count = session_.poll(host_time(board_.now()), out);
    if (count > 0) board_.write_at(board_.now() + kDelay, {out, count});
  }

  EmulatedBoard& board_;
  link::BoardSession session_;
};

}  // namespace tagwrench::emulator

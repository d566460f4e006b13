// The host's end of the line to an emulated board, in lockstep with it: sends requests, keeps every
// report with the virtual time at which its last bit had come.
#pragma once

#include <functional>
#include <optional>
#include <tuple>
#include <vector>

#include "protocol/codec.h"
#include "tests/firmware/emulated_board.h"

namespace tagwrench::emulator {

template <typename Message>
struct Arrived {
  Message message{};
  std::uint8_t sequence = 0;  ///< of the frame
  VirtualTime begin{};        ///< of the frame's first start bit
  VirtualTime end{};          ///< of its last stop bit
};

/// A request that was sent.
struct Sent {
  std::uint8_t sequence = 0;
  VirtualTime begin{};
  VirtualTime end{};
};

class BoardClient {
 public:
  explicit BoardClient(EmulatedBoard& board) : board_(board) {}

  template <typename Message>
  Sent send(const Message& message) {
    std::uint8_t body[link::kMaxBodyBytes];
    std::uint8_t frame[link::kMaxFrameBytes];
    const std::uint8_t sequence = sequence_++;
    const std::uint8_t count = link::encode(message, sequence, body);
    const std::uint8_t bytes = link::write_frame(body, count, frame);
    const VirtualTime begin = std::max(board_.now(), board_.usart().line_free());
    board_.write({frame, bytes});
    return {sequence, begin, board_.usart().line_free()};
  }

  /// Runs the board and takes in what it sends; `each` is called every `step`.
  void run(VirtualTime duration, VirtualTime step = std::chrono::milliseconds(1));
  void run_until(VirtualTime time, VirtualTime step = std::chrono::milliseconds(1));
  /// Runs until the condition holds (true) or the time is over (false).
  bool run_while_not(const std::function<bool()>& condition, VirtualTime most);

  /// All reports of a kind so far.
  template <typename Message>
  std::vector<Arrived<Message>>& all() {
    return std::get<std::vector<Arrived<Message>>>(reports_);
  }
  /// Runs until the next report of a kind comes.
  template <typename Message>
  std::optional<Arrived<Message>> next(VirtualTime most = std::chrono::seconds(2)) {
    const std::size_t before = all<Message>().size();
    if (!run_while_not([&] { return all<Message>().size() > before; }, most)) return std::nullopt;
    return all<Message>()[before];
  }
  /// Sends a request and runs until its Answer comes.
  template <typename Message>
  std::optional<link::Result> ask(const Message& message) {
    const Sent sent = send(message);
    const std::size_t before = all<link::Answer>().size();
    const bool came = run_while_not(
        [&] {
          const auto& answers = all<link::Answer>();
          return answers.size() > before &&
                 answers.back().message.request_sequence == sent.sequence;
        },
        std::chrono::seconds(2));
    if (!came) return std::nullopt;
    return all<link::Answer>().back().message.result;
  }
  /// HelloRequest to Hello and Capabilities; boards that were just reset included.
  std::optional<link::Hello> greet(std::uint32_t session = 0x1234);

  void forget();
  std::uint64_t frames() const { return frames_; }
  std::uint64_t damaged() const { return reader_.damaged_frames(); }
  std::uint64_t sequence_gaps() const { return gaps_; }
  std::uint64_t undecodable() const { return undecodable_; }
  std::uint64_t bytes() const { return bytes_; }
  EmulatedBoard& board() { return board_; }

 private:
  void take_in();
  void take_frame(VirtualTime end);
  template <typename Message>
  void keep(VirtualTime end);

  EmulatedBoard& board_;
  link::FrameReader reader_;
  std::uint8_t sequence_ = 0;
  std::optional<std::uint8_t> heard_sequence_;
  std::optional<VirtualTime> frame_begin_;
  std::uint64_t frames_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t undecodable_ = 0;
  std::uint64_t bytes_ = 0;
  std::tuple<std::vector<Arrived<link::Hello>>, std::vector<Arrived<link::Capabilities>>,
             std::vector<Arrived<link::CellSample>>, std::vector<Arrived<link::AdcSample>>,
             std::vector<Arrived<link::ButtonEvent>>, std::vector<Arrived<link::TimeReply>>,
             std::vector<Arrived<link::Status>>, std::vector<Arrived<link::Answer>>,
             std::vector<Arrived<link::TareResult>>, std::vector<Arrived<link::Fault>>>
      reports_;
};

/// What most tests want: all cells at 80/s, both ADC channels at 100 Hz.
link::Configure full_configuration();
/// `near_us` with the upper part of a 32-bit time stamp's neighbour: unwraps board time.
std::int64_t unwrap_us(std::uint32_t stamp_us, std::int64_t near_us);

}  // namespace tagwrench::emulator

// The live view for people: six bars with units, the status in words, rate, latency and losses.
#pragma once

#include <unistd.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/output/line_outputs.h"
#include "host/output/output.h"

namespace tagwrench {

struct TerminalOptions {
  int fd = STDERR_FILENO;                ///< standard output carries data only
  Vector6 full_scale = Vector6::Ones();  ///< of the bars: N, N m; positive
  std::string source;                    ///< one line: what the frames come from
  std::vector<std::string> devices;      ///< one line each: what else is sent
  bool color = true;                     ///< the environment's NO_COLOR wins
};

/// What the view shows besides the sample itself.
struct TerminalFigures {
  double rate_hz = 0;  ///< 0: not known yet
  double latency_ms = 0;
  std::uint64_t dropped = 0;
};

/// On a terminal: redrawn in place, at most 15 times a second, within its width and height.
/// Elsewhere (a file, a pipe, TERM=dumb): one plain line every 0.5 s of sample time. Never blocks.
class TerminalOutput : public Output {
 public:
  /// Throws ConfigError if the descriptor is not open.
  explicit TerminalOutput(const TerminalOptions& options);
  /// Leaves the last view on the screen, the cursor below it.
  ~TerminalOutput() override;

  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return sink_.failure(); }
  /// Shows the line below the bars; false where there is no view.
  bool notice(std::string_view line) noexcept override;

 private:
  SendStatus draw(const Sample& sample, TimePoint now) noexcept;
  void account(const Sample& sample) noexcept;

  TerminalOptions options_;
  TextSink sink_;
  bool live_ = false;
  std::array<char, TextSink::kMaxBlock> screen_{};
  std::array<char, 320> notice_{};
  std::size_t notice_size_ = 0;
  TerminalFigures figures_;
  double period_s_ = 0;  ///< smoothed
  std::optional<TimePoint> first_capture_;
  TimePoint last_capture_{};
  Sample last_;
  TimePoint next_line_{};
  TimePoint next_draw_{};
  int lines_drawn_ = 0;
  int drawn_width_ = 0;
};

/// The lines of the view, none wider than `width` and not more than `height`, control characters
/// and all: `up` lines of an earlier view are overwritten. Returns the number of characters;
/// `lines` is the number of lines in them.
std::size_t draw_view(std::array<char, TextSink::kMaxBlock>& screen, const TerminalOptions& options,
                      const Sample& sample, const TerminalFigures& figures, std::string_view notice,
                      int width, int height, int up, int& lines) noexcept;

/// "t 1.52 s  ok  F  0.012 -0.301  0.250 N  M ... mN m  60.1 Hz  latency 0.8 ms  dropped 0"
std::size_t format_plain_line(std::array<char, TextSink::kMaxBlock>& line, const Sample& sample,
                              const TerminalFigures& figures, double t_s) noexcept;

}  // namespace tagwrench

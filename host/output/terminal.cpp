#include "host/output/terminal.h"

#include <sys/ioctl.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "host/output/output.h"
#include "host/output/sample_text.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kDrawPeriod{67};
constexpr milliseconds kLinePeriod{500};
constexpr double kSmoothing = 0.05;  ///< weight of a new sample in rate and latency
constexpr std::string_view kHideCursor = "\x1b[?25l";
constexpr std::string_view kClear = "\x1b[H\x1b[J";
constexpr std::string_view kLeave = "\r\n\x1b[?25h";

bool is_terminal(int fd) {
  const char* term = std::getenv("TERM");
  return isatty(fd) == 1 && term != nullptr && std::strcmp(term, "dumb") != 0;
}

bool color_wanted(bool asked) {
  const char* no_color = std::getenv("NO_COLOR");  // no-color.org: set and not empty
  return asked && (no_color == nullptr || *no_color == '\0');
}

}  // namespace

TerminalOutput::TerminalOutput(const TerminalOptions& options)
    : options_(options), sink_(options.fd, "terminal", false), live_(is_terminal(sink_.fd())) {
  options_.color = color_wanted(options.color);
}

TerminalOutput::~TerminalOutput() {
  if (live_ && lines_drawn_ > 0) sink_.write(kLeave);
}

bool TerminalOutput::notice(std::string_view line) noexcept {
  if (!live_) return false;
  notice_size_ = std::min(line.size(), notice_.size());
  std::memcpy(notice_.data(), line.data(), notice_size_);
  draw(last_, std::chrono::steady_clock::now());  // no sample may follow for a long time
  return true;
}

void TerminalOutput::account(const Sample& sample) noexcept {
  figures_.dropped += sample.dropped;
  const double late_ms = static_cast<double>(latency_us(sample)) * 1e-3;
  if (!first_capture_) {
    first_capture_ = next_line_ = sample.capture_time;
    figures_.latency_ms = late_ms;
  } else {
    figures_.latency_ms += kSmoothing * (late_ms - figures_.latency_ms);
    const double period_s =
        std::chrono::duration<double>(sample.capture_time - last_capture_).count();
    if (period_s > 0) {
      period_s_ = period_s_ > 0 ? period_s_ + kSmoothing * (period_s - period_s_) : period_s;
      figures_.rate_hz = 1 / period_s_;
    }
  }
  last_capture_ = sample.capture_time;
}

SendStatus TerminalOutput::send(const Sample& sample) noexcept {
  const TimePoint now = std::chrono::steady_clock::now();
  account(sample);
  const bool changed = sample.status != last_.status;  // shown at once: nothing may follow a loss
  last_ = sample;
  if (live_) return changed || now >= next_draw_ ? draw(sample, now) : SendStatus::ok;
  return changed || sample.capture_time >= next_line_ ? print_line(sample) : SendStatus::ok;
}

SendStatus TerminalOutput::draw(const Sample& sample, TimePoint now) noexcept {
  next_draw_ = now + kDrawPeriod;
  winsize size{};
  const bool known =
      ioctl(sink_.fd(), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0;
  const int width = known ? size.ws_col : 80;
  const int height = known ? size.ws_row : 24;
  // A new width folds the old lines anew, and nobody can say how many there are now: start on a
  // clean screen.
  if (lines_drawn_ == 0 || width != drawn_width_ || lines_drawn_ > height) {
    const SendStatus status = sink_.write(lines_drawn_ == 0 ? kHideCursor : kClear);
    if (status != SendStatus::ok) return status;
    lines_drawn_ = 0;
    drawn_width_ = width;
  }
  int lines = 0;
  const std::size_t length =
      draw_view(screen_, options_, sample, figures_, {notice_.data(), notice_size_}, width, height,
                lines_drawn_, lines);
  const SendStatus status = sink_.write({screen_.data(), length});
  if (status == SendStatus::ok) lines_drawn_ = lines;
  return status;
}

SendStatus TerminalOutput::print_line(const Sample& sample) noexcept {
  const double t_s = std::chrono::duration<double>(sample.capture_time - *first_capture_).count();
  const std::size_t length = format_plain_line(screen_, sample, figures_, t_s);
  // Lines stay on the grid of half seconds; after a gap the grid starts anew.
  next_line_ = std::max(next_line_ + kLinePeriod, sample.capture_time + kLinePeriod / 2);
  return sink_.write({screen_.data(), length});
}

}  // namespace tagwrench

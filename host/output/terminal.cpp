// The terminal's lines as pure text: no descriptors, no clock.
#include "host/output/terminal.h"

#include <fmt/format.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>

#include "host/core/axis_names.h"
#include "host/core/printable.h"

namespace tagwrench {
namespace {

using Screen = std::array<char, TextSink::kMaxBlock>;

constexpr int kNarrow = 60;          ///< columns below which sigma and full scale are left out
constexpr double kMilliBelow = 1.0;  ///< N m: torques with a smaller full scale are shown in mN m

struct Axis {
  const char* name;
  const char* unit;
  double scale;  ///< from SI to unit
};

/// All torques have one unit, that of the largest full scale.
Axis axis(int i, const Vector6& full_scale) {
  if (i < 3) return {kWrenchAxes[i], "N", 1};
  const bool milli = full_scale.tail<3>().maxCoeff() < kMilliBelow;
  return {kWrenchAxes[i], milli ? "mN m" : "N m", milli ? 1e3 : 1};
}

const char* in_words(Status status) {
  constexpr std::array kWords = {
      "ok", "acquiring: looking for the tags", "lost: tags or camera out of reach",
      "doubtful: not trusted, outputs neutral", "saturated: outside the calibrated range"};
  return kWords[static_cast<std::size_t>(status)];
}

const char* color_of(Status status) {
  constexpr const char *kRed = "\x1b[31m", *kGreen = "\x1b[32m", *kYellow = "\x1b[33m";
  constexpr std::array kColors = {kGreen, "\x1b[36m" /* cyan */, kRed, kRed, kYellow};
  return kColors[static_cast<std::size_t>(status)];
}

/// Appends lines, cut to the width without control sequences; what the buffer cannot hold is out.
class View {
 public:
  View(Screen& screen, int width, int height) : screen_(screen), width_(width), height_(height) {}

  void raw(std::string_view text) {
    if (text.size() > screen_.size() - size_) return;
    size_ = static_cast<std::size_t>(std::copy(text.begin(), text.end(), screen_.begin() + size_) -
                                     screen_.begin());
  }

  /// Text of one column a character. UTF-8 continuation bytes take none; control bytes become '?'.
  void text(std::string_view text) {
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      const bool continues = (byte & 0xc0) == 0x80;
      if (!continues && column_ >= width_) return;
      if (!continues) ++column_;
      raw(byte < 0x20 || byte == 0x7f ? std::string_view("?") : std::string_view(&c, 1));
    }
  }

  template <typename... Args>
  void print(fmt::format_string<Args...> format, Args&&... args) {
    std::array<char, 512> buffer;
    const auto done =
        fmt::format_to_n(buffer.data(), buffer.size(), format, std::forward<Args>(args)...);
    text({buffer.data(), std::min(done.size, buffer.size())});
  }

  /// False: it would not fit on the screen. The last has no newline, so that nothing scrolls.
  bool next_line() {
    if (lines_ >= height_) return false;
    if (lines_ > 0) raw("\x1b[K\r\n");
    ++lines_;
    column_ = 0;
    return true;
  }

  void finish() { raw("\x1b[K\x1b[J"); }

  std::size_t size() const { return size_; }
  int lines() const { return lines_; }

 private:
  Screen& screen_;
  int width_;
  int height_;
  std::size_t size_ = 0;
  int lines_ = 0;
  int column_ = 0;
};

/// Zero in the middle; '#' where the value is beyond the full scale.
void draw_bar(View& view, double fraction, int half) {
  const int filled = static_cast<int>(std::lround(std::clamp(fraction, -1.0, 1.0) * half));
  const char fill = std::abs(fraction) > 1 ? '#' : '=';
  std::array<char, 256> bar;
  bar.fill(' ');
  const auto middle = static_cast<std::ptrdiff_t>(half);
  bar[static_cast<std::size_t>(middle)] = '|';
  if (filled > 0) std::fill_n(bar.begin() + middle + 1, filled, fill);
  if (filled < 0) std::fill_n(bar.begin() + middle + filled, -filled, fill);
  view.text("[");
  view.text({bar.data(), static_cast<std::size_t>(2 * half + 1)});
  view.text("]");
}

void draw_axis(View& view, int i, const TerminalOptions& options, const Sample& sample,
               bool numbers, int width) {
  const Axis a = axis(i, options.full_scale);
  const double value = numbers ? sample.wrench[i] : 0;
  const double sigma = numbers ? sample.wrench_sigma[i] : 0;
  const double full = options.full_scale[i];
  view.print("{} {:>9.3f} {:<4} ", a.name, value * a.scale, a.unit);
  constexpr int kFigures = 18;  // of the print above
  constexpr int kAside = 30;    // of the print below
  const bool wide = width >= kNarrow;
  const int room = width - kFigures - 3 - (wide ? kAside : 0);
  const int half = std::clamp(room / 2, 0, 40);
  if (half >= 2) draw_bar(view, full > 0 ? value / full : 0, half);
  if (wide) view.print(" +/- {:<8.3g} of {:.4g} {}", sigma * a.scale, full * a.scale, a.unit);
}

const char* in_words(ZeroState state) {
  constexpr std::array kWords = {"set", "kept: touched",
                                 "kept: far off; nobody there? run `tagwrench zero`", "following"};
  return kWords[static_cast<std::size_t>(state)];
}

/// What is taken off, in the axes' own units.
void draw_zero(View& view, const TerminalOptions& options, const Sample& sample) {
  view.print("zero    ");
  for (int i = 0; i < 6; ++i) {
    const Axis a = axis(i, options.full_scale);
    view.print("{:.3f} ", sample.zero[i] * a.scale);
    if (i % 3 == 2) view.print("{}  ", a.unit);
  }
  view.text(in_words(sample.zero_state));
}

/// Over as many lines as it takes, broken at spaces.
void draw_note(View& view, std::string_view note, int width) {
  constexpr std::string_view kFirst = "note    ", kNext = "        ";
  const auto room = static_cast<std::size_t>(std::max(10, width - static_cast<int>(kFirst.size())));
  std::string_view label = kFirst;
  while (!note.empty() && view.next_line()) {
    std::size_t taken = note.size() <= room ? note.size() : note.rfind(' ', room);
    if (taken == 0 || taken == std::string_view::npos) taken = room;
    view.text(label);
    view.text(note.substr(0, taken));
    note.remove_prefix(taken);
    note.remove_prefix(std::min(note.size(), note.find_first_not_of(' ')));
    label = kNext;
  }
}

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

std::size_t draw_view(Screen& screen, const TerminalOptions& options, const Sample& sample,
                      const TerminalFigures& figures, std::string_view notice, int width,
                      int height, int up, int& lines) noexcept {
  const Status status = shown_status(sample);
  View view(screen, width, height);
  if (up > 1) {
    std::array<char, 16> move;
    const auto done = fmt::format_to_n(move.data(), move.size(), "\x1b[{}A", up - 1);
    view.raw({move.data(), done.size});
  }
  view.raw("\r");
  if (view.next_line()) {
    if (options.color) view.raw(color_of(status));
    view.print("{:<40}", in_words(status));
    if (options.color) view.raw("\x1b[0m");
  }
  if (view.next_line()) {
    view.print("{:.1f} Hz   latency {:.1f} ms   dropped {}   Ctrl-C ends", figures.rate_hz,
               figures.latency_ms, figures.dropped);
  }
  for (int i = 0; i < 6 && view.next_line(); ++i)
    draw_axis(view, i, options, sample, carries_numbers(status), width);
  const bool zero_is_of_use = sample.zero_state != ZeroState::off || !sample.zero.isZero();
  if (zero_is_of_use && view.next_line()) draw_zero(view, options, sample);
  if (!options.source.empty() && view.next_line()) view.print("source  {}", options.source);
  for (const std::string& device : options.devices)
    if (view.next_line()) view.print("output  {}", device);
  draw_note(view, notice, width);
  view.finish();
  lines = view.lines();
  return view.size();
}

std::size_t format_plain_line(Screen& line, const Sample& sample, const TerminalFigures& figures,
                              double t_s) noexcept {
  const Status status = shown_status(sample);
  static const Vector6 kZero = Vector6::Zero();
  const Vector6& w = carries_numbers(status) ? sample.wrench : kZero;
  const auto done =
      fmt::format_to_n(line.data(), line.size(),
                       "t {:.2f} s  {}  F {:6.3f} {:6.3f} {:6.3f} N  M {:6.1f} {:6.1f} {:6.1f} mN "
                       "m  {:.1f} Hz  latency {:.1f} ms  dropped {}\n",
                       t_s, name(status), w[0], w[1], w[2], w[3] * 1e3, w[4] * 1e3, w[5] * 1e3,
                       figures.rate_hz, figures.latency_ms, figures.dropped);
  return std::min(done.size, line.size());
}

TerminalOutput::TerminalOutput(const TerminalOptions& options)
    : options_(options), sink_(options.fd, "terminal", false), live_(is_terminal(sink_.fd())) {
  options_.color = color_wanted(options.color);
  options_.source = printable(options_.source);
  for (std::string& device : options_.devices) device = printable(device);
}

TerminalOutput::~TerminalOutput() {
  if (live_ && lines_drawn_ > 0) sink_.write(kLeave);
}

bool TerminalOutput::notice(std::string_view line) noexcept {
  if (!live_) return false;
  notice_size_ = write_printable(notice_, line);
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
  if (!changed && sample.capture_time < next_line_) return SendStatus::ok;
  const double t_s = std::chrono::duration<double>(sample.capture_time - *first_capture_).count();
  const std::size_t length = format_plain_line(screen_, sample, figures_, t_s);
  // Lines stay on the grid of half seconds; after a gap the grid starts anew.
  next_line_ = std::max(next_line_ + kLinePeriod, sample.capture_time + kLinePeriod / 2);
  return sink_.write({screen_.data(), length});
}

SendStatus TerminalOutput::draw(const Sample& sample, TimePoint now) noexcept {
  next_draw_ = now + kDrawPeriod;
  winsize size{};
  const bool known =
      ioctl(sink_.fd(), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0;
  const int width = known ? size.ws_col : 80;
  const int height = known ? size.ws_row : 24;
  // A new width folds the old lines anew, into nobody knows how many: start on a clean screen.
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

}  // namespace tagwrench

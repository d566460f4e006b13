// The terminal's lines as pure text: no descriptors, no clock.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "host/core/axis_names.h"
#include "host/output/output.h"
#include "host/output/terminal.h"

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
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::acquiring:
      return "acquiring: looking for the tags";
    case Status::lost:
      return "lost: tags or camera out of reach";
    case Status::doubtful:
      return "doubtful: not trusted, outputs neutral";
    case Status::saturated:
      return "saturated: outside the calibrated range";
  }
  return "?";
}

const char* color_of(Status status) {
  switch (status) {
    case Status::ok:
      return "\x1b[32m";  // green
    case Status::saturated:
      return "\x1b[33m";  // yellow
    case Status::acquiring:
      return "\x1b[36m";  // cyan
    case Status::lost:
    case Status::doubtful:
      break;
  }
  return "\x1b[31m";  // red
}

/// Appends lines, cut to the width; control sequences count for no column. What does not fit in the
/// buffer is left out.
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

  /// False: the next line would not fit on the screen. The last line has no newline, so that
  /// nothing scrolls.
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
  switch (state) {
    case ZeroState::off:
      return "set";
    case ZeroState::touched:
      return "kept: touched";
    case ZeroState::far:
      return "kept: far off; nobody there? run `tagwrench zero`";
    case ZeroState::following:
      return "following";
  }
  return "?";
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
  for (int i = 0; i < 6 && view.next_line(); ++i) {
    draw_axis(view, i, options, sample, carries_numbers(status), width);
  }
  const bool zero_is_of_use = sample.zero_state != ZeroState::off || !sample.zero.isZero();
  if (zero_is_of_use && view.next_line()) draw_zero(view, options, sample);
  if (!options.source.empty() && view.next_line()) view.print("source  {}", options.source);
  for (const std::string& device : options.devices) {
    if (view.next_line()) view.print("output  {}", device);
  }
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
  const auto done = fmt::format_to_n(
      line.data(), line.size(),
      "t {:.2f} s  {}  F {:6.3f} {:6.3f} {:6.3f} N  M {:6.1f} {:6.1f} {:6.1f} mN m  {:.1f} Hz  "
      "latency {:.1f} ms  dropped {}\n",
      t_s, name(status), w[0], w[1], w[2], w[3] * 1e3, w[4] * 1e3, w[5] * 1e3, figures.rate_hz,
      figures.latency_ms, figures.dropped);
  return std::min(done.size, line.size());
}

}  // namespace tagwrench

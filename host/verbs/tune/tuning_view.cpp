#include "host/verbs/tune/tuning_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace tagwrench {
namespace {

constexpr std::array<const char*, 6> kLoads = {"Fx", "Fy", "Fz", "Mx", "My", "Mz"};
constexpr std::array<const char*, 6> kMotions = {"x", "y", "z", "rx", "ry", "rz"};
constexpr std::string_view kHelp =
    "arrows choose and move   space on/off   u undo   s save   q leave";
constexpr int kAround = 11;  // lines that are not knobs

/// Control bytes become '?', and what is beyond the width is cut; UTF-8 stays whole.
std::string fitted(std::string_view text, int width) {
  std::string out;
  int column = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool continues = (byte & 0xc0) == 0x80;
    if (!continues && ++column > width) break;
    out += byte < 0x20 || byte == 0x7f ? '?' : c;
  }
  return out;
}

/// Zero in the middle.
std::string two_sided(double part, int half) {
  const auto filled = static_cast<std::size_t>(std::lround(std::min(std::abs(part), 1.0) * half));
  const auto side = static_cast<std::size_t>(half);
  const char fill = std::abs(part) > 1 ? '#' : '=';
  const std::string blank(side, ' ');
  const std::string bar(filled, fill);
  const std::string rest(side - filled, ' ');
  return part < 0 ? "[" + rest + bar + "|" + blank + "]" : "[" + blank + "|" + bar + rest + "]";
}

std::string slider(const Knob& knob, int length) {
  if (knob.kind == Knob::Kind::choice || !knob.applies) return {};
  const auto last = static_cast<std::size_t>(std::max(1, length - 1));
  std::string line(last + 1, '-');
  line[static_cast<std::size_t>(std::lround(place(knob) * static_cast<double>(last)))] = 'O';
  return "[" + line + "]";
}

std::string reading_line(std::size_t i, const Tuning& tuning, const LiveReading& now, int half) {
  const auto axis = static_cast<Eigen::Index>(i);
  const bool force = i < 3;
  const double unit = force ? 1 : 1e-3;
  const Vector6& full = tuning.profile().shaping.full_scale;
  return fmt::format("{} {:>8.3f} {:<4} {}   {:<2} {:>6.3f} {}", kLoads[i], now.wrench[axis] / unit,
                     force ? "N" : "mN m", two_sided(now.wrench[axis] / full[axis], half),
                     kMotions[i], now.motion[axis], two_sided(now.motion[axis], half));
}

std::string knob_line(const Knob& knob, bool chosen, int width) {
  const std::string text =
      fmt::format("{} {:<34} {:>12} ", chosen ? '>' : ' ', knob.label, shown(knob));
  return text + slider(knob, std::min(26, width - static_cast<int>(text.size()) - 2));
}

std::string buttons_text(std::uint32_t buttons) {
  std::string text;
  for (int i = 0; i < 32; ++i) {
    if ((buttons >> i & 1U) != 0) text += fmt::format(" {}", i + 1);
  }
  return text.empty() ? "" : "   button" + text;
}

}  // namespace

std::string tuning_view(const Tuning& tuning, const LiveReading& now, int width, int height) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("tuning profile {}{}   {}", tuning.name(),
                              tuning.unsaved() ? " (not saved)" : "",
                              tuning.file().empty() ? "no file yet" : tuning.file()));
  lines.push_back(fmt::format("{}{}{}", name(now.status), buttons_text(now.buttons),
                              now.on_trial ? "" : "   not in force"));
  const int half = std::clamp((width - 36) / 4, 1, 12);
  for (std::size_t i = 0; i < kLoads.size(); ++i)
    lines.push_back(reading_line(i, tuning, now, half));
  lines.emplace_back();

  const int count = static_cast<int>(tuning.knobs().size());
  const int room = std::clamp(height - kAround, 1, count);
  const int chosen = static_cast<int>(tuning.chosen());
  const int first = std::clamp(chosen - room / 2, 0, count - room);
  for (int i = first; i < first + room; ++i)
    lines.push_back(knob_line(tuning.knobs()[static_cast<std::size_t>(i)], i == chosen, width));
  lines.push_back(tuning.line());
  lines.emplace_back(kHelp);

  std::string screen;
  const std::size_t most = std::min(lines.size(), static_cast<std::size_t>(std::max(1, height)));
  for (std::size_t i = 0; i < most; ++i)
    screen += (i == 0 ? "" : "\r\n") + fitted(lines[i], width) + "\x1b[K";
  return screen + "\x1b[J";
}

}  // namespace tagwrench

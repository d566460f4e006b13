#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "host/motion/profile_manager.h"

namespace tagwrench {
namespace {

constexpr std::string_view kHead = "ok: ";
constexpr std::array<Status, 5> kStatuses = {Status::ok, Status::acquiring, Status::lost,
                                             Status::doubtful, Status::saturated};

void append(std::string& text, const Vector6& numbers) {
  std::array<char, 32> number;
  for (const double value : numbers) {
    const auto done = std::to_chars(number.data(), number.data() + number.size(), value,
                                    std::chars_format::general, 6);
    text += ' ';
    text.append(number.data(), done.ptr);
  }
}

/// Words between blanks, from the left.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}

  std::string_view next() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(' '), rest_.size()));
    const std::string_view word = rest_.substr(0, std::min(rest_.find(' '), rest_.size()));
    rest_.remove_prefix(word.size());
    return word;
  }
  template <typename Number>
  bool number(Number& value) {
    const std::string_view word = next();
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
  }
  bool six(Vector6& numbers) {
    for (double& value : numbers) {
      if (!number(value) || !std::isfinite(value)) return false;
    }
    return true;
  }

 private:
  std::string_view rest_;
};

}  // namespace

std::string live_text(const LiveReading& reading) {
  std::string text(kHead);
  text += name(reading.status);
  append(text, reading.wrench);
  append(text, reading.motion);
  text += " " + std::to_string(reading.buttons);
  return text + (reading.on_trial ? " 1\n" : " 0\n");
}

std::optional<LiveReading> parse_live(std::string_view text) noexcept {
  if (!text.starts_with(kHead) || !text.ends_with('\n')) return {};
  Words words(text.substr(kHead.size(), text.size() - kHead.size() - 1));
  LiveReading reading;
  const std::string_view status = words.next();
  bool known = false;
  for (const Status one : kStatuses) {
    if (status != name(one)) continue;
    reading.status = one;
    known = true;
  }
  int on_trial = 0;
  if (!known || !words.six(reading.wrench) || !words.six(reading.motion) ||
      !words.number(reading.buttons) || !words.number(on_trial) || !words.next().empty())
    return {};
  reading.on_trial = on_trial == 1;
  return reading;
}

}  // namespace tagwrench

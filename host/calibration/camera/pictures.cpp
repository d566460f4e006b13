#include "host/calibration/camera/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "host/core/count_text.h"

namespace tagwrench {
namespace {

constexpr std::size_t kLongRow = 4;

struct Words {
  const char* what;    ///< as a heading, and after "are"
  const char* remedy;  ///< empty: nothing was lost
};

constexpr std::array<Words, 14> kWords = {{
    {"usable", ""},
    {"used", ""},
    {"contradicted by the others", "hold a flat, stiff board still"},
    {"not needed", ""},
    {"too similar to another", "move the board about and tilt it between pictures"},
    {"in motion", "hold the board still for a moment"},
    {"without the board", "show all of it, lit evenly, and check --board"},
    {"with markers that are not where this board has them", "check --board"},
    {"with too little of the board", "show more of it"},
    {"too dark", "more light or a longer exposure"},
    {"overexposed beyond use", "less light or a shorter exposure"},
    {"blurred", "focus the lens and hold the board still"},
    {"of another size", "give pictures of one camera and size"},
    {"damaged", "record them again"},
}};
constexpr auto kLastFate = static_cast<int>(Fate::unreadable);

const Words& words(Fate fate) { return kWords[static_cast<std::size_t>(fate)]; }

std::string with_detail(const Picture& picture) {
  return picture.detail.empty() ? picture.name
                                : fmt::format("{} ({})", picture.name, picture.detail);
}

}  // namespace

void Pictures::add(Picture picture) {
  if (picture.name.empty())
    ++counted_[picture.fate];
  else
    named_.push_back(std::move(picture));
}

void Pictures::became(const std::string& name, Fate fate, std::string detail) {
  for (Picture& picture : named_)
    if (picture.name == name) picture = {name, fate, std::move(detail)};
}

int Pictures::count(Fate fate) const {
  const auto counted = counted_.find(fate);
  const auto named = std::count_if(named_.begin(), named_.end(),
                                   [&](const Picture& picture) { return picture.fate == fate; });
  return (counted == counted_.end() ? 0 : counted->second) + static_cast<int>(named);
}

int Pictures::all() const {
  int sum = static_cast<int>(named_.size());
  for (const auto& [fate, count] : counted_) sum += count;
  return sum;
}

std::vector<std::string> Pictures::lines() const {
  std::vector<std::string> out;
  for (int i = 0; i <= kLastFate; ++i) {
    const Fate fate = static_cast<Fate>(i);
    const int all = count(fate);
    if (all == 0) continue;
    std::string line = fmt::format("{} {}", count_text(all, "picture"), words(fate).what);
    std::string between = ": ";
    const auto named = [&](const std::string& name) {
      line += between + name;
      between = ", ";
    };
    for (std::size_t at = 0; at < named_.size();) {
      std::size_t end = at;
      while (end < named_.size() && named_[end].fate == fate && named_[end].detail.empty()) ++end;
      if (end - at >= kLongRow) {
        named(fmt::format("{} to {}", named_[at].name, named_[end - 1].name));
        at = end;
        continue;
      }
      if (named_[at].fate == fate) named(with_detail(named_[at]));
      ++at;
    }
    out.push_back(line);
  }
  return out;
}

std::string Pictures::main_loss() const {
  Fate worst = Fate::contradicts;
  for (int i = 0; i <= kLastFate; ++i) {
    const Fate fate = static_cast<Fate>(i);
    if (*words(fate).remedy != '\0' && count(fate) > count(worst)) worst = fate;
  }
  if (count(worst) <= count(Fate::view) + count(Fate::used)) return {};
  return fmt::format("{} of {} are {}: {}", count(worst), count_text(all(), "picture"),
                     words(worst).what, words(worst).remedy);
}

}  // namespace tagwrench

#include "host/commands/hardware_plan.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>

#include "host/calibration/wrench/plan_config.h"
#include "host/core/config_error.h"
#include "host/tools/design/drawing.h"

namespace tagwrench {
namespace {

constexpr std::array<std::string_view, 4> kBolts{"the right bolt", "the left bolt",
                                                 "the lower bolt", "the upper bolt"};

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

/// What follows `key` up to the bracket that closes it, behind `after`.
void replace_list(std::string& text, const std::string& after, std::string_view key,
                  const std::string& list) {
  std::size_t at = text.find(after);
  if (at != std::string::npos) at = text.find(key, at);
  const std::size_t end = at == std::string::npos ? at : text.find(']', at);
  if (end == std::string::npos)
    throw ConfigError("six_orientations: the plan has no point named " + after);
  text.replace(at, end + 1 - at, std::string(key) + list);
}

double to_hundredths(double metres) { return std::round(1e5 * metres) / 1e2 + 0.0; }

}  // namespace

std::string hardware_plan(const hardware::Parameters& p) {
  const hardware::Geometry g = hardware::geometry(p);
  std::string text = plan_text("six_orientations");
  const auto points = hardware::load_points(p, g);
  for (std::size_t i = 0; i < kBolts.size(); ++i) {
    replace_list(text, fmt::format("name: {},", kBolts[i]), "position_mm: ",
                 fmt::format("[{}, {}, {}]", to_hundredths(points[i].x()),
                             to_hundredths(points[i].y()), to_hundredths(points[i].z())));
  }
  const long grams = std::lround(1e3 * hardware::load_mass(p, g));
  replace_all(text, "mass_g: 50,", fmt::format("mass_g: {},", grams));
  replace_all(text, " 50 g", fmt::format(" {} g", grams));
  return fmt::format("# For {}. Weigh your weight and write it here; measure the points.\n{}",
                     p.name, text);
}

}  // namespace tagwrench

#include "host/motion/profile_edit.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <vector>

#include "host/core/yaml/yaml_edit.h"

namespace tagwrench {
namespace {

constexpr std::array<const char*, 6> kAxisKeys = {"x", "y", "z", "rx", "ry", "rz"};

bool force_feeds(const Profile& profile, std::size_t axis) {
  return profile.shaping.axes[axis].source < 3;
}

/// Where a key of the profile's text stands, and what it says.
struct TextEdit {
  std::vector<std::string> path;
  std::string value;
};

void edit_number(std::vector<TextEdit>& edits, std::vector<std::string> path, double before,
                 double after) {
  if (before != after) edits.push_back({std::move(path), fmt::format("{}", after)});
}

void edit_axis(std::vector<TextEdit>& edits, std::size_t i, const Profile& before,
               const Profile& after) {
  const std::string unit = force_feeds(after, i) ? "n" : "nm";
  const auto axis = static_cast<Eigen::Index>(i);
  const ShapingOptions& was = before.shaping;
  const ShapingOptions& is = after.shaping;
  edit_number(edits, {"axes", kAxisKeys[i], "full_scale_" + unit}, was.full_scale[axis],
              is.full_scale[axis]);
  edit_number(edits, {"axes", kAxisKeys[i], "dead_zone_" + unit}, was.dead_zone[axis],
              is.dead_zone[axis]);
  if (was.axes[i].invert != is.axes[i].invert)
    edits.push_back({{"axes", kAxisKeys[i], "invert"}, fmt::format("{}", is.axes[i].invert)});
}

std::string filter_value(const FilterOptions& filter) {
  switch (filter.kind) {
    case FilterKind::one_euro:
      return fmt::format("{{kind: one_euro, cutoff_hz: {}, hz_per_speed: {}, speed_cutoff_hz: {}}}",
                         filter.cutoff_hz, filter.hz_per_speed, filter.speed_cutoff_hz);
    case FilterKind::exponential:
      return fmt::format("{{kind: exponential, weight: {}, at_hz: {}}}", filter.weight,
                         filter.weight_hz);
    case FilterKind::none:
      break;
  }
  return "{kind: none}";
}

std::vector<TextEdit> edits_between(const Profile& before, const Profile& after) {
  std::vector<TextEdit> edits;
  const ShapingOptions& was = before.shaping;
  const ShapingOptions& is = after.shaping;
  edit_number(edits, {"translation"}, was.translation, is.translation);
  edit_number(edits, {"rotation"}, was.rotation, is.rotation);
  if (was.axes[0].curve != is.axes[0].curve)
    edits.push_back({{"curve"}, fmt::format("{{power: {}}}", is.axes[0].curve.power)});
  if (was.dominant != is.dominant)
    edits.push_back(
        {{"dominant"}, fmt::format("{{on: {}, ratio: {}}}", is.dominant.on, is.dominant.ratio)});
  constexpr std::array<const char*, 3> kLocks = {"none", "translation", "rotation"};
  if (was.lock != is.lock) edits.push_back({{"lock"}, kLocks[static_cast<std::size_t>(is.lock)]});
  if (was.filter != is.filter) edits.push_back({{"filter"}, filter_value(is.filter)});
  for (std::size_t i = 0; i < kAxisKeys.size(); ++i) edit_axis(edits, i, before, after);
  const GestureOptions& gestures = after.gestures;
  edit_number(edits, {"gestures", "tap_force_n"}, before.gestures.tap_force, gestures.tap_force);
  edit_number(edits, {"gestures", "press_force_n"}, before.gestures.press_force,
              gestures.press_force);
  edit_number(edits, {"gestures", "twist_torque_nm"}, before.gestures.twist_torque,
              gestures.twist_torque);
  if (before.gestures.press_time != gestures.press_time)
    edits.push_back(
        {{"gestures", "press_ms"},
         fmt::format(
             "{}",
             std::chrono::duration_cast<std::chrono::milliseconds>(gestures.press_time).count())});
  return edits;
}

}  // namespace

std::string with_changes(const std::string& text, const std::string& file, const Profile& before,
                         const Profile& after) {
  std::string changed = text;
  for (const TextEdit& edit : edits_between(before, after))
    changed = with_value(changed, edit.path, edit.value, file);
  return changed;
}

}  // namespace tagwrench

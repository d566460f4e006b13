#include "host/verbs/tune/knobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>

#include "host/config/sensor_edit.h"

namespace tagwrench {
namespace {

constexpr std::array<const char*, 6> kAxisKeys = {"x", "y", "z", "rx", "ry", "rz"};
constexpr double kSensitive = 1.1;  // one step of what is felt by its ratio

/// Three digits are more than a hand feels, and read well in a file.
double rounded(double value) {
  const std::string text = fmt::format("{:.3g}", value);
  double near = value;
  std::from_chars(text.data(), text.data() + text.size(), near);
  return near;
}

bool force_feeds(const Profile& profile, std::size_t axis) {
  return profile.shaping.axes[axis].source < 3;
}

Knob number(std::string label, double value, double lowest, double highest, double step,
            std::function<void(Profile&, double)> set) {
  Knob knob;
  knob.label = std::move(label);
  knob.lowest = std::min(lowest, value);
  knob.highest = std::max(highest, value);
  knob.step = step;
  knob.value = value;
  knob.set = std::move(set);
  return knob;
}

Knob ratio(std::string label, double value, double lowest, double highest,
           std::function<void(Profile&, double)> set) {
  Knob knob = number(std::move(label), value, lowest, highest, kSensitive, std::move(set));
  knob.by_ratio = knob.lowest > 0;
  if (!knob.by_ratio) knob.step = (highest - lowest) / 50;
  return knob;
}

Knob choice(std::string label, std::vector<std::string_view> names, std::size_t value,
            std::function<void(Profile&, double)> set) {
  Knob knob;
  knob.label = std::move(label);
  knob.kind = Knob::Kind::choice;
  knob.highest = static_cast<double>(names.size() - 1);
  knob.names = std::move(names);
  knob.value = static_cast<double>(value);
  knob.set = std::move(set);
  return knob;
}

Knob toggle(std::string label, bool value, std::function<void(Profile&, double)> set) {
  return choice(std::move(label), {"off", "on"}, value ? 1 : 0, std::move(set));
}

Knob in(std::string_view unit, double unit_value, Knob knob) {
  knob.unit = unit;
  knob.unit_value = unit_value;
  return knob;
}

Knob only_if(bool applies, Knob knob) {
  knob.applies = applies;
  return knob;
}

Knob load(const Profile& profile, std::size_t axis, Knob knob) {
  return force_feeds(profile, axis) ? in("N", 1, std::move(knob))
                                    : in("mN m", 1e-3, std::move(knob));
}

void add_feel(std::vector<Knob>& knobs, const Profile& profile) {
  const ShapingOptions& s = profile.shaping;
  knobs.push_back(ratio("sensitivity, translation", s.translation, 0.1, 10,
                        [](Profile& p, double v) { p.shaping.translation = v; }));
  knobs.push_back(ratio("sensitivity, rotation", s.rotation, 0.1, 10,
                        [](Profile& p, double v) { p.shaping.rotation = v; }));
  const bool by_points = s.axes[0].curve.kind == CurveKind::points;
  knobs.push_back(only_if(!by_points, number("curve, power", s.axes[0].curve.power, 0.3, 4, 0.1,
                                             [](Profile& p, double v) {
                                               const CurveOptions before = p.shaping.axes[0].curve;
                                               for (AxisOptions& axis : p.shaping.axes) {
                                                 if (axis.curve != before) continue;
                                                 axis.curve.power = v;
                                                 axis.curve.kind =
                                                     v == 1 ? CurveKind::linear : CurveKind::power;
                                               }
                                             })));
  knobs.push_back(toggle("one axis at a time", s.dominant.on,
                         [](Profile& p, double v) { p.shaping.dominant.on = v != 0; }));
  knobs.push_back(only_if(s.dominant.on,
                          number("  another takes over when stronger", s.dominant.ratio, 1, 3, 0.1,
                                 [](Profile& p, double v) { p.shaping.dominant.ratio = v; })));
  knobs.push_back(choice(
      "lock", {"none", "translation", "rotation"}, static_cast<std::size_t>(s.lock),
      [](Profile& p, double v) { p.shaping.lock = static_cast<Lock>(static_cast<int>(v)); }));
}

void add_filter(std::vector<Knob>& knobs, const FilterOptions& filter) {
  const bool one_euro = filter.kind == FilterKind::one_euro;
  knobs.push_back(choice("filter", {"none", "exponential", "one euro"},
                         static_cast<std::size_t>(filter.kind), [](Profile& p, double v) {
                           p.shaping.filter.kind = static_cast<FilterKind>(static_cast<int>(v));
                         }));
  knobs.push_back(
      only_if(one_euro, in("Hz", 1,
                           ratio("  cut-off of a still hand", filter.cutoff_hz, 0.1, 50,
                                 [](Profile& p, double v) { p.shaping.filter.cutoff_hz = v; }))));
  knobs.push_back(only_if(
      one_euro, in("Hz", 1,
                   ratio("  more for each full scale/s", filter.hz_per_speed, 0.1, 200,
                         [](Profile& p, double v) { p.shaping.filter.hz_per_speed = v; }))));
  knobs.push_back(only_if(filter.kind == FilterKind::exponential,
                          ratio("  weight of the newest", filter.weight, 0.01, 1,
                                [](Profile& p, double v) { p.shaping.filter.weight = v; })));
}

void add_axes(std::vector<Knob>& knobs, const Profile& profile) {
  const ShapingOptions& s = profile.shaping;
  for (std::size_t i = 0; i < kAxisKeys.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double unit = force_feeds(profile, i) ? 1 : 0.02;
    const double lowest = std::max(0.05 * unit, rounded(1.2 * s.dead_zone[axis]));
    knobs.push_back(
        load(profile, i,
             ratio(fmt::format("full scale, {}", kAxisKeys[i]), s.full_scale[axis], lowest,
                   20 * unit, [axis](Profile& p, double v) { p.shaping.full_scale[axis] = v; })));
  }
  for (std::size_t i = 0; i < kAxisKeys.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double full = s.full_scale[axis];
    knobs.push_back(load(profile, i,
                         number(fmt::format("dead zone, {}", kAxisKeys[i]), s.dead_zone[axis], 0,
                                0.5 * full, rounded(0.005 * full),
                                [axis](Profile& p, double v) { p.shaping.dead_zone[axis] = v; })));
  }
  for (std::size_t i = 0; i < kAxisKeys.size(); ++i)
    knobs.push_back(toggle(fmt::format("invert {}", kAxisKeys[i]), s.axes[i].invert,
                           [i](Profile& p, double v) { p.shaping.axes[i].invert = v != 0; }));
}

void add_gestures(std::vector<Knob>& knobs, const GestureOptions& gestures) {
  knobs.push_back(in("N", 1,
                     ratio("tap, least force", gestures.tap_force, 0.05, 20,
                           [](Profile& p, double v) { p.gestures.tap_force = v; })));
  knobs.push_back(in("N", 1,
                     ratio("press-hold, least force", gestures.press_force, 0.05, 20,
                           [](Profile& p, double v) { p.gestures.press_force = v; })));
  knobs.push_back(in("mN m", 1e-3,
                     ratio("twist-click, least torque", gestures.twist_torque, 1e-4, 0.4,
                           [](Profile& p, double v) { p.gestures.twist_torque = v; })));
  using std::chrono::milliseconds;
  knobs.push_back(in(
      "ms", 1,
      number("press-hold, for",
             static_cast<double>(
                 std::chrono::duration_cast<milliseconds>(gestures.press_time).count()),
             200, 2000, 50,
             [](Profile& p, double v) { p.gestures.press_time = milliseconds(std::lround(v)); })));
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

std::vector<Knob> tuning_knobs(const Profile& profile) {
  std::vector<Knob> knobs;
  add_feel(knobs, profile);
  add_filter(knobs, profile.shaping.filter);
  add_axes(knobs, profile);
  add_gestures(knobs, profile.gestures);
  return knobs;
}

double moved(const Knob& knob, int steps) {
  if (knob.kind == Knob::Kind::choice) {
    const auto count = static_cast<int>(knob.names.size());
    return ((static_cast<int>(knob.value) + steps) % count + count) % count;
  }
  const double next = knob.by_ratio ? knob.value * std::pow(knob.step, steps)
                                    : knob.step * (std::round(knob.value / knob.step) + steps);
  return std::clamp(rounded(next), knob.lowest, knob.highest);
}

double place(const Knob& knob) {
  if (knob.highest <= knob.lowest) return 0;
  const double part =
      knob.by_ratio ? std::log(knob.value / knob.lowest) / std::log(knob.highest / knob.lowest)
                    : (knob.value - knob.lowest) / (knob.highest - knob.lowest);
  return std::clamp(part, 0.0, 1.0);
}

std::string shown(const Knob& knob) {
  if (!knob.applies) return "-";
  if (knob.kind == Knob::Kind::choice)
    return std::string(knob.names[static_cast<std::size_t>(knob.value)]);
  return fmt::format("{:.4g}{}{}", knob.value / knob.unit_value, knob.unit.empty() ? "" : " ",
                     knob.unit);
}

Profile with_unsaid(Profile profile, const Profile& earlier) {
  FilterOptions& filter = profile.shaping.filter;
  const FilterOptions said = filter;
  filter = earlier.shaping.filter;
  filter.kind = said.kind;
  if (said.kind == FilterKind::exponential) {
    filter.weight = said.weight;
    filter.weight_hz = said.weight_hz;
  }
  if (said.kind == FilterKind::one_euro) {
    filter.cutoff_hz = said.cutoff_hz;
    filter.hz_per_speed = said.hz_per_speed;
    filter.speed_cutoff_hz = said.speed_cutoff_hz;
  }
  return profile;
}

std::string with_changes(const std::string& text, const std::string& file, const Profile& before,
                         const Profile& after) {
  std::string changed = text;
  for (const TextEdit& edit : edits_between(before, after))
    changed = with_value(changed, edit.path, edit.value, file);
  return changed;
}

}  // namespace tagwrench

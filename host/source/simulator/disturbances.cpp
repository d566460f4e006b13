#include "host/source/simulator/disturbances.h"

#include <fmt/format.h>

#include <initializer_list>

namespace tagwrench::sim {
namespace {

struct Limit {
  const char* key;
  double value, low, high;
};

std::string outside(const char* list, std::initializer_list<Limit> limits) {
  for (const auto& [key, value, low, high] : limits) {
    if (!(value >= low && value <= high)) {
      return fmt::format("disturbances.{}: {} must lie between {:g} and {:g}, is {:g}", list, key,
                         low, high, value);
    }
  }
  return {};
}

std::string time_problem(const char* list, const Occurrence& when) {
  std::string found = outside(list, {{"start_s", when.start, 0, 1e6},
                                     {"length_s", when.length, 0, 1e6},
                                     {"every_s", when.every, 0, 1e6}});
  if (found.empty() && when.every > 0 && when.every < when.length) {
    found = fmt::format("disturbances.{}: every_s must be 0 or at least length_s", list);
  }
  return found;
}

std::string occluder_problem(const Occluder& o) {
  return outside("occluders", {{"width_px", o.width_px, 0, 1e5},
                               {"softness_px", o.softness_px, 0, 1e4},
                               {"direction_rad", o.direction, -100, 100},
                               {"speed_px_per_s", o.speed_px_per_s, -1e6, 1e6},
                               {"aim_px", o.aim_px.x(), -1e5, 1e5},
                               {"aim_px", o.aim_px.y(), -1e5, 1e5},
                               {"reflectance", o.reflectance, 0, 1},
                               {"texture", o.texture, 0, 1},
                               {"texture_wavelength_px", o.texture_wavelength_px, 1, 1e5}});
}

std::string glare_problem(const Glare& g) {
  return outside("glare", {{"peak_counts", g.peak_counts, 0, 1e4},
                           {"sigma_px", g.sigma_px, 0.5, 1e5},
                           {"aim_px", g.aim_px.x(), -1e5, 1e5},
                           {"aim_px", g.aim_px.y(), -1e5, 1e5},
                           {"wander_px", g.wander_px, 0, 1e5},
                           {"wander_hz", g.wander_hz, 0, 1e3},
                           {"fade_s", g.fade, 0, 1e6}});
}

std::string light_problem(const LightChange& l) {
  return outside("light", {{"factor", l.factor, 0, 100}, {"fade_s", l.fade, 0, 1e6}});
}

std::string flicker_problem(const Flicker& f) {
  return outside("flicker", {{"depth", f.depth, 0, 1}, {"mains_hz", f.mains_hz, 0.1, 1e5}});
}

std::string turning_problem(const TurningLight& t) {
  return outside(
      "turning_light",
      {{"depth", t.depth, 0, 1}, {"turn_s", t.turn, 1e-3, 1e6}, {"fade_s", t.fade, 0, 1e6}});
}

std::string focus_problem(const FocusChange& f) {
  return outside("focus", {{"shift_mm", f.shift * 1e3, -1e3, 1e3},
                           {"fade_s", f.fade, 0, 1e6},
                           {"hunt_hz", f.hunt_hz, 0, 1e3}});
}

std::string dirt_problem(const Dirt& d, int tags) {
  if (d.tag < 0 || d.tag >= tags) {
    return fmt::format("disturbances.dirt: tag counts target.tags from 0, so 0 to {}, not {}",
                       tags - 1, d.tag);
  }
  return outside("dirt", {{"specks", static_cast<double>(d.specks), 0, 100},
                          {"scratches", static_cast<double>(d.scratches), 0, 100},
                          {"size_mm", d.size * 1e3, 1e-3, 100},
                          {"reflectance", d.reflectance, 0, 1}});
}

template <typename T, typename Check>
std::string list_problem(const char* name, const std::vector<T>& list, Check check) {
  for (const T& what : list) {
    std::string found = time_problem(name, what.when);
    if (found.empty()) found = check(what);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

std::string problem(const Disturbances& d, int tags) {
  const std::string found[] = {
      list_problem("occluders", d.occluders, occluder_problem),
      list_problem("glare", d.glare, glare_problem),
      list_problem("light", d.light, light_problem),
      list_problem("flicker", d.flicker, flicker_problem),
      list_problem("turning_light", d.turning_light, turning_problem),
      list_problem("dirt", d.dirt, [tags](const Dirt& dirt) { return dirt_problem(dirt, tags); }),
      list_problem("focus", d.focus, focus_problem),
      outside("lost_frames",
              {{"share", d.lost_frames.share, 0, 0.5},
               {"most_in_a_row", static_cast<double>(d.lost_frames.most_in_a_row), 1, 100}}),
      outside("random", {{"every_s", d.random.every, 0.05, 1e6}})};
  for (const std::string& text : found) {
    if (!text.empty()) return text;
  }
  if (!(d.random.start >= 0)) {  // infinity is never
    return "disturbances.random: start_s must not be negative";
  }
  return {};
}

}  // namespace tagwrench::sim

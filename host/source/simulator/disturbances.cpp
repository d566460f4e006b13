#include "host/source/simulator/disturbances.h"

#include <fmt/format.h>

#include "host/source/simulator/fields.h"

namespace tagwrench::sim {
namespace {

constexpr int kMaxMarks = 100;

Fields fields(Occurrence& w) {
  return {
      {"start_s", w.start, 0, 1e6}, {"length_s", w.length, 0, 1e6}, {"every_s", w.every, 0, 1e6}};
}

Fields fields(Occluder& o) {
  return {{"width_px", o.width_px, 0, 1e5},
          {"softness_px", o.softness_px, 0, 1e4},
          {"direction_rad", o.direction, -100, 100},
          {"speed_px_per_s", o.speed_px_per_s, -1e6, 1e6},
          {"aim_px", o.aim_px, -1e5, 1e5},
          {"reflectance", o.reflectance, 0, 1},
          {"texture", o.texture, 0, 1},
          {"texture_wavelength_px", o.texture_wavelength_px, 1, 1e5}};
}

Fields fields(Glare& g) {
  return {{"peak_counts", g.peak_counts, 0, 1e4}, {"sigma_px", g.sigma_px, 0.5, 1e5},
          {"aim_px", g.aim_px, -1e5, 1e5},        {"wander_px", g.wander_px, 0, 1e5},
          {"wander_hz", g.wander_hz, 0, 1e3},     {"fade_s", g.fade, 0, 1e6}};
}

Fields fields(LightChange& l) { return {{"factor", l.factor, 0, 100}, {"fade_s", l.fade, 0, 1e6}}; }

Fields fields(Flicker& f) { return {{"depth", f.depth, 0, 1}, {"mains_hz", f.mains_hz, 0.1, 1e5}}; }

Fields fields(TurningLight& t) {
  return {{"depth", t.depth, 0, 1}, {"turn_s", t.turn, 1e-3, 1e6}, {"fade_s", t.fade, 0, 1e6}};
}

Fields fields(Dirt& d) {
  return {{"size_mm", d.size, 1e-3, 100, kMilli}, {"reflectance", d.reflectance, 0, 1}};
}

Fields fields(FocusChange& f) {
  return {{"shift_mm", f.shift, -1e3, 1e3, kMilli},
          {"fade_s", f.fade, 0, 1e6},
          {"hunt_hz", f.hunt_hz, 0, 1e3}};
}

Fields fields(LostFrames& l) { return {{"share", l.share, 0, 0.5}}; }

Fields fields(RandomDisturbances& r) { return {{"every_s", r.every, 0.05, 1e6}}; }

// What of a kind is no plain number.
template <typename T>
void read_rest(YamlSection&, T&) {}
void read_rest(YamlSection& s, Occluder& o) { s.choice("shape", o.shape, {"band", "disc"}); }
void read_rest(YamlSection& s, Dirt& d) {
  d.tag = s.reader().integer_or("tag", 0, kMaxMarks, d.tag);
  d.specks = s.reader().integer_or("specks", 0, kMaxMarks, d.specks);
  d.scratches = s.reader().integer_or("scratches", 0, kMaxMarks, d.scratches);
}

template <typename T>
void read_list(YamlReader& reader, const char* key, std::vector<T>& list) {
  if (!reader.has(key)) return;
  for (const YamlReader& entry : reader.children(key)) {
    YamlSection s(entry);
    T& what = list.emplace_back();
    read_fields(s, fields(what.when));
    read_fields(s, fields(what));
    read_rest(s, what);
    s.finish();
  }
}

std::string count_outside(const char* list, const char* key, int value, int low, int high) {
  double shown = value;
  return outside(fmt::format("disturbances.{}", list), {{key, shown, double(low), double(high)}});
}

template <typename T>
std::string rest_problem(const T&, int) {
  return {};
}
std::string rest_problem(const Dirt& d, int tags) {
  if (d.tag < 0 || d.tag >= tags)
    return fmt::format("disturbances.dirt: tag counts target.tags from 0, so 0 to {}, not {}",
                       tags - 1, d.tag);
  const std::string found = count_outside("dirt", "specks", d.specks, 0, kMaxMarks);
  return found.empty() ? count_outside("dirt", "scratches", d.scratches, 0, kMaxMarks) : found;
}

template <typename T>
std::string list_problem(const char* name, std::vector<T> list, int tags) {
  const std::string section = fmt::format("disturbances.{}", name);
  for (T& what : list) {
    std::string found = outside(section, fields(what.when));
    if (found.empty() && what.when.every > 0 && what.when.every < what.when.length)
      found = section + ": every_s must be 0 or at least length_s";
    if (found.empty()) found = rest_problem(what, tags);
    if (found.empty()) found = outside(section, fields(what));
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

std::string problem(const Disturbances& disturbances, int tags) {
  Disturbances d = disturbances;
  for (const std::string& text :
       {list_problem("occluders", d.occluders, tags), list_problem("glare", d.glare, tags),
        list_problem("light", d.light, tags), list_problem("flicker", d.flicker, tags),
        list_problem("turning_light", d.turning_light, tags), list_problem("dirt", d.dirt, tags),
        list_problem("focus", d.focus, tags),
        outside("disturbances.lost_frames", fields(d.lost_frames)),
        count_outside("lost_frames", "most_in_a_row", d.lost_frames.most_in_a_row, 1, kMaxMarks),
        outside("disturbances.random", fields(d.random))}) {
    if (!text.empty()) return text;
  }
  if (!(d.random.start >= 0)) {  // infinity is never
    return "disturbances.random: start_s must not be negative";
  }
  return {};
}

void read_disturbances(YamlReader reader, Disturbances& d) {
  read_list(reader, "occluders", d.occluders);
  read_list(reader, "glare", d.glare);
  read_list(reader, "light", d.light);
  read_list(reader, "flicker", d.flicker);
  read_list(reader, "turning_light", d.turning_light);
  read_list(reader, "dirt", d.dirt);
  read_list(reader, "focus", d.focus);
  if (reader.has("lost_frames")) {
    YamlSection s(reader.child("lost_frames"));
    read_fields(s, fields(d.lost_frames));
    d.lost_frames.most_in_a_row =
        s.reader().integer_or("most_in_a_row", 1, kMaxMarks, d.lost_frames.most_in_a_row);
    s.finish();
  }
  if (reader.has("random")) {
    YamlSection s(reader.child("random"));
    d.random.start = s.reader().number("start_s");
    read_fields(s, fields(d.random));
    s.finish();
  }
  reader.finish();
}

}  // namespace tagwrench::sim

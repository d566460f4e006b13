#include "host/source/simulator/disturbance_config.h"

#include <utility>
#include <vector>

#include "host/core/yaml/yaml_section.h"

namespace tagwrench {
namespace {

constexpr double kMilli = 1e-3;
constexpr int kMaxMarks = 100;

void read(YamlSection& s, sim::Occluder& o) {
  s.choice("shape", o.shape, {"band", "disc"});
  s.number("width_px", o.width_px);
  s.number("softness_px", o.softness_px);
  s.number("direction_rad", o.direction);
  s.number("speed_px_per_s", o.speed_px_per_s);
  s.numbers("aim_px", o.aim_px);
  s.number("reflectance", o.reflectance);
  s.number("texture", o.texture);
  s.number("texture_wavelength_px", o.texture_wavelength_px);
}

void read(YamlSection& s, sim::Glare& g) {
  s.number("peak_counts", g.peak_counts);
  s.number("sigma_px", g.sigma_px);
  s.numbers("aim_px", g.aim_px);
  s.number("wander_px", g.wander_px);
  s.number("wander_hz", g.wander_hz);
  s.number("fade_s", g.fade);
}

void read(YamlSection& s, sim::LightChange& l) {
  s.number("factor", l.factor);
  s.number("fade_s", l.fade);
}

void read(YamlSection& s, sim::Flicker& f) {
  s.number("depth", f.depth);
  s.number("mains_hz", f.mains_hz);
}

void read(YamlSection& s, sim::TurningLight& t) {
  s.number("depth", t.depth);
  s.number("turn_s", t.turn);
  s.number("fade_s", t.fade);
}

void read(YamlSection& s, sim::Dirt& d) {
  d.tag = s.reader().integer_or("tag", 0, kMaxMarks, d.tag);
  d.specks = s.reader().integer_or("specks", 0, kMaxMarks, d.specks);
  d.scratches = s.reader().integer_or("scratches", 0, kMaxMarks, d.scratches);
  s.number("size_mm", d.size, kMilli);
  s.number("reflectance", d.reflectance);
}

void read(YamlSection& s, sim::FocusChange& f) {
  s.number("shift_mm", f.shift, kMilli);
  s.number("fade_s", f.fade);
  s.number("hunt_hz", f.hunt_hz);
}

template <typename T>
void read_list(YamlReader& reader, const char* key, std::vector<T>& list) {
  if (!reader.has(key)) return;
  for (const YamlReader& entry : reader.children(key)) {
    YamlSection s(entry);
    T what;
    s.number("start_s", what.when.start);
    s.number("length_s", what.when.length);
    s.number("every_s", what.when.every);
    read(s, what);
    s.finish();
    list.push_back(what);
  }
}

}  // namespace

void read_disturbances(YamlReader reader, sim::Disturbances& d) {
  read_list(reader, "occluders", d.occluders);
  read_list(reader, "glare", d.glare);
  read_list(reader, "light", d.light);
  read_list(reader, "flicker", d.flicker);
  read_list(reader, "turning_light", d.turning_light);
  read_list(reader, "dirt", d.dirt);
  read_list(reader, "focus", d.focus);
  if (reader.has("lost_frames")) {
    YamlSection s(reader.child("lost_frames"));
    s.number("share", d.lost_frames.share);
    d.lost_frames.most_in_a_row =
        s.reader().integer_or("most_in_a_row", 1, kMaxMarks, d.lost_frames.most_in_a_row);
    s.finish();
  }
  if (reader.has("random")) {
    YamlSection s(reader.child("random"));
    d.random.start = s.reader().number("start_s");
    s.number("every_s", d.random.every);
    s.finish();
  }
  reader.finish();
}

}  // namespace tagwrench

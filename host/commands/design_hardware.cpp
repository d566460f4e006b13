#include "host/commands/design_hardware.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string_view>
#include <utility>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/core/printable.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tools/design/geometry.h"
#include "host/tracker/target.h"

// Not fuzzed: compares a file with what is to be written.

namespace tagwrench {
namespace {

/// sensor.yaml of the simulated sensor, said to be that of one to be built.
std::string nominal_sensor(const hardware::Parameters& p) {
  std::string text = sim::sensor_yaml(runnable_scenario_of(p));
  if (text.starts_with('#')) text.erase(0, text.find('\n') + 1);
  return fmt::format(
             "# The sensor as drawn, {:g} mm from lens to tags: once it is built, `tagwrench "
             "calibrate` puts what is true into here.\n",
             1e3 * p.target.lens_distance) +
         text;
}

void tell_of_mirror(const hardware::Geometry& g) {
  if (!g.mirror) return;
  log_info(
      "design: `run` does not follow the tag in the mirror yet: sensor.yaml and the simulator have "
      "the flat tag alone, with which z and the tilts are poor");
}

/// As YAML takes any text.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
  return out + "'";
}

/// As printed, in the order of the places.
std::vector<TagPattern> patterns_of(const hardware::Parameters& p, const hardware::Geometry& g) {
  const TagFamily family = *family_from_name(p.target.family);
  std::vector<TagPattern> out;
  for (const hardware::TagPlace& tag : g.tags)
    out.push_back(tag_pattern(family, tag.id, p.target.tag_size, p.target.border));
  return out;
}

/// Throws ConfigError if something else is at `path`: somebody may have worked on it.
void check_unchanged(const std::filesystem::path& path, const std::string& text) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::symlink_status(path, error))) return;
  if (std::filesystem::is_regular_file(path, error) && read_text(path) == text) return;
  throw ConfigError(
      "{}: is there already and holds something else (another design or a person may have changed "
      "it); name another folder, or replace it with --force",
      path.string());
}

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

void take_lens(const CameraModel& camera, study::SeenPicture& picture) {
  picture.width_px = camera.width_px;
  picture.height_px = camera.height_px;
  picture.fx_px = camera.fx_px;
  picture.fy_px = camera.fy_px;
  picture.cx_px = camera.cx_px;
  picture.cy_px = camera.cy_px;
}

void count_pixels(const Eigen::Vector2d& image_px, double tag_size, double border,
                  study::Instrument& instrument) {
  study::CountedPixels& counted = instrument.counted;
  counted.frame_width_px = instrument.picture.width_px;
  counted.frame_height_px = instrument.picture.height_px;
  counted.image_width_px = image_px.x();
  counted.image_height_px = image_px.y();
  counted.tag_with_border = tag_size + 2 * border;
  counted.lens_distance = instrument.origin.z();
  counted.tag_px = instrument.picture.fx_px * counted.tag_with_border / counted.lens_distance;
}

void take_hardware(const hardware::Parameters& p, study::Instrument& instrument) {
  const hardware::Geometry g = hardware::geometry(p);
  instrument.frame_rate = p.camera.frame_rate;
  const TagFamily family = *family_from_name(p.target.family);
  instrument.origin = {0, 0, p.target.lens_distance};
  Eigen::AlignedBox2d around;
  for (const Eigen::Vector3d& corner : hardware::paper_corners(p, g, Vector6::Zero()))
    around.extend(hardware::seen_at(p, g, corner));
  // The drawing's origin is as far from the camera's as the pupil.
  const Eigen::Isometry3d camera_T_platform(Eigen::Translation3d(0, 0, g.platform - g.pupil));
  for (const hardware::TagPlace& tag : g.tags) {
    const TagPattern pattern = tag_pattern(family, tag.id, p.target.tag_size, p.target.border);
    study::SeenTag seen{camera_T_platform * tag.platform_T_tag, pattern.size, pattern.border,
                        pattern.cells, pattern.white};
    if (tag.in_mirror) {
      seen.mirror =
          study::MirrorPlane{g.mirror->normal, g.mirror->distance - g.pupil * g.mirror->normal.z()};
    }
    instrument.tags.push_back(std::move(seen));
  }
  take_lens(p.camera.image, instrument.picture);
  count_pixels(around.sizes(), p.target.tag_size, p.target.border, instrument);
  study::Spring spring;
  spring.free_length = p.springs.free_length;
  spring.outer_diameter = p.springs.outer_diameter;
  spring.wire = p.springs.wire;
  spring.rate = p.springs.axial;
  for (const Eigen::Vector2d& at : g.springs) {
    spring.top = {at.x(), at.y(), g.spring_attachment};
    instrument.springs.push_back(spring);
  }
  instrument.stiffness = hardware::stiffness(p, g);
  instrument.platform = {p.moving.mass, p.moving.centre, p.moving.inertia};
  instrument.range = hardware::range(p, g).head<3>().minCoeff();
}

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

int check_hardware(const std::string& file) {
  const hardware::Parameters p = load_hardware(file);
  const hardware::Geometry g = hardware::geometry(p);
  const auto complaints = hardware::complaints(p, g);
  for (const hardware::Complaint& c : complaints)
    std::cout << printable(fmt::format("{}: {}: {}", file, c.parameter, c.message)) << '\n';
  if (!complaints.empty()) return 2;
  const Vector6 range = hardware::range(p, g);
  std::cout << fmt::format(
      "{}: can be built: {:.1f} mm high; before the stops {:.2f} {:.2f} {:.2f} N, {:.1f} {:.1f} "
      "{:.1f} mN m\n",
      file, 1e3 * (g.top - g.bottom), range[0], range[1], range[2], 1e3 * range[3], 1e3 * range[4],
      1e3 * range[5]);
  tell_of_mirror(g);
  return std::cout ? 0 : 1;
}

void export_hardware(const std::string& file, const std::string& folder, bool force) {
  namespace fs = std::filesystem;
  const hardware::Parameters p = load_buildable(file);
  const hardware::Geometry g = hardware::geometry(p);
  const fs::path into(folder);
  const std::array<std::pair<fs::path, std::string>, 4> files{{
      {into / "sensor.yaml", nominal_sensor(p)},
      {into / "plan.yaml", hardware_plan(p)},
      {into / "scenario.yaml", "# The simulated sensor, as built.\nhardware: " +
                                   quoted(fs::absolute(file).lexically_normal().string()) + "\n"},
      {into / "parameters.scad", hardware::scad_parameters(p, g, patterns_of(p, g))},
  }};
  for (const auto& [path, text] : files)
    if (!force) check_unchanged(path, text);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw ConfigError("{}: cannot be made a folder ({}): choose another --export", folder,
                      error.message());
  }
  tell_of_mirror(g);
  for (const auto& [path, text] : files) write_atomically(path, text);
  log_info("design: wrote parameters.scad, scenario.yaml, sensor.yaml and plan.yaml to {}", folder);
}

}  // namespace tagwrench

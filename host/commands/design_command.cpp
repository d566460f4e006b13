// `tagwrench design`: what an instrument would measure.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "host/commands/commands.h"
#include "host/commands/design_hardware.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/sensor/sensor_config.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"

namespace tagwrench {
namespace {

struct DesignOptions {
  command_line::Option range_given, tag_px_given, distance_given, size_given, paper_given,
      camera_given, image_given, axial_given, lateral_given;
  std::string sensor;
  std::string hardware;
  std::string check;
  std::string export_to;
  bool force = false;
  std::string camera = "640x480";
  double fps = 25;
  double lens_distance_mm = 21;
  double tag_mm = 3.8;
  double tag_with_border_mm = 4.5;
  double tag_px = 150;
  std::string image = "150x240";
  double counts_per_px = 4;
  double blur_px = 1.5;
  double noise_counts = 2;
  double contrast_counts = 170;
  std::string family = "aruco_original";
  std::vector<int> ids{5, 2};
  double range_n = 1;
  double axial_n_per_mm = 0.7;
  double lateral_n_per_mm = 0.07;
  double spring_length_mm = 25.4;
  double spring_width_mm = 4.75;
  double wire_mm = 0.71;
  double coils = 0;
  double spacing_x_mm = 15;
  double spacing_y_mm = 13;
  double mass_g = 10;
  std::vector<double> inertia_g_mm2{1000, 1300, 2000};
  double mass_height_mm = 4;
  std::vector<double> ranges{1, 2, 5, 10, 20, 40};
};

command_line::Check within(double low, double high) {
  return command_line::number(low, high, fmt::format("a number from {:g} to {:g}", low, high),
                              fmt::format("{:g}..{:g}", low, high));
}

constexpr double kMm = 1e-3;
constexpr double kRoof = std::numbers::pi / 4;  // inclination of each tag
constexpr double kRidgeGap = 0.15e-3;           // between a paper's edge and the ridge, m
constexpr double kAttachment = 1.8e-3;          // of the springs, beyond the platform's origin, m
constexpr double kShearRatio = 0.3;             // Poisson's, of steel

/// "640x480". Throws ConfigError, naming the option.
std::pair<double, double> size_px(const std::string& option, const std::string& text) {
  const std::size_t x = text.find('x');
  std::optional<double> width;
  std::optional<double> height;
  if (x != std::string::npos) {
    width = command_line::to_number(text.substr(0, x));
    height = command_line::to_number(text.substr(x + 1));
  }
  if (!width || !height || !(*width >= 1 && *height >= 1 && *width <= 1e5 && *height <= 1e5))
    throw ConfigError("{}: '{}' is not WIDTHxHEIGHT in px; use 640x480 say", option, text);
  return {*width, *height};
}

study::SeenTag seen_tag(const TargetDescription& target, const Tag& tag,
                        const Eigen::Isometry3d& camera_T_tag) {
  const TagPattern pattern = tag_pattern(target.family, tag.id, target.tag_size, target.border);
  return {camera_T_tag, pattern.size, pattern.border, pattern.cells, pattern.white};
}

/// The published roof: tags above and below a ridge that points to the camera, or one face-on.
Eigen::Isometry3d on_roof(std::size_t index, std::size_t count, double size, double border) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (count == 1) return pose;
  const double side = index == 0 ? -1 : 1;
  pose.linear() = Eigen::AngleAxisd(side * kRoof, Eigen::Vector3d::UnitX()).toRotationMatrix();
  pose.translation().y() = side * (0.5 * size + border + kRidgeGap) * std::cos(kRoof);
  return pose;
}

/// Of the rectangle around all papers, px.
Eigen::Vector2d size_in_picture(const study::Instrument& instrument) {
  Eigen::AlignedBox2d around;
  for (const study::SeenTag& tag : instrument.tags) {
    const double half = 0.5 * tag.size + tag.border;
    for (const double x : {-half, half}) {
      for (const double y : {-half, half}) {
        const Eigen::Vector3d p = tag.camera_T_tag * Eigen::Vector3d(x, y, 0);
        around.extend(
            Eigen::Vector2d(instrument.picture.fx_px * p.x(), instrument.picture.fy_px * p.y()) /
            p.z());
      }
    }
  }
  return around.sizes();
}

void place_tags(const DesignOptions& o, study::Instrument& instrument) {
  const std::optional<TagFamily> family = family_from_name(o.family);
  if (!family) throw ConfigError("--family: there is no family '{}'", o.family);
  if (o.ids.empty() || o.ids.size() > 2) throw ConfigError("--ids: give one tag or two");
  TargetDescription target;
  target.family = *family;
  target.tag_size = o.tag_mm * kMm;
  target.border = 0.5 * (o.tag_with_border_mm - o.tag_mm) * kMm;
  instrument.origin = {0, 0, o.lens_distance_mm * kMm};
  for (std::size_t i = 0; i < o.ids.size(); ++i) {
    if (o.ids[i] < 0 || o.ids[i] >= id_count(*family))
      throw ConfigError("--ids: {} has ids 0 to {}", o.family, id_count(*family) - 1);
    Eigen::Isometry3d pose = on_roof(i, o.ids.size(), target.tag_size, target.border);
    pose.pretranslate(instrument.origin);
    instrument.tags.push_back(seen_tag(target, {o.ids[i], {}, Vector6::Zero()}, pose));
  }
  study::SeenPicture& picture = instrument.picture;
  picture.width_px = instrument.counted.frame_width_px;
  picture.height_px = instrument.counted.frame_height_px;
  picture.cx_px = 0.5 * (picture.width_px - 1);
  picture.cy_px = 0.5 * (picture.height_px - 1);
  picture.fx_px = picture.fy_px = o.tag_px / o.tag_with_border_mm * o.lens_distance_mm;
}

/// A tag counts as wide as if it faced the lens, the image as the rectangle around the papers.
void take_target(const std::string& file, const TargetDescription& target,
                 const Eigen::Isometry3d& rest, study::Instrument& instrument) {
  instrument.origin = rest.translation();
  for (std::size_t i = 0; i < target.tags.size(); ++i) {
    const Tag& tag = target.tags[i];
    if (!tag.platform_T_tag && target.tags.size() > 2) {
      throw ConfigError("{}: does not say where its tags are; run `tagwrench calibrate target`",
                        file);
    }
    const Eigen::Isometry3d pose =
        rest *
        tag.platform_T_tag.value_or(on_roof(i, target.tags.size(), target.tag_size, target.border));
    if (pose.translation().z() < target.tag_size)
      throw ConfigError("{}: tag {} would touch the lens; check rest and tags", file, tag.id);
    instrument.tags.push_back(seen_tag(target, tag, pose));
  }
  count_pixels(size_in_picture(instrument), target.tag_size, target.border, instrument);
}

void take_sensor(const DesignOptions& o, study::Instrument& instrument) {
  const SensorConfig sensor = load_sensor(o.sensor);
  std::vector<command_line::Option> said{o.tag_px_given, o.size_given, o.paper_given,
                                         o.camera_given, o.image_given};
  if (sensor.rest.camera_T_platform) said.push_back(o.distance_given);
  for (command_line::Option option : said)
    if (option.count() > 0)
      throw ConfigError("{}: {} says that already; leave one of them out", option.name(), o.sensor);
  // A calibrated matrix is symmetric but for its errors.
  instrument.stiffness = 0.5 * (sensor.wrench.K + sensor.wrench.K.transpose());
  if (Eigen::LLT<Matrix6>(instrument.stiffness).info() != Eigen::Success) {
    throw ConfigError(
        "{}: its stiffness is not that of springs (not positive definite); calibrate again",
        o.sensor);
  }
  take_lens(sensor.camera, instrument.picture);
  const Eigen::Isometry3d rest(Eigen::Translation3d(0, 0, o.lens_distance_mm * kMm));
  take_target(o.sensor, sensor.target, sensor.rest.camera_T_platform.value_or(rest), instrument);
}

void mount_springs(const DesignOptions& o, study::Instrument& instrument) {
  study::Spring spring;
  spring.free_length = o.spring_length_mm * kMm;
  spring.outer_diameter = o.spring_width_mm * kMm;
  spring.wire = o.wire_mm * kMm;
  spring.coils = o.coils;
  spring.rate = o.axial_n_per_mm / kMm;
  if (spring.mean_diameter() <= 0)
    throw ConfigError("--wire-mm: must be less than --spring-width-mm");
  Springs model;
  model.axial = spring.rate;
  model.lateral = o.lateral_n_per_mm / kMm;
  // Both are those of the same helix (Wahl, Mechanical Springs, ch. 6 and 15).
  const double turn = spring.rate * std::pow(spring.mean_diameter(), 2) * (1 + kShearRatio);
  model.bending = turn / (2 * (2 + kShearRatio));
  model.torsion = turn / 4;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      spring.top = {x * o.spacing_x_mm * kMm, y * o.spacing_y_mm * kMm, kAttachment};
      instrument.springs.push_back(spring);
      model.centres.push_back(spring.top - Eigen::Vector3d(0, 0, 0.5 * spring.free_length));
    }
  }
  const bool given = o.axial_given.count() > 0 || o.lateral_given.count() > 0;
  if (o.sensor.empty() || given) instrument.stiffness = stiffness(model);
}

study::Instrument instrument_of(const DesignOptions& o) {
  study::Instrument result;
  result.frame_rate = o.fps;
  result.range = o.range_n;
  result.picture.blur_px = o.blur_px;
  result.picture.noise_counts = o.noise_counts;
  result.picture.contrast_counts = o.contrast_counts;
  study::CountedPixels& counted = result.counted;
  counted.counts_per_px = o.counts_per_px;
  if (!o.hardware.empty()) {
    take_hardware(load_buildable(o.hardware), result);
    if (o.range_given.count() > 0) result.range = o.range_n;
    return result;
  }
  if (o.sensor.empty()) {
    std::tie(counted.frame_width_px, counted.frame_height_px) = size_px("--camera", o.camera);
    std::tie(counted.image_width_px, counted.image_height_px) = size_px("--image-px", o.image);
    counted.tag_px = o.tag_px;
    counted.tag_with_border = o.tag_with_border_mm * kMm;
    counted.lens_distance = o.lens_distance_mm * kMm;
    if (o.tag_with_border_mm < o.tag_mm)
      throw ConfigError("--tag-with-border-mm: must not be less than --tag-mm");
    place_tags(o, result);
  } else {
    take_sensor(o, result);
  }
  if (counted.travel_x_px() <= 0 || counted.travel_y_px() <= 0)
    throw ConfigError(
        "the tags' image of {:.0f}x{:.0f} px leaves no way to move in {:.0f}x{:.0f} px; take "
        "smaller tags or a longer way to the lens",
        counted.image_width_px, counted.image_height_px, counted.frame_width_px,
        counted.frame_height_px);
  mount_springs(o, result);
  result.platform.mass = 1e-3 * o.mass_g;
  result.platform.centre_of_mass = {0, 0, o.mass_height_mm * kMm};
  result.platform.principal_inertia =
      1e-9 * Eigen::Vector3d(o.inertia_g_mm2[0], o.inertia_g_mm2[1], o.inertia_g_mm2[2]);
  return result;
}

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kToldApart = 1.96 * std::numbers::sqrt2;  // of two pictures, at 95 %
constexpr double kFlat = 0.05;                             // that a resonance adds at most
constexpr double kSameSprings = 0.005;                     // stiffness: alike in all digits shown

using study::Design;
using study::DesignRow;
using study::Instrument;

std::string steps(const Design& d) {
  const Vector6 told = kToldApart * d.bound;
  std::string text =
      "one picture      resolution    counted step      step of the bound    finer by\n";
  const auto line = [&](const char* what, int bits, double counted, double ours, double unit,
                        const char* name) {
    text += fmt::format("  {:<15}{:<14}{:>9.4f} {:<4}   {:>12.6f} {:<4}   {:>8.0f} x\n", what,
                        bits > 0 ? fmt::format("{} bits", bits) : "", unit * counted, name,
                        unit * ours, name, counted / ours);
  };
  line("x", d.counted.bits_x, d.counted.step_xy, told[0], 1e3, "mm");
  line("y", d.counted.bits_y, d.counted.step_xy, told[1], 1e3, "mm");
  line("z", d.counted.bits_z, d.counted.step_z, told[2], 1e3, "mm");
  line("about x", 0, d.counted.step_rxy, told[3], kDegrees, "deg");
  line("about y", 0, d.counted.step_rxy, told[4], kDegrees, "deg");
  line("about z", 0, d.counted.step_rz, told[5], kDegrees, "deg");
  return text;
}

std::string bound_note(const Instrument& i, const Design& d) {
  return fmt::format(
      "  counted: one count, {:g} to a px, by Ouyang & Howe (ICRA 2020); chord of 45 deg {:.2f} "
      "px,\n"
      "  foreshortening of 45 deg {:.2f} px. Bound: what two pictures tell apart at 95 %, 2.77 "
      "times\n"
      "  the Cramer-Rao bound from the tags' edges at {:g} grey levels of noise, contrast of "
      "{:g},\n"
      "  point spread of {:g} px; {:.3f} {:.3f} {:.3f} um, {:.4f} {:.4f} {:.4f} mrad (one "
      "standard\n"
      "  deviation).\n",
      i.counted.counts_per_px, d.counted.chord_px, d.counted.foreshortening_px,
      i.picture.noise_counts, i.picture.contrast_counts, i.picture.blur_px, 1e6 * d.bound[0],
      1e6 * d.bound[1], 1e6 * d.bound[2], 1e3 * d.bound[3], 1e3 * d.bound[4], 1e3 * d.bound[5]);
}

std::string bandwidth(const Instrument& i, const Design& d) {
  std::string modes;
  for (const double mode : d.modes) modes += fmt::format(" {:.1f}", mode);
  // An undamped mode at f makes 1 / (1 - (g / f)^2) of a load at g.
  const double flat = d.modes.front() * std::sqrt(1 - 1 / (1 + kFlat));
  return fmt::format(
      "\nbandwidth\n"
      "  pictures             {:.1f} Hz, half of {:g} a second\n"
      "  platform on springs {} Hz\n"
      "  true within {:.0f} %      up to {:.1f} Hz\n",
      0.5 * i.frame_rate, i.frame_rate, modes, 100 * kFlat, std::min(flat, 0.5 * i.frame_rate));
}

/// Three digits: "1.58 N", "312 N"; "beyond 1000 N".
std::string force(double newtons) {
  if (newtons > study::kMaxForce) return fmt::format("beyond {:g} N", study::kMaxForce);
  const int decimals = newtons >= 99.95 ? 0 : newtons >= 9.995 ? 1 : newtons >= 0.9995 ? 2 : 3;
  return fmt::format("{:.{}f} N", newtons, decimals);
}

std::string reach(const Design& d) {
  const char* axes[] = {"x", "y", "z"};
  std::string text = "\nlargest force    tags in view    springs not closed\n";
  for (int a = 0; a < 3; ++a) {
    const study::Reach& reach = d.reach[static_cast<std::size_t>(a)];
    text += fmt::format("  along {:<9}{:>13}    {}\n", axes[a], force(reach.in_view),
                        reach.to_solid ? force(*reach.to_solid) : "not known");
  }
  return text;
}

std::string row(const DesignRow& r, const std::string& name) {
  const Vector6 told = 1e3 * kToldApart * r.bound;
  return fmt::format(
      "  {:<9}{:>8.3g}{:>8.3g}  {:>5.2f} {:>5.2f}  {:>6.3g} {:>6.3g}   {:>7.2g} {:>7.2g} {:>7.2g}  "
      "{:>8.2g} {:>8.2g} {:>8.2g}  {:>5.0f}-{:<5.0f}\n",
      name, 1e-3 * r.lateral, 1e-3 * r.axial, 1e3 * r.travel_lateral, 1e3 * r.travel_axial,
      1e3 * r.counted_x, 1e3 * r.counted_y, told[0], told[1], told[2], told[3], told[4], told[5],
      r.lowest, r.highest);
}

std::string table(const Design& d) {
  std::string text =
      "\n  range        springs, N/mm   travel, mm   counted, mN      bound, mN                "
      "bound, mN m                    modes\n"
      "  +- N      lateral   axial    lat    ax      x      y        Fx      Fy      Fz        Mx  "
      "     My       Mz     Hz\n";
  for (std::size_t i = 0; i < d.rows.size(); ++i) {
    const DesignRow& r = d.rows[i];
    if (i > 0 && r.range == d.rows[0].range && std::abs(r.scale - 1) < kSameSprings) continue;
    text += row(r, i == 0 ? "given" : fmt::format("{:g}", r.range));
  }
  text += fmt::format(
      "  given: the springs as they are, under +- {:g} N; below, all springs stiffer or softer by\n"
      "  one factor, so that +- this force along any axis at the platform's origin just keeps "
      "tags\n"
      "  in view and coils apart. counted: 2 range / (counts per px x travel in px).\n",
      d.rows[0].range);
  return text;
}

std::string footnotes() {
  return "\nbeside the paper\n"
         "  - r_z is printed as 11 bits, but stands there as \"the same as the y-axis\", which has "
         "10.\n"
         "  - The printed yaw step divides the chord by 150: 81.18 / 150 / 4 = 0.135, no angle. "
         "What\n"
         "    is meant, 45 deg / 81.18 px / 4, is 0.139 deg; both round to the printed 0.14.\n"
         "  - Its y resolution is derived once without the \"+ 1\"; with it, 10 bits come out.\n"
         "  - 1.0 mN in x at +- 1 N takes springs that are softer in x than in y. Round ones are\n"
         "    equally stiff: where y has 2.1 mN, so has x.\n";
}

std::string design_report(const Instrument& instrument, const Design& design) {
  return steps(design) + bound_note(instrument, design) + bandwidth(instrument, design) +
         reach(design) + table(design) + footnotes();
}

int print_design(const DesignOptions& o) {
  if (!o.check.empty()) return check_hardware(o.check);
  const study::Instrument asked = instrument_of(o);
  if (!o.export_to.empty()) export_hardware(o.hardware, o.export_to, o.force);
  const study::Design design = study::design(asked, o.ranges);
  print_data(design_report(asked, design));
  for (const std::string& warning : design.warnings) log_info(warning);
  return 0;
}

void add_design_options(command_line::Command verb, DesignOptions& o) {
  verb.footer(
      "Without options: the published design. Resolution, steps and force range by the published "
      "equations, and beside them the Cramer-Rao bound of a tracker that uses every edge.");
  verb.add_option("--sensor", o.sensor,
                  "sensor.yaml: its camera, tags, rest pose and stiffness instead of those below");
  auto hardware = verb.add_option(
      "--hardware", o.hardware,
      "a file of hardware/sensors: the sensor as it will be printed, instead of the options below");
  auto check = verb.add_option(
      "--check", o.check, "a file of hardware/sensors: only whether it can be built, and why not");
  auto folder = verb.add_option("--export", o.export_to,
                                "folder for what follows from --hardware: parameters.scad for the "
                                "parts, sensor.yaml, plan.yaml, scenario.yaml for the simulator")
                    .needs(hardware);
  verb.add_flag("--force", o.force, "what --export finds there and has been changed is replaced")
      .needs(folder);
  check.excludes(hardware);
  const auto add = [&](const char* name, auto& value, const char* what) {
    return verb.add_option(name, value, what).capture_default_str();
  };
  const auto add_within = [&](const char* name, auto& value, double least, double most,
                              const char* what) {
    return add(name, value, what).check(within(least, most));
  };
  o.range_given = add_within("--range-n", o.range_n, 1e-6, 1000, "wanted, +- along each axis, N");
  add_within("--ranges", o.ranges, 1e-6, 1000, "rows of the table, +- N").delimiter(',');
  o.camera_given = add("--camera", o.camera, "px");
  add_within("--fps", o.fps, 0.1, 1e5, "pictures a second");
  o.distance_given =
      add_within("--lens-distance-mm", o.lens_distance_mm, 0.1, 1e4, "from lens to tags");
  add_within("--counts-per-pixel", o.counts_per_px, 0.1, 1e4, "of the published estimate");
  add_within("--blur-px", o.blur_px, 0.05, 100, "standard deviation of the point spread");
  add_within("--noise-counts", o.noise_counts, 0.01, 100,
             "standard deviation of a pixel, grey levels");
  add_within("--contrast-counts", o.contrast_counts, 1, 255, "from ink to paper, grey levels");
  o.size_given = add_within("--tag-mm", o.tag_mm, 0.01, 1000, "edge of the black square");
  o.paper_given =
      add_within("--tag-with-border-mm", o.tag_with_border_mm, 0.01, 1000, "edge of the paper");
  o.tag_px_given = add_within("--tag-px", o.tag_px, 1, 1e5, "edge of the paper in the picture");
  o.image_given = add("--image-px", o.image, "rectangle around all tags in the picture");
  add("--family", o.family, "of the tags");
  add("--ids", o.ids, "of one tag (faces the lens) or two (a roof)").delimiter(',');
  o.axial_given =
      add_within("--axial-n-per-mm", o.axial_n_per_mm, 1e-6, 1e6, "of each of four springs");
  o.lateral_given =
      add_within("--lateral-n-per-mm", o.lateral_n_per_mm, 1e-6, 1e6, "of each of four springs");
  add_within("--spring-length-mm", o.spring_length_mm, 0.1, 1000, "free");
  add_within("--spring-width-mm", o.spring_width_mm, 0.1, 1000, "outer");
  add_within("--wire-mm", o.wire_mm, 1e-3, 100, "diameter");
  verb.add_option("--coils", o.coils, "in all; without it as many as the rate takes")
      .check(within(1, 1000));
  add_within("--spacing-x-mm", o.spacing_x_mm, 0.1, 1000, "between spring axes");
  add_within("--spacing-y-mm", o.spacing_y_mm, 0.1, 1000, "between spring axes");
  add_within("--mass-g", o.mass_g, 0.01, 1e5, "of the platform");
  add_within("--inertia-g-mm2", o.inertia_g_mm2, 0.01, 1e10, "of the platform about x,y,z")
      .delimiter(',')
      .expected(3);
  add_within("--mass-height-mm", o.mass_height_mm, -1000, 1000, "of its centre beyond the tags");
  for (command_line::Option said :
       {o.camera_given, o.distance_given, o.size_given, o.paper_given, o.tag_px_given,
        o.image_given, o.axial_given, o.lateral_given}) {
    hardware.excludes(said);
    check.excludes(said);
  }
}

}  // namespace

void design_command(command_line::Command program) {
  const auto o = std::make_shared<DesignOptions>();
  auto verb = program.add_subcommand(
      "design", "what a choice of camera, tags and springs can measure, before it is built");
  add_design_options(verb, *o);
  verb.runs([o] { return print_design(*o); });
}

}  // namespace tagwrench

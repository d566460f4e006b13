#include "host/commands/design_command.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <iostream>
#include <numbers>

#include "host/commands/design_report.h"
#include "host/commands/hardware_design.h"
#include "host/commands/hardware_instrument.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/sensor/sensor_config.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/tag_patterns.h"
#include "host/wrench/spring_model.h"

namespace tagwrench {
namespace {

constexpr double kMm = 1e-3;
constexpr double kRoof = std::numbers::pi / 4;  // inclination of each tag
constexpr double kRidgeGap = 0.15e-3;           // between a paper's edge and the ridge, m
constexpr double kAttachment = 1.8e-3;          // of the springs, beyond the platform's origin, m
constexpr double kShearRatio = 0.3;             // Poisson's, of steel

command_line::Check within(double low, double high) {
  return command_line::number(low, high, fmt::format("a number from {:g} to {:g}", low, high),
                              fmt::format("{:g}..{:g}", low, high));
}

/// "640x480". Throws ConfigError, naming the option.
std::pair<double, double> size_px(const std::string& option, const std::string& text) {
  const std::size_t x = text.find('x');
  std::optional<double> width;
  std::optional<double> height;
  if (x != std::string::npos) {
    width = command_line::to_number(text.substr(0, x));
    height = command_line::to_number(text.substr(x + 1));
  }
  if (!width || !height || !(*width >= 1 && *height >= 1 && *width <= 1e5 && *height <= 1e5)) {
    throw ConfigError(
        fmt::format("{}: '{}' is not WIDTHxHEIGHT in px; use 640x480 say", option, text));
  }
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

}  // namespace

DesignCommand::DesignCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "design",
          "what a choice of camera, tags and springs can measure, before it is "
          "built")) {
  verb_.footer(
      "Without options: the published design. Resolution, steps and force range by the published "
      "equations, and beside them the Cramer-Rao bound of a tracker that uses every edge.");
  verb_.add_option("--sensor", sensor_,
                   "sensor.yaml: its camera, tags, rest pose and stiffness instead of those below");
  command_line::Option hardware =
      verb_.add_option("--hardware", hardware_,
                       "a file of hardware/sensors: the sensor as it will be printed, instead of "
                       "the options below");
  command_line::Option check = verb_.add_option(
      "--check", check_, "a file of hardware/sensors: only whether it can be built, and why not");
  command_line::Option folder =
      verb_
          .add_option("--export", export_,
                      "folder for what follows from --hardware: parameters.scad for the parts, "
                      "sensor.yaml, plan.yaml, scenario.yaml for the simulator")
          .needs(hardware);
  verb_.add_flag("--force", force_, "what --export finds there and has been changed is replaced")
      .needs(folder);
  check.excludes(hardware);
  range_given_ = verb_.add_option("--range-n", range_n_, "wanted, +- along each axis, N")
                     .capture_default_str()
                     .check(within(1e-06, 1000));
  verb_.add_option("--ranges", ranges_, "rows of the table, +- N")
      .delimiter(',')
      .capture_default_str()
      .check(within(1e-06, 1000));
  add_picture_options();
  add_tag_options();
  add_spring_options();
  for (command_line::Option said : {camera_given_, distance_given_, size_given_, paper_given_,
                                    tag_px_given_, image_given_, axial_given_, lateral_given_}) {
    hardware.excludes(said);
    check.excludes(said);
  }
}

void DesignCommand::add_picture_options() {
  camera_given_ = verb_.add_option("--camera", camera_, "px").capture_default_str();
  verb_.add_option("--fps", fps_, "pictures a second")
      .capture_default_str()
      .check(within(0.1, 100000));
  distance_given_ = verb_.add_option("--lens-distance-mm", lens_distance_mm_, "from lens to tags")
                        .capture_default_str()
                        .check(within(0.1, 10000));
  verb_.add_option("--counts-per-pixel", counts_per_px_, "of the published estimate")
      .capture_default_str()
      .check(within(0.1, 10000));
  verb_.add_option("--blur-px", blur_px_, "standard deviation of the point spread")
      .capture_default_str()
      .check(within(0.05, 100));
  verb_.add_option("--noise-counts", noise_counts_, "standard deviation of a pixel, grey levels")
      .capture_default_str()
      .check(within(0.01, 100));
  verb_.add_option("--contrast-counts", contrast_counts_, "from ink to paper, grey levels")
      .capture_default_str()
      .check(within(1, 255));
}

void DesignCommand::add_tag_options() {
  size_given_ = verb_.add_option("--tag-mm", tag_mm_, "edge of the black square")
                    .capture_default_str()
                    .check(within(0.01, 1000));
  paper_given_ = verb_.add_option("--tag-with-border-mm", tag_with_border_mm_, "edge of the paper")
                     .capture_default_str()
                     .check(within(0.01, 1000));
  tag_px_given_ = verb_.add_option("--tag-px", tag_px_, "edge of the paper in the picture")
                      .capture_default_str()
                      .check(within(1, 100000));
  image_given_ = verb_.add_option("--image-px", image_, "rectangle around all tags in the picture")
                     .capture_default_str();
  verb_.add_option("--family", family_, "of the tags").capture_default_str();
  verb_.add_option("--ids", ids_, "of one tag (faces the lens) or two (a roof)")
      .delimiter(',')
      .capture_default_str();
}

void DesignCommand::add_spring_options() {
  axial_given_ = verb_.add_option("--axial-n-per-mm", axial_n_per_mm_, "of each of four springs")
                     .capture_default_str()
                     .check(within(1e-06, 1e+06));
  lateral_given_ =
      verb_.add_option("--lateral-n-per-mm", lateral_n_per_mm_, "of each of four springs")
          .capture_default_str()
          .check(within(1e-06, 1e+06));
  verb_.add_option("--spring-length-mm", spring_length_mm_, "free")
      .capture_default_str()
      .check(within(0.1, 1000));
  verb_.add_option("--spring-width-mm", spring_width_mm_, "outer")
      .capture_default_str()
      .check(within(0.1, 1000));
  verb_.add_option("--wire-mm", wire_mm_, "diameter")
      .capture_default_str()
      .check(within(0.001, 100));
  verb_.add_option("--coils", coils_, "in all; without it as many as the rate takes")
      .check(within(1, 1000));
  verb_.add_option("--spacing-x-mm", spacing_x_mm_, "between spring axes")
      .capture_default_str()
      .check(within(0.1, 1000));
  verb_.add_option("--spacing-y-mm", spacing_y_mm_, "between spring axes")
      .capture_default_str()
      .check(within(0.1, 1000));
  verb_.add_option("--mass-g", mass_g_, "of the platform")
      .capture_default_str()
      .check(within(0.01, 100000));
  verb_.add_option("--inertia-g-mm2", inertia_g_mm2_, "of the platform about x,y,z")
      .delimiter(',')
      .expected(3)
      .capture_default_str()
      .check(within(0.01, 1e+10));
  verb_.add_option("--mass-height-mm", mass_height_mm_, "of its centre beyond the tags")
      .capture_default_str()
      .check(within(-1000, 1000));
}

void DesignCommand::place_tags(study::Instrument& instrument) const {
  const std::optional<TagFamily> family = family_from_name(family_);
  if (!family) throw ConfigError(fmt::format("--family: there is no family '{}'", family_));
  if (ids_.empty() || ids_.size() > 2) throw ConfigError("--ids: give one tag or two");
  TargetDescription target;
  target.family = *family;
  target.tag_size = tag_mm_ * kMm;
  target.border = 0.5 * (tag_with_border_mm_ - tag_mm_) * kMm;
  instrument.origin = {0, 0, lens_distance_mm_ * kMm};
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    if (ids_[i] < 0 || ids_[i] >= id_count(*family))
      throw ConfigError(fmt::format("--ids: {} has ids 0 to {}", family_, id_count(*family) - 1));
    Eigen::Isometry3d pose = on_roof(i, ids_.size(), target.tag_size, target.border);
    pose.pretranslate(instrument.origin);
    instrument.tags.push_back(seen_tag(target, {ids_[i], {}, Vector6::Zero()}, pose));
  }
  study::SeenPicture& picture = instrument.picture;
  picture.width_px = instrument.counted.frame_width_px;
  picture.height_px = instrument.counted.frame_height_px;
  picture.cx_px = 0.5 * (picture.width_px - 1);
  picture.cy_px = 0.5 * (picture.height_px - 1);
  picture.fx_px = picture.fy_px = tag_px_ / tag_with_border_mm_ * lens_distance_mm_;
}

void DesignCommand::take_sensor(study::Instrument& instrument) const {
  const SensorConfig sensor = load_sensor(sensor_);
  std::vector<command_line::Option> said{tag_px_given_, size_given_, paper_given_, camera_given_,
                                         image_given_};
  if (sensor.rest.camera_T_platform) said.push_back(distance_given_);
  for (command_line::Option option : said) {
    if (option.count() > 0)
      throw ConfigError(
          fmt::format("{}: {} says that already; leave one of them out", option.name(), sensor_));
  }
  // A calibrated matrix is symmetric but for its errors.
  instrument.stiffness = 0.5 * (sensor.wrench.K + sensor.wrench.K.transpose());
  if (Eigen::LLT<Matrix6>(instrument.stiffness).info() != Eigen::Success) {
    throw ConfigError(fmt::format(
        "{}: its stiffness is not that of springs (not positive definite); calibrate again",
        sensor_));
  }
  const CameraModel& camera = sensor.camera;
  study::SeenPicture& picture = instrument.picture;
  picture.width_px = camera.width_px;
  picture.height_px = camera.height_px;
  picture.fx_px = camera.fx_px;
  picture.fy_px = camera.fy_px;
  picture.cx_px = camera.cx_px;
  picture.cy_px = camera.cy_px;
  Eigen::Isometry3d rest = Eigen::Isometry3d::Identity();
  rest.translation() = Eigen::Vector3d(0, 0, lens_distance_mm_ * kMm);
  take_target(sensor.target, sensor.rest.camera_T_platform.value_or(rest), instrument);
}

void DesignCommand::take_target(const TargetDescription& target, const Eigen::Isometry3d& rest,
                                study::Instrument& instrument) const {
  instrument.origin = rest.translation();
  for (std::size_t i = 0; i < target.tags.size(); ++i) {
    const Tag& tag = target.tags[i];
    if (!tag.platform_T_tag && target.tags.size() > 2) {
      throw ConfigError(fmt::format(
          "{}: does not say where its tags are; run `tagwrench calibrate target`", sensor_));
    }
    const Eigen::Isometry3d pose =
        rest *
        tag.platform_T_tag.value_or(on_roof(i, target.tags.size(), target.tag_size, target.border));
    if (pose.translation().z() < target.tag_size) {
      throw ConfigError(
          fmt::format("{}: tag {} would touch the lens; check rest and tags", sensor_, tag.id));
    }
    instrument.tags.push_back(seen_tag(target, tag, pose));
  }
  const Eigen::Vector2d around = size_in_picture(instrument);
  study::CountedPixels& counted = instrument.counted;
  counted.frame_width_px = instrument.picture.width_px;
  counted.frame_height_px = instrument.picture.height_px;
  counted.image_width_px = around.x();
  counted.image_height_px = around.y();
  counted.tag_with_border = target.tag_size + 2 * target.border;
  counted.lens_distance = instrument.origin.z();
  counted.tag_px = instrument.picture.fx_px * counted.tag_with_border / counted.lens_distance;
}

void DesignCommand::mount_springs(study::Instrument& instrument) const {
  study::Spring spring;
  spring.free_length = spring_length_mm_ * kMm;
  spring.outer_diameter = spring_width_mm_ * kMm;
  spring.wire = wire_mm_ * kMm;
  spring.coils = coils_;
  spring.rate = axial_n_per_mm_ / kMm;
  if (spring.mean_diameter() <= 0)
    throw ConfigError("--wire-mm: must be less than --spring-width-mm");
  Springs model;
  model.axial = spring.rate;
  model.lateral = lateral_n_per_mm_ / kMm;
  // Both are those of the same helix (Wahl, Mechanical Springs, ch. 6 and 15).
  const double turn = spring.rate * std::pow(spring.mean_diameter(), 2) * (1 + kShearRatio);
  model.bending = turn / (2 * (2 + kShearRatio));
  model.torsion = turn / 4;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      spring.top = {x * spacing_x_mm_ * kMm, y * spacing_y_mm_ * kMm, kAttachment};
      instrument.springs.push_back(spring);
      model.centres.push_back(spring.top - Eigen::Vector3d(0, 0, 0.5 * spring.free_length));
    }
  }
  const bool given = axial_given_.count() > 0 || lateral_given_.count() > 0;
  if (sensor_.empty() || given) instrument.stiffness = stiffness(model);
}

study::Instrument DesignCommand::instrument() const {
  study::Instrument result;
  result.frame_rate = fps_;
  result.range = range_n_;
  result.picture.blur_px = blur_px_;
  result.picture.noise_counts = noise_counts_;
  result.picture.contrast_counts = contrast_counts_;
  study::CountedPixels& counted = result.counted;
  counted.counts_per_px = counts_per_px_;
  if (!hardware_.empty()) {
    take_hardware(load_buildable(hardware_), result);
    if (range_given_.count() > 0) result.range = range_n_;
    return result;
  }
  if (sensor_.empty()) {
    std::tie(counted.frame_width_px, counted.frame_height_px) = size_px("--camera", camera_);
    std::tie(counted.image_width_px, counted.image_height_px) = size_px("--image-px", image_);
    counted.tag_px = tag_px_;
    counted.tag_with_border = tag_with_border_mm_ * kMm;
    counted.lens_distance = lens_distance_mm_ * kMm;
    if (tag_with_border_mm_ < tag_mm_)
      throw ConfigError("--tag-with-border-mm: must not be less than --tag-mm");
    place_tags(result);
  } else {
    take_sensor(result);
  }
  if (counted.travel_x_px() <= 0 || counted.travel_y_px() <= 0)
    throw ConfigError(fmt::format(
        "the tags' image of {:.0f}x{:.0f} px leaves no way to move in {:.0f}x{:.0f} px; "
        "take smaller tags or a longer way to the lens",
        counted.image_width_px, counted.image_height_px, counted.frame_width_px,
        counted.frame_height_px));
  mount_springs(result);
  result.platform.mass = 1e-3 * mass_g_;
  result.platform.centre_of_mass = {0, 0, mass_height_mm_ * kMm};
  result.platform.principal_inertia =
      1e-9 * Eigen::Vector3d(inertia_g_mm2_[0], inertia_g_mm2_[1], inertia_g_mm2_[2]);
  return result;
}

int DesignCommand::run() const {
  if (!check_.empty()) return check_hardware(check_);
  const study::Instrument asked = instrument();
  if (!export_.empty()) export_hardware(hardware_, export_, force_);
  const study::Design design = study::design(asked, ranges_);
  std::cout << design_report(asked, design) << std::flush;
  for (const std::string& warning : design.warnings) log_info(warning);
  return std::cout ? 0 : 1;
}

}  // namespace tagwrench

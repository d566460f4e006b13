#include "host/source/simulator/renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/core/config_error.h"
#include "host/source/simulator/prints.h"

namespace tagwrench::sim {
namespace {

constexpr int kRollingBandRows = 8;
constexpr double kPlateMargin = 3.5e-3;  // m, how far the platform may move before the plate ends
constexpr double kPadMargin = 0.7e-3;    // m
constexpr double kBlurPerPass_px = 3.0;
constexpr double kStill_px = 2e-3;
constexpr double kEvenInstantsPerPixel = 3;
constexpr int kMinEvenInstants = 4;
constexpr int kMaxEvenInstants = 32;
constexpr double kLightSlant = 0.35;   // of the LED's direction against the optical axis
constexpr double kNearest = 1e-3;      // m, nothing is drawn nearer to the lens
constexpr double kTexelsPerPixel = 2;  // of the tags, at rest

/// A lens blurs before the sensor samples. So much of the blur (standard deviation, px) is given to
/// the tags' textures; what is left, which changes with focus, to the picture. Were it all in the
/// picture, the sampled edges would depend on their place in the pixel: 0.1 grey level, but alike
/// along the whole of an edge, which in alignment is worth 0.17 um in z.
double before_sampling_px(const Optics& optics) { return std::min(optics.psf_sigma_px, 0.6); }

std::size_t pixel_count(const Camera& camera) {
  return static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
}

}  // namespace

Renderer::Renderer(const Scenario& scenario)
    : camera_(scenario.camera),
      optics_(scenario.optics),
      light_(scenario.light),
      exposure_(scenario.exposure),
      nominal_exposure_(scenario.exposure.time),
      noise_(scenario.noise),
      target_(scenario.target),
      seed_(scenario.seed),
      tags_(placed_tags(scenario)),
      glued_(tags_),
      rays_(scenario.camera),
      disturbances_(scenario.disturbances, scenario.seed, scenario.camera.width_px,
                    static_cast<int>(scenario.target.tags.size())),
      visible_(scenario.target.tags.size()) {
  const std::size_t pixels = pixel_count(camera_);
  const auto rows = static_cast<std::size_t>(camera_.height_px);
  const auto columns = static_cast<std::size_t>(camera_.width_px);
  scene_.resize(pixels);
  blurred_.resize(pixels);
  kernels_.resize(rows * (kMaxRadius + 1));
  radii_.resize(rows);
  brightness_.assign(rows, 1.0);
  padded_.resize(columns + 2 * kMaxRadius);
  row_.resize(columns);
  for (auto* line : {&scratch_.x, &scratch_.y, &scratch_.u, &scratch_.v, &scratch_.reflectance,
                     &scratch_.coverage})
    line->resize(columns + 2);
  scratch_.sum.resize(columns + 2);
  Random random(seed_, kNoiseTable);
  normals_.resize(kNormals + columns);
  for (float& value : normals_) value = static_cast<float>(random.normal());
  build_layers(scenario);
  build_light();
}

void Renderer::build_layers(const Scenario& scenario) {
  const Mechanics& mechanics = scenario.mechanics;
  const double texels_per_m = camera_.fx_px / target_.rest_position.z();
  const double plate_depth = target_.rest_position.z() + mechanics.spring_attachment_z;
  const double half_x = 0.6 * camera_.width_px / camera_.fx_px * plate_depth + kPlateMargin;
  const double half_y = 0.6 * camera_.height_px / camera_.fy_px * plate_depth + kPlateMargin;
  const double half_paper = 0.5 * target_.tag_size + target_.border;

  Layer plate;
  plate.platform_T_plane.position.z() = mechanics.spring_attachment_z;
  plate.texture = print_plate(mechanics, half_x, half_y, texels_per_m, seed_);
  layers_.push_back(std::move(plate));
  for (const PlacedTag& tag : tags_) {
    Layer pad;
    pad.platform_T_plane = tag.platform_T_tag;
    pad.texture =
        print_pad(half_paper, kPadMargin, texels_per_m, seed_ + static_cast<std::uint64_t>(tag.id));
    layers_.push_back(std::move(pad));
  }
  const std::size_t first_paper = layers_.size();
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    Layer paper;
    paper.platform_T_plane = tags_[i].platform_T_tag;
    const RigidPose rest{Eigen::Matrix3d::Identity(), target_.rest_position};
    const PrintFault fault = print_fault(target_, i, seed_, rest * tags_[i].platform_T_tag);
    const Texture print =
        print_tag(target_, fault, tag_cells(target_.family, tags_[i].id),
                  kTexelsPerPixel * texels_per_m, seed_ + static_cast<std::uint64_t>(tags_[i].id));
    paper.texture = softened(print, kTexelsPerPixel * before_sampling_px(optics_));
    paper.fine = true;
    paper.tag = i;
    layers_.push_back(std::move(paper));
  }
  for (const Dirt& dirt : disturbances_.dirt()) {
    const Layer& paper = layers_[first_paper + static_cast<std::size_t>(dirt.tag)];
    dirty_.push_back(with_dirt(paper.texture, dirt, target_.tag_size, seed_, dirty_.size()));
  }
  for (Layer& layer : layers_) {
    layer.half_x = 0.5 * layer.texture.width / layer.texture.texels_per_m;
    layer.half_y = 0.5 * layer.texture.height / layer.texture.texels_per_m;
  }
  views_.resize(layers_.size());
}

void Renderer::slip_tag(std::size_t tag, const Eigen::Vector3d& slip) noexcept {
  const RigidPose moved{rotation_matrix({0, 0, slip.z()}), {slip.x(), slip.y(), 0}};
  tags_[tag].platform_T_tag = glued_[tag].platform_T_tag * moved;
  for (Layer& layer : layers_)
    if (layer.fine && layer.tag == tag) layer.platform_T_plane = tags_[tag].platform_T_tag;
}

void Renderer::build_light() {
  gain_.resize(pixel_count(camera_));
  glare_.resize(pixel_count(camera_));
  const double half_diagonal = 0.5 * std::hypot(camera_.width_px, camera_.height_px);
  const Eigen::Vector2d bright(std::cos(light_.direction), std::sin(light_.direction));
  const Eigen::Vector2d middle(0.5 * (camera_.width_px - 1), 0.5 * (camera_.height_px - 1));
  // The blown-out corner: where the bright side meets the image's edge.
  const Eigen::Vector2d corner = middle + 1.25 * middle.cwiseProduct(bright);
  const double spread = 0.12 * camera_.width_px;
  std::size_t i = 0;
  for (int row = 0; row < camera_.height_px; ++row) {
    for (int column = 0; column < camera_.width_px; ++column, ++i) {
      const Eigen::Vector2d pixel(column, row);
      const Eigen::Vector2d off = (pixel - middle) / half_diagonal;
      const double vignette = 1 - optics_.vignetting * off.squaredNorm();
      const double uneven = 1 - light_.unevenness * 0.5 * (1 - bright.dot(off));
      gain_[i] = static_cast<float>(light_.level_counts * vignette * uneven);
      const double away = (pixel - corner).squaredNorm() / (2 * spread * spread);
      glare_[i] = static_cast<float>(light_.glare_counts * std::exp(-away));
    }
  }
}

void Renderer::render(const PlatformMotion& motion, double middle_time, std::uint64_t sequence,
                      std::uint8_t* pixels) noexcept {
  happening_ = disturbances_.between(middle_time - half_window(), middle_time + half_window());
  const int band = exposure_.rolling_readout > 0 ? kRollingBandRows : camera_.height_px;
  for (int first = 0; first < camera_.height_px; first += band) {
    const int last = std::min(first + band, camera_.height_px);
    view_band(motion, middle_time, first, last);
    for (int row = first; row < last; ++row) {
      draw_opaque(views_.front(), row);
      for (std::size_t i = 1; i < layers_.size(); ++i) {
        const View& view = views_[i];
        if (row < view.top || row >= view.bottom || view.left >= view.right) continue;
        if (!layers_[i].fine)
          draw_coarse(view, row);
        else if (exposure_.even)
          draw_even(view, row);
        else
          draw_fine(view, row);
      }
    }
  }
  for (const Going<Occluder>& occluder : happening_.occluders)
    for (int row = 0; row < camera_.height_px; ++row)
      draw_occluder_row(occluder, row, row_time(row, middle_time));
  const auto pose_at = [&](double time) { return platform_pose(target_, motion.seen(time)); };
  middle_pose_ = pose_at(middle_time);
  smear_px_ = farthest_px(pose_at(middle_time - 0.5 * exposure_.time),
                          pose_at(middle_time + 0.5 * exposure_.time));
  choose_point_spread(optics_.focus_distance + focus_shift(happening_, middle_time));
  blur_rows();
  expose_rows(middle_time);
  Random random = Random::numbered(seed_, kNoiseOffsets, sequence);
  for (int row = 0; row < camera_.height_px; ++row)
    expose_row(row, row_time(row, middle_time), random, pixels);
  judge_visibility(middle_time);
}

// The middle of a row's exposure.
double Renderer::row_time(double row, double middle_time) const noexcept {
  const double middle_row = 0.5 * (camera_.height_px - 1);
  return middle_time + (row - middle_row) / camera_.height_px * exposure_.rolling_readout;
}

/// What LED, exposure and gain make of each row's brightness.
void Renderer::expose_rows(double middle_time) noexcept {
  const double longer = nominal_exposure_ > 0 ? exposure_.time / nominal_exposure_ : 1.0;
  const double scale = longer * sensor_gain_;
  const bool all_at_once = exposure_.rolling_readout <= 0;
  for (int row = 0; row < camera_.height_px; ++row) {
    double& brightness = brightness_[static_cast<std::size_t>(row)];
    if (led_ == nullptr) {
      brightness = scale;
    } else if (row > 0 && all_at_once) {
      brightness = brightness_.front();
    } else {
      const double middle = row_time(row, middle_time);
      const double lit = led_->mean(middle - 0.5 * exposure_.time, middle + 0.5 * exposure_.time);
      brightness = scale * (light_.room + lit / light_.led_level);
    }
  }
}

void Renderer::view_band(const PlatformMotion& motion, double middle_time, int first_row,
                         int last_row) noexcept {
  const double time = row_time(0.5 * (first_row + last_row - 1), middle_time);
  const auto pose_at = [&](double share) {
    return platform_pose(target_, motion.seen(time + share * exposure_.time));
  };
  instant_count_ = instants_for(pose_at(-0.5), pose_at(0), pose_at(0.5));
  for (int i = 0; i < instant_count_; ++i)
    poses_[static_cast<std::size_t>(i)] = pose_at((i + 0.5) / instant_count_ - 0.5);
  middle_pose_ = pose_at(0);
  for (std::size_t i = 0; i < layers_.size(); ++i) view_layer(layers_[i], views_[i]);
}

// Enough instants that the samples of a moving edge lie closer than the point spread is wide.
int Renderer::instants_for(const RigidPose& first, const RigidPose& middle,
                           const RigidPose& last) const noexcept {
  if (exposure_.even) {
    const double way_px = farthest_px(first, middle) + farthest_px(middle, last);
    if (way_px < kStill_px) return 1;
    return std::clamp(static_cast<int>(std::ceil(kEvenInstantsPerPixel * way_px)), kMinEvenInstants,
                      kMaxEvenInstants);
  }
  const double blur_px = farthest_px(first, last);
  const int passes =
      std::clamp(static_cast<int>(std::ceil(blur_px / kBlurPerPass_px)), 1, kMaxPasses);
  return kInstantsPerPass * kRowPhases * passes;
}

// The longest way of a tag's centre between two poses, px.
double Renderer::farthest_px(const RigidPose& first, const RigidPose& last) const noexcept {
  double farthest = 0;
  for (const PlacedTag& tag : tags_) {
    const Eigen::Vector3d a = first * tag.platform_T_tag.position;
    const Eigen::Vector3d b = last * tag.platform_T_tag.position;
    if (a.z() < kNearest || b.z() < kNearest) continue;
    const Eigen::Vector2d moved = b.head<2>() / b.z() - a.head<2>() / a.z();
    farthest = std::max(farthest, camera_.fx_px * moved.norm());
  }
  return farthest;
}

void Renderer::view_layer(const Layer& layer, View& view) noexcept {
  const auto* dirt = std::find_if(happening_.dirt.begin(), happening_.dirt.end(),
                                  [&](const DirtShown& d) { return d.tag == layer.tag; });
  const bool clean = !layer.fine || dirt == happening_.dirt.end();
  view.texture = clean ? &layer.texture : &dirty_[dirt->dirt];
  view.instant_count = layer.fine ? instant_count_ : 1;
  view.shade = shade(layer, middle_pose_);
  Eigen::AlignedBox2d seen;
  for (int i = 0; i < view.instant_count; ++i) {
    const RigidPose& pose = layer.fine ? poses_[static_cast<std::size_t>(i)] : middle_pose_;
    view.instants[static_cast<std::size_t>(i)] = texel_from_ray(layer, pose);
    for (const double sx : {-1.0, 1.0}) {
      for (const double sy : {-1.0, 1.0}) {
        const Eigen::Vector3d point =
            pose *
            (layer.platform_T_plane * Eigen::Vector3d(sx * layer.half_x, sy * layer.half_y, 0));
        if (point.z() < kNearest) continue;
        seen.extend(project(camera_, point.head<2>() / point.z()));
      }
    }
  }
  const auto limit = [](double value, int high) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(high)));
  };
  // Straight edges bend by a pixel or two between the corners.
  view.left = limit(std::floor(seen.min().x()) - 3, camera_.width_px);
  view.right = limit(std::ceil(seen.max().x()) + 4, camera_.width_px);
  view.top = limit(std::floor(seen.min().y()) - 3, camera_.height_px);
  view.bottom = limit(std::ceil(seen.max().y()) + 4, camera_.height_px);
}

// Diffuse light plus a lamp from the side: a surface that turns towards the lamp gets brighter.
float Renderer::shade(const Layer& layer, const RigidPose& camera_T_platform) const noexcept {
  const Eigen::Vector3d to_lamp = Eigen::Vector3d(kLightSlant * std::cos(light_.direction),
                                                  kLightSlant * std::sin(light_.direction), -1)
                                      .normalized();
  const Eigen::Vector3d normal =
      -(camera_T_platform.rotation * layer.platform_T_plane.rotation).col(2);
  const double facing = std::max(0.0, normal.dot(to_lamp)) / -to_lamp.z();
  return static_cast<float>(light_.ambient + (1 - light_.ambient) * facing);
}

// A ray (x, y, 1) meets the plane point (X, Y) where it is parallel to X r1 + Y r2 + t; hence (X,
// Y, 1) is the inverse of [r1 r2 t] times the ray, up to scale.
Renderer::TexelFromRay Renderer::texel_from_ray(const Layer& layer,
                                                const RigidPose& camera_T_platform) const noexcept {
  const RigidPose pose = camera_T_platform * layer.platform_T_plane;
  Eigen::Matrix3d ray_from_plane;
  ray_from_plane << pose.rotation.col(0), pose.rotation.col(1), pose.position;
  Eigen::Matrix3d texel_from_plane;
  const Texture& t = layer.texture;
  texel_from_plane << t.texels_per_m, 0, t.centre_u, 0, t.texels_per_m, t.centre_v, 0, 0, 1;
  const Eigen::Matrix3d h = texel_from_plane * ray_from_plane.inverse();
  const double scale = 1.0 / h.cwiseAbs().maxCoeff();
  TexelFromRay result;
  for (int i = 0; i < 9; ++i)
    result[static_cast<std::size_t>(i)] = static_cast<float>(scale * h(i / 3, i % 3));
  return result;
}

// Depth of what is seen in the column of the target: the tags' planes where they rise above the
// plate.
double Renderer::depth_at_row(int row) const noexcept {
  const Eigen::Vector3d& origin = middle_pose_.position;
  const int column =
      std::clamp(static_cast<int>(camera_.cx_px + camera_.fx_px * origin.x() / origin.z()), 0,
                 camera_.width_px - 1);
  const Eigen::Vector3d ray(rays_.x(row)[column], rays_.y(row)[column], 1);
  const auto plane_depth = [&](const RigidPose& platform_T_plane) {
    const RigidPose plane = middle_pose_ * platform_T_plane;
    const Eigen::Vector3d normal = plane.rotation.col(2);
    return normal.dot(plane.position) / normal.dot(ray);
  };
  double depth = 0;
  for (const PlacedTag& tag : tags_) depth = std::max(depth, plane_depth(tag.platform_T_tag));
  const double plate = plane_depth(layers_.front().platform_T_plane);
  return std::clamp(std::min(depth, plate), 0.5 * target_.rest_position.z(),
                    2.0 * target_.rest_position.z());
}

void Renderer::choose_point_spread(double focus_distance) noexcept {
  const double before = before_sampling_px(optics_);
  const double in_focus = std::sqrt(optics_.psf_sigma_px * optics_.psf_sigma_px - before * before);
  for (int row = 0; row < camera_.height_px; ++row) {
    const double defocus = optics_.defocus_px_per_m * (depth_at_row(row) - focus_distance);
    const double sigma = std::min(std::hypot(in_focus, defocus), kMaxRadius / 3.0);
    const int radius = static_cast<int>(std::ceil(3.0 * sigma));
    float* weights = kernels_.data() + static_cast<std::size_t>(row) * (kMaxRadius + 1);
    double sum = 0;
    for (int k = 0; k <= radius; ++k) {
      const double weight = k == 0 ? 1.0 : std::exp(-0.5 * k * k / (sigma * sigma));
      weights[k] = static_cast<float>(weight);
      sum += k == 0 ? weight : 2 * weight;
    }
    for (int k = 0; k <= radius; ++k) weights[k] = static_cast<float>(weights[k] / sum);
    radii_[static_cast<std::size_t>(row)] = radius;
  }
}

}  // namespace tagwrench::sim

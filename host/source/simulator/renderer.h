// Platform motion -> 8-bit picture: planes seen through rays, light, point spread, noise.
//
// Order of one frame: plate (one sample a pixel), pads (one), tags (2 x 2 samples a pixel, spread
// over the exposure), what passes before the lens, Gaussian point spread whose width follows the
// depth of the scene row by row (a part of it is in the tags' textures), light and glare, noise,
// rounding.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/source/simulator/disturbances.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/prints.h"
#include "host/source/simulator/random.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

class Renderer {
 public:
  /// Throws ConfigError if the scenario cannot be rendered.
  explicit Renderer(const Scenario& scenario);

  /// Seconds before and after the middle of a frame in which its picture is exposed.
  double half_window() const noexcept { return 0.5 * (exposure_.time + exposure_.rolling_readout); }

  /// Lights the scene by an LED from outside, borrowed; nullptr: by the scenario's even light.
  void set_led(LedLight* led) noexcept { led_ = led; }

  /// Of the next frames; the picture's brightness goes with both, its noise as a sensor's does.
  void set_exposure(double exposure, double gain) noexcept {
    exposure_.time = exposure;
    sensor_gain_ = gain;
  }
  double exposure() const noexcept { return exposure_.time; }
  double sensor_gain() const noexcept { return sensor_gain_; }

  /// Renders the frame whose middle row is exposed around `middle_time`; `pixels` holds width *
  /// height bytes. The noise depends on the seed and on `sequence` alone. No heap.
  void render(const PlatformMotion& motion, double middle_time, std::uint64_t sequence,
              std::uint8_t* pixels) noexcept;

  /// Where the tags sit: as glued, or where they have slipped to.
  const std::vector<PlacedTag>& tags() const noexcept { return tags_; }
  /// A tag's paper sits so far (m along its x and y, rad about its z) from where it was glued.
  void slip_tag(std::size_t tag, const Eigen::Vector3d& slip) noexcept;

  /// Of the frame last rendered: what disturbed it, ...
  const Happening& happening() const noexcept { return happening_; }
  /// ... the longest way that a tag's centre went in the image during the exposure, px, ...
  double smear_px() const noexcept { return smear_px_; }
  /// ... and of each tag's black square the share (0..1) in which paper and ink could be told
  /// apart: inside of the image, not covered, neither dark nor blown out.
  const std::vector<double>& visible() const noexcept { return visible_; }

 private:
  static constexpr int kInstantsPerPass = 4;  ///< one for each of a pixel's 2 x 2 samples
  static constexpr int kMaxPasses = 8;
  static constexpr int kRowPhases = 4;  ///< neighbouring rows look at different instants
  static constexpr int kMaxInstants = kInstantsPerPass * kMaxPasses * kRowPhases;
  static constexpr int kMaxRadius = 12;  ///< px, of the point spread
  static constexpr std::size_t kNormals = 1U << 20U;

  /// (x, y, 1) of a ray -> (u, v, 1) of a texel, up to scale.
  using TexelFromRay = std::array<float, 9>;

  struct Layer {
    RigidPose platform_T_plane;
    Texture texture;
    double half_x = 0, half_y = 0;  ///< m, where coverage ends
    bool fine = false;              ///< sampled 2 x 2 over the exposure
    std::size_t tag = 0;            ///< of a fine layer: position in tags()
  };
  struct View {                        ///< of one layer in one band of rows
    const Texture* texture = nullptr;  ///< clean or with dirt
    std::array<TexelFromRay, kMaxInstants> instants{};
    int instant_count = 1;
    float shade = 1;
    /// Pixels that it can touch; right and bottom exclusive.
    int left = 0, right = 0, top = 0, bottom = 0;
  };
  struct Scratch {  ///< one row of texel lookups
    std::vector<float> x, y, u, v, reflectance, coverage;
    std::vector<Texel> sum;  ///< of each pixel's samples
  };

  void build_layers(const Scenario& scenario);
  void build_light();
  void view_band(const PlatformMotion& motion, double middle_time, int first_row,
                 int last_row) noexcept;
  void view_layer(const Layer& layer, View& view) noexcept;
  double row_time(double row, double middle_time) const noexcept;
  void expose_rows(double middle_time) noexcept;
  double farthest_px(const RigidPose& first, const RigidPose& last) const noexcept;
  int instants_for(const RigidPose& first, const RigidPose& middle,
                   const RigidPose& last) const noexcept;
  float shade(const Layer& layer, const RigidPose& camera_T_platform) const noexcept;
  TexelFromRay texel_from_ray(const Layer& layer,
                              const RigidPose& camera_T_platform) const noexcept;

  void draw_opaque(const View& view, int row) noexcept;
  void draw_coarse(const View& view, int row) noexcept;
  void draw_fine(const View& view, int row) noexcept;
  void draw_even(const View& view, int row) noexcept;
  void add_samples(const Texture& t, const TexelFromRay& h, int count, int first,
                   int stride) noexcept;
  void composite(const View& view, int row, float weight) noexcept;

  void draw_occluder_row(const Going<Occluder>& occluder, int row, double time) noexcept;
  void judge_visibility(double middle_time) noexcept;
  double contrast_at(const Eigen::Vector2d& pixel, double middle_time) const noexcept;
  /// px from the image centre.
  Eigen::Vector2d from_centre(double column, double row) const noexcept {
    return {column - 0.5 * (camera_.width_px - 1), row - 0.5 * (camera_.height_px - 1)};
  }

  void choose_point_spread(double focus_distance) noexcept;
  double depth_at_row(int row) const noexcept;
  void blur_rows() noexcept;
  void light_row(int row, double time, float* light) noexcept;
  void expose_row(int row, double time, Random& random, std::uint8_t* pixels) noexcept;

  Camera camera_;
  Optics optics_;
  Light light_;
  Exposure exposure_;
  double nominal_exposure_;  ///< s, that light_.level_counts stands for
  double sensor_gain_ = 1;
  LedLight* led_ = nullptr;
  Noise noise_;
  Target target_;
  std::uint64_t seed_;
  std::vector<PlacedTag> tags_;
  std::vector<PlacedTag> glued_;
  RayTable rays_;
  std::vector<Layer> layers_;
  std::vector<View> views_;
  std::array<RigidPose, kMaxInstants> poses_{};  ///< of the platform over one band's exposure
  RigidPose middle_pose_;                        ///< in the middle of one band's exposure
  int instant_count_ = kInstantsPerPass * kRowPhases;

  std::vector<float> scene_, blurred_;  ///< reflectance as lit by even light
  std::vector<float> gain_, glare_;     ///< grey levels per reflectance; grey levels
  std::vector<float> kernels_;          ///< per row: weights 0..kMaxRadius
  std::vector<int> radii_;              ///< per row, px
  std::vector<double> brightness_;      ///< per row, over that of the scenario's even light
  std::vector<float> padded_, row_;
  std::vector<float> normals_;  ///< standard normal numbers, entered at random places
  Scratch scratch_;

  DisturbancePlayer disturbances_;
  std::vector<Texture> dirty_;  ///< tags with dirt on, as disturbances_.dirt() orders them
  Happening happening_;
  double smear_px_ = 0;
  std::vector<double> visible_;
};

}  // namespace tagwrench::sim

// The renderer's share in the disturbances: what passes before the lens, changing light and glare,
// and how much of the tags they leave to see. Loops over a row are written for vector code, as in
// render_rows.cpp.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/source/simulator/renderer.h"

namespace tagwrench::sim {
namespace {

constexpr int kVisibilityGrid = 16;  // points along each side of a tag
constexpr double kMinContrast_counts = 10;
constexpr double kSpotReach = 5;  // sigmas, where a spot of light ends

// wave[i] = amplitude sin(k i + phase), by turning a phasor; k in rad per px.
void fill_wave(double amplitude, double k, double phase, int count, float* wave) {
  const auto turn_cos = static_cast<float>(std::cos(k));
  const auto turn_sin = static_cast<float>(std::sin(k));
  auto c = static_cast<float>(amplitude * std::cos(phase));
  auto s = static_cast<float>(amplitude * std::sin(phase));
  for (int i = 0; i < count; ++i) {
    wave[i] = s;
    const float next = s * turn_cos + c * turn_sin;
    c = c * turn_cos - s * turn_sin;
    s = next;
  }
}

}  // namespace

// px from the image centre.
Eigen::Vector2d Renderer::from_centre(double column, double row) const noexcept {
  return {column - 0.5 * (camera_.width_px - 1), row - 0.5 * (camera_.height_px - 1)};
}

void Renderer::draw_occluders(double middle_time) noexcept {
  for (const Going<Occluder>& occluder : happening_.occluders) {
    for (int row = 0; row < camera_.height_px; ++row) {
      draw_occluder_row(occluder, row, row_time(row, middle_time));
    }
  }
}

// The same shape as covered().
void Renderer::draw_occluder_row(const Going<Occluder>& occluder, int row, double time) noexcept {
  if (time < occluder.begin || time >= occluder.end()) return;
  const Occluder& o = occluder.what;
  const int width = camera_.width_px;
  const Eigen::Vector2d left = from_centre(0, row) - place(occluder, time);
  const double half_edge = half_edge_px(o, exposure_.time);
  const double reach = 0.5 * o.width_px + half_edge;
  float* cover = scratch_.coverage.data();
  const auto x0 = static_cast<float>(left.x());
  const auto scale = static_cast<float>(0.5 / half_edge);
  const auto inner = static_cast<float>(0.5 + 0.25 * o.width_px / half_edge);
  if (o.shape == OccluderShape::disc) {
    if (std::abs(left.y()) > reach) return;
    const auto y2 = static_cast<float>(left.y() * left.y());
    for (int i = 0; i < width; ++i) {
      const float x = x0 + static_cast<float>(i);
      cover[i] = std::min(std::max(inner - scale * std::sqrt(x * x + y2), 0.0F), 1.0F);
    }
  } else {
    const double along_x = std::cos(o.direction);
    const double first = left.x() * along_x + left.y() * std::sin(o.direction);
    const double last = first + along_x * (width - 1);
    if (std::min(first, last) > reach || std::max(first, last) < -reach) return;
    const auto a = static_cast<float>(first);
    const auto b = static_cast<float>(along_x);
    for (int i = 0; i < width; ++i) {
      const float distance = std::abs(a + b * static_cast<float>(i));
      cover[i] = std::min(std::max(inner - scale * distance, 0.0F), 1.0F);
    }
  }
  // A chequer of waves that moves with the object.
  const double k = 2 * std::numbers::pi / o.texture_wavelength_px;
  float* wave = scratch_.reflectance.data();
  fill_wave(o.texture * std::cos(k * left.y()), k, k * left.x(), width, wave);
  const auto reflectance = static_cast<float>(o.reflectance);
  float* out = scene_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  for (int i = 0; i < width; ++i) {
    const float own = std::max(reflectance + wave[i], 0.0F);
    out[i] += cover[i] * (own - out[i]);
  }
}

// Reflectance as lit by even light -> grey levels, in place.
void Renderer::light_row(int row, double time, float* light) noexcept {
  const int width = camera_.width_px;
  const std::size_t start = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  const float* gain = gain_.data() + start;
  const float* glare = glare_.data() + start;
  const double half_diagonal = 0.5 * std::hypot(camera_.width_px, camera_.height_px);
  const Eigen::Vector2d gradient = light_gradient(happening_, time) / half_diagonal;
  const Eigen::Vector2d left = from_centre(0, row);
  const double factor =
      light_factor(happening_, time, exposure_.time) * brightness_[static_cast<std::size_t>(row)];
  const auto at_left = static_cast<float>(factor * (1 + gradient.dot(left)));
  const auto slope = static_cast<float>(factor * gradient.x());
  for (int i = 0; i < width; ++i) {
    const float level = light[i] * gain[i] + glare[i];
    light[i] = level * std::max(at_left + slope * static_cast<float>(i), 0.0F);
  }
  for (const Going<Glare>& going : happening_.glare) {
    const Spot s = spot(going, time);
    const double per_px2 = 0.5 / (going.what.sigma_px * going.what.sigma_px);
    const Eigen::Vector2d off = left - s.place_px;
    const double reach = kSpotReach * going.what.sigma_px;
    if (std::abs(off.y()) > reach) continue;
    const int first = std::max(0, static_cast<int>(std::ceil(-off.x() - reach)));
    const int last = std::min(width - 1, static_cast<int>(std::floor(-off.x() + reach)));
    // Neighbours on a Gaussian have a ratio, and ratios a constant one.
    const double x = off.x() + first;
    double value = s.counts * std::exp(-per_px2 * (x * x + off.y() * off.y()));
    double ratio = std::exp(-per_px2 * (2 * x + 1));
    const double ratio_of_ratios = std::exp(-2 * per_px2);
    for (int i = first; i <= last; ++i) {
      light[i] += static_cast<float>(value);
      value *= ratio;
      ratio *= ratio_of_ratios;
    }
  }
}

// Grey levels between ideal paper and ideal ink at a pixel, after everything but blur and noise.
double Renderer::contrast_at(const Eigen::Vector2d& pixel, double middle_time) const noexcept {
  const int column = static_cast<int>(std::lround(pixel.x()));
  const int row = static_cast<int>(std::lround(pixel.y()));
  if (column < 0 || row < 0 || column >= camera_.width_px || row >= camera_.height_px) return 0;
  const double time = row_time(row, middle_time);
  const Eigen::Vector2d off = from_centre(pixel.x(), pixel.y());
  double seen = 1;
  for (const auto& occluder : happening_.occluders) {
    seen *= 1 - covered(occluder, off, time, exposure_.time);
  }
  double spots = 0;
  for (const auto& going : happening_.glare) {
    const Spot s = spot(going, time);
    spots += s.counts * std::exp(-0.5 * (off - s.place_px).squaredNorm() /
                                 (going.what.sigma_px * going.what.sigma_px));
  }
  const double half_diagonal = 0.5 * std::hypot(camera_.width_px, camera_.height_px);
  const double factor = light_factor(happening_, time, exposure_.time) *
                        brightness_[static_cast<std::size_t>(row)] *
                        (1 + light_gradient(happening_, time).dot(off) / half_diagonal);
  const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width_px) +
                        static_cast<std::size_t>(column);
  const auto level = [&](double reflectance) {
    return std::min(factor * (seen * reflectance * gain_[i] + glare_[i]) + spots, 255.0);
  };
  return level(target_.paper_reflectance) - level(target_.ink_reflectance);
}

void Renderer::judge_visibility(double middle_time) noexcept {
  for (std::size_t tag = 0; tag < tags_.size(); ++tag) {
    const RigidPose pose = middle_pose_ * tags_[tag].platform_T_tag;
    int visible = 0;
    for (int v = 0; v < kVisibilityGrid; ++v) {
      for (int u = 0; u < kVisibilityGrid; ++u) {
        const Eigen::Vector3d point =
            pose *
            Eigen::Vector3d((u + 0.5) / kVisibilityGrid - 0.5, (v + 0.5) / kVisibilityGrid - 0.5, 0)
                .cwiseProduct(Eigen::Vector3d(target_.tag_size, target_.tag_size, 0));
        if (point.z() <= 0) continue;
        const Eigen::Vector2d pixel = project(camera_, point.head<2>() / point.z());
        visible += contrast_at(pixel, middle_time) >= kMinContrast_counts ? 1 : 0;
      }
    }
    visible_[tag] = visible / static_cast<double>(kVisibilityGrid * kVisibilityGrid);
  }
}

}  // namespace tagwrench::sim

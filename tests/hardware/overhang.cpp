#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/hardware/mesh.h"

namespace tagwrench::test {
namespace {

/// A part cut into cubes as wide as a layer is high. One cube to the side in one layer is 45
/// degrees.
class Voxels {
 public:
  Voxels(const Mesh& mesh, double edge) : edge_(edge), box_(box(mesh)) {
    // A rim of empty cubes all around spares looking out for the ends.
    const Eigen::Vector3d cubes = box_.sizes() / edge;
    nx_ = static_cast<int>(std::ceil(cubes.x())) + 2;
    ny_ = static_cast<int>(std::ceil(cubes.y())) + 2;
    nz_ = static_cast<int>(std::ceil(cubes.z() - 1e-6));
    std::vector<std::vector<double>> crossings(static_cast<std::size_t>(nx_ * ny_));
    for (const Triangle& t : mesh) cross(t, crossings);
    filled_.assign(static_cast<std::size_t>(nx_ * ny_ * nz_), 0);
    for (int y = 0; y < ny_; ++y) {
      for (int x = 0; x < nx_; ++x) {
        std::vector<double>& at = crossings[static_cast<std::size_t>(y * nx_ + x)];
        std::sort(at.begin(), at.end());
        for (std::size_t i = 0; i + 1 < at.size(); i += 2) fill(x, y, at[i], at[i + 1]);
      }
    }
  }

  int nx() const { return nx_; }
  int ny() const { return ny_; }
  int nz() const { return nz_; }
  bool filled(int x, int y, int z) const { return filled_[index(x, y, z)] != 0; }
  Eigen::Vector3d middle(int x, int y, int z) const {
    return box_.min() + edge_ * Eigen::Vector3d(x - 0.5, y - 0.5, z + 0.5);
  }

 private:
  std::size_t index(int x, int y, int z) const {
    return static_cast<std::size_t>((z * ny_ + y) * nx_ + x);
  }

  /// Heights at which the triangle crosses the middle lines of the columns.
  void cross(const Triangle& t, std::vector<std::vector<double>>& crossings) const {
    const Eigen::Vector2d u = (t[1] - t[0]).head<2>(), v = (t[2] - t[0]).head<2>();
    const double det = u.x() * v.y() - u.y() * v.x();
    if (std::abs(det) < 1e-12) return;
    const auto column = [&](double value, int axis) { return (value - box_.min()[axis]) / edge_; };
    double low[2], high[2];
    for (int axis = 0; axis < 2; ++axis) {
      low[axis] = column(std::min({t[0][axis], t[1][axis], t[2][axis]}), axis);
      high[axis] = column(std::max({t[0][axis], t[1][axis], t[2][axis]}), axis);
    }
    for (int y = static_cast<int>(low[1]); y <= std::min(ny_ - 1, static_cast<int>(high[1]) + 1);
         ++y) {
      for (int x = static_cast<int>(low[0]); x <= std::min(nx_ - 1, static_cast<int>(high[0]) + 1);
           ++x) {
        // A little off the middle, so that no line runs along an edge of a part drawn in tenths.
        const Eigen::Vector2d w =
            middle(x, y, 0).head<2>() + Eigen::Vector2d(1.7e-5, 2.9e-5) - t[0].head<2>();
        const double a = (w.x() * v.y() - w.y() * v.x()) / det;
        const double b = (u.x() * w.y() - u.y() * w.x()) / det;
        if (a < 0 || b < 0 || a + b > 1) continue;
        crossings[static_cast<std::size_t>(y * nx_ + x)].push_back(
            t[0].z() + a * (t[1] - t[0]).z() + b * (t[2] - t[0]).z());
      }
    }
  }

  /// A layer has what is there at its middle, as a slicer takes it.
  void fill(int x, int y, double from, double to) {
    const auto layer = [&](double z) {
      return static_cast<int>(std::ceil((z - box_.min().z()) / edge_ - 0.5 - 1e-6));
    };
    for (int z = std::max(0, layer(from)); z < std::min(nz_, layer(to)); ++z)
      filled_[index(x, y, z)] = 1;
  }

  double edge_;
  Eigen::AlignedBox3d box_;
  int nx_ = 0, ny_ = 0, nz_ = 0;
  std::vector<std::uint8_t> filled_;
};

class LayerCheck {
 public:
  LayerCheck(const Voxels& voxels, double edge, double longest_bridge)
      : voxels_(voxels), edge_(edge), bridge_(longest_bridge) {}

  /// Cubes of this layer that hang in the air, as patches; the largest.
  Overhang worst(int z) {
    const int nx = voxels_.nx(), ny = voxels_.ny();
    hangs_.assign(static_cast<std::size_t>(nx * ny), false);
    for (int y = 1; y + 1 < ny; ++y) {
      for (int x = 1; x + 1 < nx; ++x)
        hangs_[at(x, y)] = voxels_.filled(x, y, z) && !carried(x, y, z) && !bridged(x, y, z);
    }
    Overhang out;
    for (int y = 1; y + 1 < ny; ++y) {
      for (int x = 1; x + 1 < nx; ++x) {
        const double area = edge_ * edge_ * take_patch(x, y);
        if (area > out.area) out = {area, voxels_.middle(x, y, z)};
      }
    }
    return out;
  }

 private:
  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * voxels_.nx() + x); }

  bool carried(int x, int y, int z) const {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx)
        if (voxels_.filled(x + dx, y + dy, z - 1)) return true;
    }
    return false;
  }

  bool bridged(int x, int y, int z) const {
    constexpr int kWays[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
    return std::any_of(std::begin(kWays), std::end(kWays), [&](const int(&way)[2]) {
      const std::optional<int> there = to_hold(x, y, z, way[0], way[1]);
      const std::optional<int> back = to_hold(x, y, z, -way[0], -way[1]);
      return there && back && edge_ * (*there + *back) * std::hypot(way[0], way[1]) <= bridge_;
    });
  }

  /// Cubes until the line rests on something; none where it ends in the air.
  std::optional<int> to_hold(int x, int y, int z, int dx, int dy) const {
    for (int n = 0; voxels_.filled(x, y, z); ++n, x += dx, y += dy)
      if (carried(x, y, z)) return n;
    return std::nullopt;
  }

  int take_patch(int x, int y) {
    int size = 0;
    std::vector<std::pair<int, int>> open{{x, y}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (!hangs_[at(i, j)]) continue;
      hangs_[at(i, j)] = false;
      ++size;
      for (const auto& [di, dj] :
           {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)})
        open.emplace_back(i + di, j + dj);
    }
    return size;
  }

  const Voxels& voxels_;
  double edge_, bridge_;
  std::vector<bool> hangs_;
};

}  // namespace

Overhang worst_overhang(const Mesh& printed, double layer, double longest_bridge) {
  const Voxels voxels(printed, layer);
  LayerCheck check(voxels, layer, longest_bridge);
  Overhang out;
  for (int z = 1; z < voxels.nz(); ++z) {
    const Overhang here = check.worst(z);
    if (here.area > out.area) out = here;
  }
  return out;
}

}  // namespace tagwrench::test

// Printed parts as triangles: read, moved, measured. Knows nothing of how they were drawn, so that
// what it measures is what the printer gets. Lengths in mm, as in STL files.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <optional>
#include <vector>

namespace tagwrench::test {

using Triangle = std::array<Eigen::Vector3d, 3>;
using Mesh = std::vector<Triangle>;

/// A binary STL. Throws std::runtime_error for anything else.
Mesh read_stl(const std::filesystem::path& path);

Mesh moved(const Eigen::Isometry3d& to_T_from, const Mesh& mesh);

Eigen::AlignedBox3d box(const Mesh& mesh);

/// Of a closed mesh of uniform density.
struct Solid {
  double volume = 0;                                        ///< mm^3
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();         ///< mm
  Eigen::Matrix3d second_moment = Eigen::Matrix3d::Zero();  ///< of volume, about the origin, mm^5
};
Solid solid(const Mesh& mesh);

struct Hit {
  double distance = 0;  ///< mm along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

/// Triangles sorted into a tree of boxes, for rays and for other meshes.
class MeshTree {
 public:
  explicit MeshTree(Mesh mesh);

  /// Where a ray from `from` along the unit vector `along` meets the surface first, before `most`.
  std::optional<Hit> first_hit(const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                               double most = 1e9) const;

  /// By how often a ray leaves; the mesh must be closed.
  bool contains(const Eigen::Vector3d& point) const;

  /// A point where the surfaces cross, if they do. Faces that only touch do not cross.
  std::optional<Eigen::Vector3d> crossing(const Mesh& other) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t begin = 0, end = 0;   ///< triangles of a leaf
    std::size_t left = 0, right = 0;  ///< nodes; both zero: a leaf
  };
  std::size_t build(std::size_t begin, std::size_t end);
  template <typename Reach, typename Leaf>
  void walk(const Reach& reaches, const Leaf& leaf) const;

  Mesh mesh_;
  std::vector<Node> nodes_;
};

/// The largest patch that a printer without supports would lay into the air, of a part as it lies
/// on the bed: not on the layer below, not within its width of it (45 degrees), and no bridge: no
/// straight line in the layer, of `longest_bridge` at most, ends on something at both ends.
struct Overhang {
  double area = 0;  ///< mm^2
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};
Overhang worst_overhang(const Mesh& printed, double layer, double longest_bridge);

}  // namespace tagwrench::test

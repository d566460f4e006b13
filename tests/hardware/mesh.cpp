#include "tests/hardware/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace tagwrench::test {
namespace {

constexpr std::size_t kLeaf = 4;
constexpr double kTouch = 1e-6;  // shares of an edge; STL files have 7 digits

/// Möller & Trumbore, Fast, Minimum Storage Ray/Triangle Intersection (1997); the distance. What
/// passes nearer than `rim`, a share of the triangle, to its edges does not meet it.
std::optional<double> meet(const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                           const Triangle& t, double rim = 0) {
  const Eigen::Vector3d u = t[1] - t[0], v = t[2] - t[0];
  const Eigen::Vector3d p = along.cross(v);
  const double det = u.dot(p);
  if (std::abs(det) < 1e-12) return std::nullopt;
  const Eigen::Vector3d w = from - t[0];
  const double a = w.dot(p) / det;
  const Eigen::Vector3d q = w.cross(u);
  const double b = along.dot(q) / det;
  if (a < rim || b < rim || a + b > 1 - rim) return std::nullopt;
  return v.dot(q) / det;
}

/// Slabs: does the ray meet the box between 0 and `most`?
bool reaches(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
             const Eigen::Vector3d& along, double most) {
  double begin = 0, end = most;
  for (int i = 0; i < 3; ++i) {
    const double a = (box.min()[i] - from[i]) / along[i], b = (box.max()[i] - from[i]) / along[i];
    if (std::isnan(a) || std::isnan(b)) continue;  // in the plane of a face
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin <= end;
}

Eigen::AlignedBox3d box_of(const Triangle& t) {
  Eigen::AlignedBox3d out(t[0]);
  return out.extend(t[1]).extend(t[2]);
}

}  // namespace

Mesh read_stl(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  constexpr std::size_t kHeader = 84, kFacet = 50;
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, sizeof count);
  if (bytes.size() < kHeader || bytes.size() != kHeader + kFacet * count)
    throw std::runtime_error(path.string() + ": not a binary STL");
  Mesh out(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 12> facet;  // normal, then three corners
    std::memcpy(facet.data(), bytes.data() + kHeader + kFacet * i, sizeof facet);
    for (std::size_t corner = 0; corner < 3; ++corner)
      out[i][corner] = Eigen::Map<Eigen::Vector3f>(&facet[3 + 3 * corner]).cast<double>();
  }
  return out;
}

Mesh moved(const Eigen::Isometry3d& to_T_from, const Mesh& mesh) {
  Mesh out(mesh);
  for (Triangle& triangle : out) {
    for (Eigen::Vector3d& corner : triangle) corner = to_T_from * corner;
  }
  return out;
}

Eigen::AlignedBox3d box(const Mesh& mesh) {
  Eigen::AlignedBox3d out;
  for (const Triangle& triangle : mesh) out.extend(box_of(triangle));
  return out;
}

Solid solid(const Mesh& mesh) {
  // Sum over tetrahedra from the origin to each triangle.
  Solid out;
  for (const Triangle& t : mesh) {
    const double six = t[0].dot(t[1].cross(t[2]));
    out.volume += six / 6;
    out.centre += six / 24 * (t[0] + t[1] + t[2]);
    const Eigen::Vector3d sum = t[0] + t[1] + t[2];
    Eigen::Matrix3d squares = sum * sum.transpose();
    for (const Eigen::Vector3d& corner : t) squares += corner * corner.transpose();
    out.second_moment += six / 120 * squares;
  }
  out.centre /= out.volume;
  return out;
}

MeshTree::MeshTree(Mesh mesh) : mesh_(std::move(mesh)) {
  if (!mesh_.empty()) build(0, mesh_.size());
}

std::size_t MeshTree::build(std::size_t begin, std::size_t end) {
  const std::size_t at = nodes_.size();
  nodes_.push_back({.box = {}, .begin = begin, .end = end});
  for (std::size_t i = begin; i < end; ++i) nodes_[at].box.extend(box_of(mesh_[i]));
  if (end - begin <= kLeaf) return at;
  int axis = 0;
  nodes_[at].box.sizes().maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto nth = [&](std::size_t n) { return mesh_.begin() + static_cast<std::ptrdiff_t>(n); };
  std::nth_element(nth(begin), nth(middle), nth(end), [&](const Triangle& a, const Triangle& b) {
    return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
  });
  const std::size_t left = build(begin, middle), right = build(middle, end);
  nodes_[at].left = left;
  nodes_[at].right = right;
  return at;
}

template <typename Reach, typename Leaf>
void MeshTree::walk(const Reach& reaches, const Leaf& leaf) const {
  std::vector<std::size_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!reaches(node.box)) continue;
    if (node.right != 0) {
      open.push_back(node.left);
      open.push_back(node.right);
      continue;
    }
    for (std::size_t i = node.begin; i < node.end; ++i) leaf(mesh_[i]);
  }
}

std::optional<Hit> MeshTree::first_hit(const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                                       double most) const {
  std::optional<Hit> out;
  walk([&](const Eigen::AlignedBox3d& b) { return reaches(b, from, along, most); },
       [&](const Triangle& t) {
         const std::optional<double> distance = meet(from, along, t);
         if (!distance || *distance < 0 || *distance > most) return;
         most = *distance;
         out = Hit{most, (t[1] - t[0]).cross(t[2] - t[0]).normalized()};
       });
  return out;
}

bool MeshTree::contains(const Eigen::Vector3d& point) const {
  // Askew, so that it meets no edge of parts that are drawn along the axes.
  const Eigen::Vector3d along = Eigen::Vector3d(0.1234, 0.2717, 0.9513).normalized();
  int leaves = 0;
  walk([&](const Eigen::AlignedBox3d& b) { return reaches(b, point, along, 1e9); },
       [&](const Triangle& t) {
         const std::optional<double> distance = meet(point, along, t);
         if (distance && *distance > 0) ++leaves;
       });
  return leaves % 2 == 1;
}

std::optional<Eigen::Vector3d> MeshTree::crossing(const Mesh& other) const {
  std::optional<Eigen::Vector3d> out;
  // Two triangles cross where an edge of one goes through the other.
  const auto pierced = [&](const Triangle& by, const Triangle& through) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d edge = by[(i + 1) % 3] - by[i];
      const std::optional<double> share = meet(by[i], edge, through, kTouch);
      if (share && *share > kTouch && *share < 1 - kTouch) out = by[i] + *share * edge;
    }
  };
  for (const Triangle& triangle : other) {
    const Eigen::AlignedBox3d around = box_of(triangle);
    walk([&](const Eigen::AlignedBox3d& b) { return !out && b.intersects(around); },
         [&](const Triangle& mine) {
           pierced(mine, triangle);
           pierced(triangle, mine);
         });
    if (out) break;
  }
  return out;
}

}  // namespace tagwrench::test

#include "host/source/simulator/print_fault.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "host/source/simulator/random.h"

namespace tagwrench::sim {
namespace {

Eigen::Matrix2d stretched(double size, double aspect, double shear) {
  Eigen::Matrix2d stretch;
  stretch << 1 + size + aspect, shear, shear, 1 + size - aspect;
  return stretch;
}

}  // namespace

Eigen::Vector2d PrintFault::drawn(const Eigen::Vector2d& seen) const {
  const double along = bend.dot(seen) / half_size;
  const double height = curl * (1 - along * along);
  return stretch.inverse() * (seen - height * sight);
}

PrintFault print_fault(const Target& target, std::size_t tag, std::uint64_t seed,
                       const RigidPose& camera_T_tag) {
  PrintFault fault;
  fault.half_size = 0.5 * target.tag_size;
  const Eigen::Vector3d sight = camera_T_tag.rotation.transpose() * camera_T_tag.position;
  fault.sight = sight.head<2>() / sight.z();

  // A sheet has half of it in common.
  Random sheet(seed, kPrintFault);
  Random own = Random::numbered(seed, kPrintFault, tag + 1);
  const auto drawn = [&] {
    const double half = 0.5 * target.print_error;
    return sheet.uniform(-half, half) + own.uniform(-half, half);
  };
  const double size = target.print_size + drawn();
  const double aspect = target.print_aspect + drawn();
  const double shear = target.print_shear + drawn();
  fault.stretch = stretched(size, aspect, shear);
  const double most = target.print_error * fault.half_size;
  fault.growth = {target.ink_growth_x + own.uniform(0, most),
                  target.ink_growth_y + own.uniform(0, most)};
  fault.curl = target.paper_curl + own.uniform(-most, most);
  const double direction =
      target.paper_curl_direction + (most > 0 ? own.uniform(0, std::numbers::pi) : 0);
  fault.bend = {std::cos(direction), std::sin(direction)};
  return fault;
}

}  // namespace tagwrench::sim

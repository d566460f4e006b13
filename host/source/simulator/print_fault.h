// How a whole tag's print lies off its pattern: what printer, paper and glue do alike to all of it.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

struct PrintFault {
  Eigen::Matrix2d stretch = Eigen::Matrix2d::Identity();  ///< from drawn to printed places
  Eigen::Vector2d growth = Eigen::Vector2d::Zero();       ///< of black along x and y, each side, m
  /// The paper bends as a cylinder: its middle stands off the plane of its edges, toward the
  /// viewer, by so much (m); `bend` is the direction along which it is bent, a unit vector in the
  /// tag's plane.
  double curl = 0;
  Eigen::Vector2d bend = Eigen::Vector2d::UnitX();
  double half_size = 1;  ///< m, where the edges are
  /// By how much (m per m of height) what stands off the plane is seen beside its place, from the
  /// lens at rest. Elsewhere it would be seen elsewhere, by a part of the curl: left out.
  Eigen::Vector2d sight = Eigen::Vector2d::Zero();

  /// Where in the drawing the thing is that is seen at this place of the tag's plane, m.
  Eigen::Vector2d drawn(const Eigen::Vector2d& seen) const;
};

/// Of the tag at this position in target.tags, from the target's keys and the seed.
PrintFault print_fault(const Target& target, std::size_t tag, std::uint64_t seed,
                       const RigidPose& camera_T_tag);

}  // namespace tagwrench::sim

#include "host/source/simulator/target_geometry.h"

#include "host/source/simulator/random.h"

namespace tagwrench::sim {

std::vector<PlacedTag> placed_tags(const Scenario& scenario) {
  const Target& target = scenario.target;
  Random random(scenario.seed, kPlacement);
  const auto error = [&random](double largest) {
    const double x = random.uniform(-largest, largest);
    const double y = random.uniform(-largest, largest);
    return Eigen::Vector3d(x, y, random.uniform(-largest, largest));
  };
  std::vector<PlacedTag> tags;
  Eigen::Vector3d midpoint = Eigen::Vector3d::Zero();
  for (const TagPlacement& nominal : target.tags) {
    PlacedTag tag{nominal.id, {}};
    tag.platform_T_tag.position = nominal.position + error(target.position_error);
    tag.platform_T_tag.rotation =
        rotation_matrix(error(target.rotation_error)) * rotation_matrix(nominal.rotation);
    midpoint += tag.platform_T_tag.position / static_cast<double>(target.tags.size());
    tags.push_back(tag);
  }
  for (PlacedTag& tag : tags) tag.platform_T_tag.position -= midpoint;
  return tags;
}

RigidPose platform_pose(const Target& target,
                        const Eigen::Matrix<double, 6, 1>& displacement) noexcept {
  return {rotation_matrix(displacement.tail<3>()), target.rest_position + displacement.head<3>()};
}

}  // namespace tagwrench::sim

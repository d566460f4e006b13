#include <Eigen/Geometry>
#include <array>

#include "host/wrench/fit.h"

namespace tagwrench {
namespace {

Vector6 wrench_at(const Eigen::Vector3d& point, const Eigen::Vector3d& force) {
  Vector6 w;
  w << force, point.cross(force);
  return w;
}

}  // namespace

void set_line_load(const LineLoad& load, Observation& observation) {
  const Eigen::Vector3d force = load.force * load.direction;
  const Eigen::Vector3d across = load.direction.unitOrthogonal();
  const Eigen::Vector3d other = load.direction.cross(across);
  observation.wrench = wrench_at(load.point, force);
  observation.wrench_covariance.setZero();
  observation.common.clear();
  observation.products.clear();
  const auto alone = [&](double sigma, const Vector6& unit) {
    observation.wrench_covariance += sigma * sigma * unit * unit.transpose();
  };
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  const auto shared = [&](double sigma, const std::string& name, const Vector6& unit) {
    if (!(sigma > 0)) return kNone;
    observation.common.push_back({name, sigma * unit});
    return observation.common.size() - 1;
  };
  const auto product = [&](std::size_t a, std::size_t b, const Vector6& effect) {
    if (a != kNone && b != kNone) observation.products.push_back({a, b, effect});
  };
  const auto torque = [](const Eigen::Vector3d& arm, const Eigen::Vector3d& pull) {
    Vector6 w = Vector6::Zero();
    w.tail<3>() = arm.cross(pull);
    return w;
  };

  const Vector6 along = wrench_at(load.point, load.direction);
  const double stronger = load.force_sigma * load.force;
  const std::size_t gain = shared(stronger, load.force_name, along);
  alone(load.force_noise, along);

  const double aside = load.direction_sigma * load.force;
  const std::array<Eigen::Vector3d, 2> ways{across, other};
  std::array<std::size_t, 2> tilt{};
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector6 unit = wrench_at(load.point, ways[i]);
    tilt[i] = shared(aside, load.direction_name + (i == 0 ? ", one way" : ", the other way"), unit);
    alone(load.direction_noise * load.force, unit);
    product(tilt[i], gain, load.force_sigma * aside * unit);
    product(tilt[i], tilt[i], -0.5 * load.direction_sigma * aside * along);
  }

  // Along the line the point may lie anywhere.
  for (std::size_t i = 0; i < 2; ++i) {
    shared(load.contact_sigma, load.contact_name + (i == 0 ? ", one way" : ", the other way"),
           torque(ways[i], force));
  }

  constexpr std::array<const char*, 3> kAxis{", x", ", y", ", z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(k));
    const double off = load.point_sigma;
    const std::size_t moved = shared(off, load.point_name + kAxis[k], torque(axis, force));
    alone(load.point_noise, torque(axis, force));
    product(moved, gain, off * stronger * torque(axis, load.direction));
    for (std::size_t i = 0; i < 2; ++i)
      product(moved, tilt[i], off * aside * torque(axis, ways[i]));
  }
}

}  // namespace tagwrench

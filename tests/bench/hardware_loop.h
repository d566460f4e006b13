// A simulated sensor held still at some displacements, through the tracker.
#pragma once

#include <optional>
#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::bench {

struct HeldReading {
  Vector6 displacement = Vector6::Zero();  ///< m, rad, about the platform's origin
  Matrix6 covariance = Matrix6::Zero();    ///< as the tracker claims
};

/// Of one fixed displacement, picture by picture; empty: no numbers.
using HeldReadings = std::vector<std::optional<HeldReading>>;

/// The tracker knows what sensor.yaml would say, and learns rest and the tags' places from the
/// first 25 pictures.
std::vector<HeldReadings> held_readings(const sim::Scenario& scenario,
                                        const std::vector<Vector6>& displacements, int frames_each);

/// A sensor with a flat tag and one seen in a mirror, as two simulated sensors of one tag each, on
/// the same pictures' noise: the simulator renders no mirror, but a mirror's picture is that of a
/// reflected tag, and flipped left to right that is a tag again, which moves rigidly. Neither
/// tracker knows of the other; their displacements are brought together by least squares.
class MirrorPair {
 public:
  /// `scenario` has both tags where they really are, the second one seen in the mirror; the mirror:
  /// normal . p = distance, camera frame.
  MirrorPair(const sim::Scenario& scenario, const Eigen::Vector3d& normal, double distance);

  std::vector<HeldReadings> held_readings(const std::vector<Vector6>& displacements,
                                          int frames_each) const;
  /// Cramer-Rao, of the pictures at rest, m^2, m rad, rad^2.
  Matrix6 bound() const;

 private:
  /// One tag, its picture flipped or not.
  struct Half {
    sim::Scenario scenario;
    Eigen::Matrix3d turn;   ///< from camera axes to those of its own world
    Eigen::Vector3d lever;  ///< of the tag from the platform's origin, camera axes, m

    Vector6 seen(const Vector6& displacement) const;
    Matrix6 derivative() const;  ///< of seen(), at rest
  };
  static HeldReading together(const Half& a, const HeldReading& by_a, const Half& b,
                              const HeldReading& by_b);

  Half flat_, reflected_;
};

}  // namespace tagwrench::bench

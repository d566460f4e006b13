// Room tools/design: sensors that are not built yet.
// In:  camera (px, mm), tags, springs (N/mm), gaps; a file of hardware/sensors.
// Out: resolution, range (N, N m), bandwidth (Hz), whether it can be built; what the parts, the tag
//      sheet, sensor.yaml and the simulator take from it. SI inside, mm in files.
// Then: parameters.h, geometry.h.
//
// The instrument on paper: what a choice of camera, lens, tags and springs can measure, before
// anything is built.
//
// Two estimates side by side. The published one counts pixels (Ouyang & Howe, "Low-Cost Fiducial-
// based 6-Axis Force-Torque Sensor", ICRA 2020, sections III-A to III-D). The other is the
// Cramer-Rao bound of an estimate that uses every pixel of every edge of the tags.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench::study {

/// What the published estimate takes. Its "image" is the rectangle around both tags.
struct CountedPixels {
  double frame_width_px = 640, frame_height_px = 480;
  double image_width_px = 150, image_height_px = 240;
  double tag_px = 150;              ///< width of a tag with its border
  double tag_with_border = 4.5e-3;  ///< the same, m
  double lens_distance = 21e-3;     ///< m
  double counts_per_px = 4;

  double travel_x_px() const { return frame_width_px - image_width_px; }
  double travel_y_px() const { return frame_height_px - image_height_px; }
  double m_per_px() const { return tag_with_border / tag_px; }
};

struct CountedSteps {
  int bits_x = 0, bits_y = 0, bits_z = 0;
  double step_xy = 0;   ///< m
  double step_z = 0;    ///< m
  double chord_px = 0;  ///< that a tag's corner goes when the tag turns by 45 degrees about z
  double step_rz = 0;   ///< rad
  double foreshortening_px = 0;  ///< of half a tag that tilts by 45 degrees
  double step_rxy = 0;           ///< rad
};

/// Bits, m and rad by the published equations. `counts_per_px`, sizes and travel must be positive.
CountedSteps counted_steps(const CountedPixels& design);

/// Least force that is told apart, N: the range from -range to +range (N) shared among the counts
/// of the travel.
double counted_force(double range, double travel_px, double counts_per_px);

/// A mirror that stands still: the points p with normal . p = distance, camera frame.
struct MirrorPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of unit length
  double distance = 0;                                ///< m

  /// Where a point seems to be.
  Eigen::Vector3d behind(const Eigen::Vector3d& p) const {
    return p - 2 * (normal.dot(p) - distance) * normal;
  }
  /// Householder: what seems to become of a small motion.
  Eigen::Matrix3d reflection() const {
    return Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose();
  }
};

/// A tag where it sits at rest, seen by the camera.
struct SeenTag {
  Eigen::Isometry3d camera_T_tag = Eigen::Isometry3d::Identity();  ///< x right, y down, z into the
                                                                   ///< paper
  double size = 0;                                                 ///< edge of the black square, m
  double border = 0;                                               ///< white around it, m
  int cells = 0;                        ///< along one side of the black square
  std::vector<std::uint8_t> white;      ///< cells x cells, row by row from the top left
  std::optional<MirrorPlane> mirror{};  ///< in which alone the camera sees it

  /// Where a point of the camera frame is for the camera.
  Eigen::Vector3d seen(const Eigen::Vector3d& p) const { return mirror ? mirror->behind(p) : p; }
};

/// A pinhole, and what is between an ideal picture and the one delivered.
struct SeenPicture {
  double width_px = 640, height_px = 480;
  double fx_px = 700, fy_px = 700, cx_px = 319.5, cy_px = 239.5;
  double blur_px = 1.5;          ///< standard deviation of the Gaussian point spread
  double noise_counts = 2;       ///< standard deviation of a pixel, grey levels
  double contrast_counts = 170;  ///< from ink to paper, grey levels
};

/// Least covariance of an unbiased estimate of the displacement from one picture, m^2, m rad,
/// rad^2, about `origin` (camera frame, m).
///
/// An edge of contrast C blurred by a Gaussian of standard deviation s holds the information
/// C^2 / (2 sqrt(pi) s noise^2) about its place, per pixel of its length. Summed over the edges
/// between ink and paper with the perspective derivative of each; gain and offset of each tag are
/// unknowns beside the six. Left out: the papers' outer edges, grain, and that edges nearer to each
/// other than a few s share their information.
/// A mirror stands still while the tag moves: its picture moves as the tag's reflection does.
/// Not finite where the tags do not determine all six.
Matrix6 displacement_bound(const std::vector<SeenTag>& tags, const Eigen::Vector3d& origin,
                           const SeenPicture& picture);

struct Spring {
  Eigen::Vector3d top =
      Eigen::Vector3d::Zero();      ///< where it meets the platform, platform frame, m
  double free_length = 25.4e-3;     ///< m
  double outer_diameter = 4.75e-3;  ///< m
  double wire = 0.71e-3;            ///< diameter, m
  double coils = 0;   ///< in all; 0: not known, as many as give the rate, and two for the ends
  double rate = 700;  ///< axial, N/m

  double mean_diameter() const { return outer_diameter - wire; }
};

/// With its coils closed upon each other, m.
double solid_length(const Spring& spring);

/// Coils that give a steel spring its rate: G d^4 / (8 D^3 k) with the mean diameter D and G = 79
/// GPa (Wahl, Mechanical Springs, ch. 5).
double active_coils(const Spring& spring);

struct Platform {
  double mass = 0.010;                                      ///< kg
  Eigen::Vector3d centre_of_mass{0, 0, 4e-3};               ///< platform frame, m
  Eigen::Vector3d principal_inertia{1.0e-6, 1.3e-6, 2e-6};  ///< about it, kg m^2
};

/// Hz, rising, of the six modes on springs of this stiffness (6 x 6 about the platform origin).
std::array<double, 6> natural_frequencies(const Matrix6& stiffness, const Platform& platform);

/// Where a periodic motion of `frequency` seems to be in pictures taken at `rate`, Hz.
double alias(double frequency, double rate);

struct Instrument {
  CountedPixels counted;
  double frame_rate = 25;  ///< Hz
  std::vector<SeenTag> tags;
  Eigen::Vector3d origin{0, 0, 21e-3};  ///< of the platform at rest, camera frame, m
  SeenPicture picture;
  std::vector<Spring> springs;
  Matrix6 stiffness = Matrix6::Zero();  ///< about the origin
  Platform platform;
  double range = 1;  ///< +-, N, along each axis
};

/// What stops the platform first under a growing force, +- along one axis.
struct Reach {
  double in_view = 0;              ///< N, until a paper's corner leaves the image
  std::optional<double> to_solid;  ///< N, until a spring's coils touch; empty: the springs' numbers
                                   ///< do not go together

  double least() const { return to_solid ? std::min(in_view, *to_solid) : in_view; }
};

/// N. A design that stands more is said to stand more than this.
inline constexpr double kMaxForce = 1000;

/// Along camera x, y, z at the platform's origin. Up to `most` (N). Small angles.
std::array<Reach, 3> reach(const Instrument& instrument, double most);

/// One stiffness of springs: that of the instrument, all of it scaled.
struct DesignRow {
  double range = 0;                             ///< +-, N
  double scale = 0;                             ///< of the instrument's stiffness
  double lateral = 0, axial = 0;                ///< of all springs together, N/m
  double travel_lateral = 0, travel_axial = 0;  ///< of the origin under the range, m
  double counted_x = 0, counted_y = 0;          ///< N
  Vector6 bound = Vector6::Zero();  ///< standard deviation of one picture's wrench, N, N m
  double lowest = 0, highest = 0;   ///< natural frequency, Hz
};

struct Design {
  CountedSteps counted;
  Vector6 bound = Vector6::Zero();  ///< standard deviation of one picture, m, rad
  std::array<double, 6> modes{};    ///< Hz
  std::array<Reach, 3> reach;
  std::vector<DesignRow> rows;  ///< the instrument's own springs first, then one for each range
  std::vector<std::string> warnings;
};

/// Everything above. The rows after the first have springs that just keep the papers in view and
/// their coils apart under +-ranges[i] (N); there are none, and a warning, where no force ends
/// either.
Design design(const Instrument& instrument, const std::vector<double>& ranges);

}  // namespace tagwrench::study

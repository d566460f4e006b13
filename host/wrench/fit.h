// Known loads and the displacements that they made -> a calibrated wrench model, with what is not
// known of it.
//
// Model: wrench = M phi(d) + b, phi the features (estimate.h; d itself by default), b the offset of
// the observation's `zero`. Errors in both d and the wrench are weighed by the effective variance
// S = S_w + K S_d K^T + S_model (Orear, Am. J. Phys. 50, 912, 1982), with the adjusted displacement
// in the design matrix, without which noise in d would flatten K (Britt and Luecke, Technometrics
// 15, 233, 1973). What many observations have wrong alike is an unknown of its own with a prior, so
// that it does not average away (equal to generalised least squares with the full covariance).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/wrench/estimate.h"

namespace tagwrench {

/// An error that observations share: a mass's, the direction of gravity in a mounting, a point's
/// place. If it is off by one standard deviation, the true wrench is wrench + effect.
struct CorrelatedError {
  std::string name;  ///< the same name: the same error. For people: "mass 50 g", "point left, x"
  Vector6 effect = Vector6::Zero();  ///< N, N m
};

/// What two of them do together, or one with itself, beyond the sum of both: a force that is tilted
/// at a point that lies elsewhere. If each is off by one standard deviation, the true wrench is
/// further off by `effect`.
struct CorrelatedProduct {
  std::size_t first = 0, second = 0;  ///< indices into Observation::common
  Vector6 effect = Vector6::Zero();   ///< N, N m
};

/// One known load and what the tracker saw under it.
struct Observation {
  double time = 0;                                    ///< s
  Vector6 displacement = Vector6::Zero();             ///< m, rad
  Matrix6 displacement_covariance = Matrix6::Zero();  ///< of the mean over a hold, or of a frame
  Vector6 wrench = Vector6::Zero();                   ///< N, N m, about the platform origin
  Matrix6 wrench_covariance = Matrix6::Zero();        ///< of what is this observation's alone
  std::vector<CorrelatedError> common;                ///< of what it shares with others
  std::vector<CorrelatedProduct> products;            ///< optional; without them, guessed at
  int step = 0;  ///< of the plan; what belongs to one step is held out, or rejected, together
  int zero = 0;  ///< observations with the same number count from the same, unknown, offset
};

/// A force along a line, known as well as it is: a hung mass, a push through a load cell.
struct LineLoad {
  double force = 0;           ///< N
  Eigen::Vector3d direction;  ///< unit, of the force on the platform, camera axes
  Eigen::Vector3d point;      ///< of application, platform frame, m

  double force_sigma = 0;      ///< relative, shared by all loads with the same force_name: the
                               ///< mass, the load cell's gain
  double direction_sigma = 0;  ///< rad, shared by the same direction_name: a mounting; a stroke
  double point_sigma = 0;      ///< m, shared by the same point_name
  std::string force_name, direction_name, point_name;

  double force_noise = 0;      ///< N, of this observation alone
  double direction_noise = 0;  ///< rad, of this observation alone
  double contact_sigma = 0;    ///< m, each way across the line; shared by one push, as its line
  std::string contact_name = {};
  double point_noise = 0;  ///< m, of this observation alone
};

/// Sets wrench, wrench_covariance, common and products: F = force * direction, M = point x F.
void set_line_load(const LineLoad& load, Observation& observation);

/// Where the platform was at a time.
struct PathPoint {
  double time = 0;  ///< s, grows
  Vector6 displacement = Vector6::Zero();
};

struct FitOptions {
  std::optional<Matrix6> prior = {};  ///< stiffness of the spring model
  double prior_width = 0.3;           ///< of each entry, relative to the geometric mean of the
                                      ///< stiffnesses of its two axes
  /// Springs are conservative, so that K = K^T about any point (Maxwell, Phil. Mag. 27, 294, 1864;
  /// Betti, 1872); the tracker's errors of scale and axes, some 0.1 % each, break it a little. One
  /// standard deviation of K_ij - K_ji, relative as prior_width; 0: not assumed. It lets a push
  /// along a soft axis tell what one along a stiff axis, half a degree off its line, cannot.
  double reciprocity = 0.005;
  bool require_all = false;  ///< refuse unless every axis is calibrated
  bool try_richer = true;    ///< quadratic; creep and hysteresis too where there is a path
  std::optional<int> zero_in_use = {};  ///< the Observation::zero whose offset becomes the model's
                                        ///< B; default: the first observation's
};

enum class AxisState : std::uint8_t {
  calibrated,
  spring_model,    ///< the data do not reach it; as good as the springs' description
  not_determined,  ///< neither data nor springs say anything
};

constexpr std::array<const char*, 3> kAxisStateNames{"calibrated", "from the spring model",
                                                     "not determined"};
constexpr const char* name(AxisState state) {
  return kAxisStateNames[static_cast<std::size_t>(state)];
}

struct AxisFit {
  AxisState state = AxisState::not_determined;
  std::string reason;     ///< why it is not calibrated: "no torque about z was applied"
  double coverage = 0;    ///< 0: known no better than before; 1: known perfectly. 1 - standard
                          ///< deviation after over before, of the answer to a load along this axis
  double gain_sigma = 0;  ///< relative, of the answer to a load along this axis
  double largest = 0;     ///< load applied, N or N m
  double held_out_rmse = 0;       ///< N, N m, each step predicted without it
  double held_out_r2 = 0;         ///< 0 where the load did not vary
  double error_constant = 0;      ///< of the model: what noise does not explain, N, N m
  double error_proportional = 0;  ///< N, N m at full load
};

/// A step, or a fifth of a long one: held out, or rejected, as a whole.
struct BlockFit {
  int step = 0;
  double from = 0, to = 0;  ///< s
  int observations = 0;
  bool rejected = false;
  double deviation = 0;     ///< of the held-out residual in standard deviations: sqrt(chi^2 / 6)
  double load_ratio = 0;    ///< load that it shows over load that it should; 0 if at rest
  std::string remark = {};  ///< of rejected ones: "step 7: 12 % less than the others say: ..."
};

/// A kind of model that was tried.
struct ModelTrial {
  FeatureSpec features;
  double score = 0;        ///< held-out squared residual over the linear model's; below 1 is better
  double score_sigma = 0;  ///< standard error of the difference to 1
  bool adopted = false;
};

/// An observation predicted without its block.
struct HeldOut {
  std::size_t observation = 0;
  Vector6 predicted = Vector6::Zero();
  Vector6 sigma = Vector6::Zero();  ///< of predicted - observed: all that the fit knows of
};

/// What became of an error that observations share.
struct CorrelatedEstimate {
  std::string name;
  double value = 0;  ///< in its prior standard deviations
  double sigma = 0;  ///< 1: the data say nothing about it
};

struct WrenchFit {
  WrenchModel model;
  std::array<AxisFit, 6> axis;
  std::vector<std::string> missing;  ///< combinations that no load reached: "Mz", "Fx with My"
  std::vector<BlockFit> blocks;
  std::vector<ModelTrial> trials;
  std::vector<HeldOut> held_out;  ///< of blocks that were not rejected
  std::vector<CorrelatedEstimate> common;
  std::array<double, 6> inside_95{};  ///< share of held-out residuals within 1.96 sigma, by axis
  std::vector<std::string> warnings;  ///< one line each
};

/// `path`: the platform's way through the whole calibration, for models with a memory; may be
/// empty. Throws ConfigError: no observations, numbers that are not finite, a covariance that is
/// none, fewer observations than unknowns without a prior, an axis missing with require_all.
WrenchFit fit_wrench(std::span<const Observation> observations, std::span<const PathPoint> path,
                     const FitOptions& options);

/// What the observations so far tell, without residuals: 1 - (standard deviation after / before) of
/// the answer to a load along each axis, for a guide. `stiffness`: the spring model's.
Vector6 coverage(std::span<const Observation> observations, const Matrix6& stiffness,
                 double prior_width);

}  // namespace tagwrench

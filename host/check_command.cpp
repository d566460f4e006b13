#include "host/check_command.h"

#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <numbers>

#include "host/bench_input.h"
#include "host/check_text.h"
#include "host/config_error.h"
#include "host/hands_off.h"
#include "host/link/cell_calibration.h"
#include "host/tell.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr int kOff = 1;
constexpr Duration kPatience = std::chrono::seconds(20);
constexpr Duration kPatienceForMass = std::chrono::seconds(60);

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

CLI::Validator finite() {
  return {[](std::string& text) {
            double value = 0;
            const bool usable = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
            return usable ? std::string() : "'" + text + "' is not a number";
          },
          "NUMBER"};
}

int stopped() {
  tell("stopped");
  return kOff;
}

/// Prints the findings; whether all are fine.
bool print(const std::vector<InSituFinding>& findings) {
  bool fine = true;
  for (const InSituFinding& finding : findings) {
    std::cout << text(finding) << '\n';
    // One tag alone cannot be compared, ever: that is no fault of today.
    const bool by_design = finding.subject == Subject::tags && finding.fault == Fault::not_known;
    fine = fine && (finding.fine() || by_design);
  }
  std::cout.flush();
  return fine;
}

/// M = r x F, where r is where the point has gone with the platform; and what is not known of mass,
/// point and direction.
void set_known(const CheckOptions& options, const Vector6& displacement, KnownLoad& load) {
  const Eigen::Vector3d point = vector3(options.at_mm) * 1e-3;
  const double force = *options.mass_g * 1e-3 * link::kStandardGravity;
  const Eigen::Vector3d f = force * vector3(options.gravity).normalized();
  const Eigen::Vector3d r =
      displacement.head<3>() + rotation_from_vector(displacement.tail<3>()) * point;
  load.known << f, r.cross(f);
  const double turn = options.direction_sigma_deg * std::numbers::pi / 180;
  const double shift = options.at_sigma_mm * 1e-3;
  const double size = options.mass_sigma_percent * 1e-2;
  Matrix6 covariance = size * size * load.known * load.known.transpose();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
    Vector6 turned, shifted;
    turned << e.cross(f), r.cross(e.cross(f));
    shifted << Eigen::Vector3d::Zero(), e.cross(f);
    covariance +=
        turn * turn * turned * turned.transpose() + shift * shift * shifted * shifted.transpose();
  }
  load.known_covariance = covariance;
}

/// How far the wrench must go before the load is taken to be there, of the range.
double least_change(const CheckOptions& options, const Vector6& range) {
  KnownLoad load;
  set_known(options, Vector6::Zero(), load);
  return 0.3 * load.known.cwiseQuotient(range).cwiseAbs().maxCoeff();
}

}  // namespace

CheckCommand::CheckCommand(CLI::App& app)
    : verb_(app.add_subcommand(
          "check", "say line by line whether a calibrated sensor still measures what it did")) {
  verb_->add_option("--sensor", options_.sensor, "sensor.yaml of this sensor")->required();
  verb_
      ->add_option("--source", options_.source,
                   "sim | sim:SCENARIO.yaml | v4l2:/dev/videoN[,WxH[@FPS][,FOURCC]] | images:DIR")
      ->required();
  auto* mass = verb_->add_option("--mass-g", options_.mass_g, "a known mass to hang on, g")
                   ->check(CLI::Range(0.1, 1e5));
  auto* at = verb_
                 ->add_option("--at", options_.at_mm,
                              "x,y,z: where it takes hold, mm, platform frame (origin between the "
                              "tags, axes as the camera's)")
                 ->delimiter(',')
                 ->expected(3)
                 ->check(finite());
  mass->needs(at);
  at->needs(mass);
  verb_
      ->add_option("--gravity", options_.gravity,
                   "x,y,z: which way masses pull, camera axes; 0,0,-1 when the camera looks up")
      ->delimiter(',')
      ->expected(3)
      ->check(finite());
  verb_
      ->add_option("--mass-sigma-percent", options_.mass_sigma_percent,
                   "how well the mass is known, 1 standard deviation")
      ->check(CLI::Range(0.0, 50.0));
  verb_->add_option("--at-sigma-mm", options_.at_sigma_mm, "how well the point is known")
      ->check(CLI::Range(0.0, 50.0));
}

int CheckCommand::run() const {
  if (!(vector3(options_.gravity).norm() > 1e-9))
    throw ConfigError("--gravity: has no length; give a direction such as 0,0,-1");
  BenchInput at = open_at_bench({options_.sensor, options_.source, true});
  Input& input = at.input;
  check_size(input);
  check_calibrated_rest(input.sensor, "check");
  const UniqueFd stop = signals_as_fd();
  HandsOff hands_off(input.sensor, std::chrono::seconds(2),
                     options_.mass_g ? kPatienceForMass : kPatience);
  tell("source: " + input.source->format().description);
  tell("hands off for some seconds");
  const Seen seen = watch(*input.source, stop, hands_off);
  if (seen == Seen::stopped) return stopped();
  if (const std::string why = why_nothing(seen, hands_off); !why.empty()) {
    tell(why);
    return kOff;
  }
  bool fine = print(judge(hands_off.result()));
  if (!options_.mass_g) return fine ? 0 : kOff;

  KnownLoad load;
  load.range = input.sensor.wrench.range;
  const Vector6 before = hands_off.result().wrench;
  load.measured_covariance = Matrix6::Zero();
  hands_off.wait_for_change(least_change(options_, load.range));
  tell(fmt::format("now hang {:g} g at ({:g}, {:g}, {:g}) mm, and let it come to rest",
                   *options_.mass_g, options_.at_mm[0], options_.at_mm[1], options_.at_mm[2]));
  if (at.bench) at.bench->hang(*options_.mass_g * 1e-3, vector3(options_.at_mm) * 1e-3);
  const Seen loaded = watch(*input.source, stop, hands_off);
  if (loaded == Seen::stopped) return stopped();
  InSituFinding scale{.subject = Subject::scale, .fault = Fault::not_known};
  if (loaded == Seen::enough && hands_off.result().held) {
    load.measured = hands_off.result().wrench - before;
    load.measured_covariance = hands_off.wrench_sigma().cwiseAbs2().asDiagonal();
    set_known(options_, hands_off.displacement(), load);
    scale = judge(load);
  }
  fine = print({scale}) && fine;
  return fine ? 0 : kOff;
}

}  // namespace tagwrench

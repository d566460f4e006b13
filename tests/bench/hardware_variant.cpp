#include "tests/bench/hardware_variant.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <vector>

#include "host/commands/design_hardware.h"
#include "host/source/simulator/mechanics.h"
#include "host/tools/design/design.h"
#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"
#include "tests/bench/hardware_loop.h"
#include "tests/bench/tracker_bound.h"

namespace tagwrench::bench {
namespace {

constexpr int kFramesEach = 10;
constexpr int kRests = 4;
constexpr double kLoadShare = 0.5;  // of the range, one axis alone

using Wrenches = std::vector<Vector6>;

/// Rest some times, then each axis alone both ways.
Wrenches loads(const Vector6& range) {
  Wrenches out(kRests, Vector6::Zero());
  for (int axis = 0; axis < 6; ++axis) {
    for (const double way : {kLoadShare, -kLoadShare})
      out.emplace_back(way * range[axis] * Vector6::Unit(axis));
  }
  return out;
}

struct Hold {
  Vector6 mean = Vector6::Zero();  ///< displacement, m, rad
  Matrix6 scatter = Matrix6::Zero();
  int frames = 0;
};

/// Means and scatter of what was read at each load.
std::vector<Hold> holds_of(const std::vector<HeldReadings>& readings, VariantLoop& loop) {
  std::vector<Hold> holds;
  for (const HeldReadings& frames : readings) {
    Hold& hold = holds.emplace_back();
    for (const auto& frame : frames) {
      ++loop.frames;
      if (frame) {
        ++hold.frames;
        hold.mean += frame->displacement;
      } else {
        ++loop.lost;
      }
    }
    if (hold.frames > 0) hold.mean /= hold.frames;
    for (const auto& frame : frames) {
      if (!frame) continue;
      const Vector6 stray = frame->displacement - hold.mean;
      hold.scatter += stray * stray.transpose();
    }
  }
  return holds;
}

Vector6 cross_talk(const Wrenches& wrenches, const std::vector<Hold>& holds, const Vector6& range,
                   const Matrix6& stiffness) {
  Vector6 rest = Vector6::Zero();
  for (int i = 0; i < kRests; ++i) rest += holds[static_cast<std::size_t>(i)].mean / kRests;
  Vector6 worst = Vector6::Zero();
  for (std::size_t i = kRests; i < holds.size(); ++i) {
    if (holds[i].frames == 0) continue;
    Vector6 wrong = (stiffness * (holds[i].mean - rest) - wrenches[i]).cwiseQuotient(range);
    wrong[static_cast<int>(i - kRests) / 2] = 0;  // its own axis' error is one of scale
    worst = worst.cwiseMax(wrong.cwiseAbs());
  }
  return worst;
}

VariantLoop closed_loop(const sim::Scenario& scenario, const hardware::Geometry& g,
                        const Vector6& range) {
  VariantLoop loop;
  const Matrix6 stiffness = sim::stiffness(scenario.mechanics);
  const Wrenches wrenches = loads(range);
  std::vector<Vector6> displacements;
  for (const Vector6& wrench : wrenches) displacements.emplace_back(stiffness.inverse() * wrench);
  std::vector<Hold> holds;
  Matrix6 bound;
  if (g.mirror) {
    const Eigen::Vector3d& normal = g.mirror->normal;
    const MirrorPair pair(scenario, normal, g.mirror->distance - g.pupil * normal.z());
    holds = holds_of(pair.held_readings(displacements, kFramesEach), loop);
    bound = pair.bound();
  } else {
    holds = holds_of(held_readings(scenario, displacements, kFramesEach), loop);
    bound = BoundOfScenario(scenario).covariance(Vector6::Zero());
  }
  Matrix6 scatter = Matrix6::Zero();
  int freedom = 0;
  for (const Hold& hold : holds) {
    scatter += hold.scatter;
    freedom += std::max(0, hold.frames - 1);
  }
  const auto of_wrench = [&](const Matrix6& displacement) -> Vector6 {
    return (stiffness * displacement * stiffness.transpose()).diagonal().cwiseSqrt();
  };
  loop.noise = of_wrench(scatter / std::max(1, freedom));
  loop.displacement_noise = (scatter / std::max(1, freedom)).diagonal().cwiseSqrt();
  loop.bound = of_wrench(bound);
  loop.cross_talk = cross_talk(wrenches, holds, range, stiffness);
  return loop;
}

void take_size(const hardware::Parameters& p, const hardware::Geometry& g, VariantFigures& out) {
  const double sides = p.top.walls == 4 ? 2 : 1;
  double x = g.inner_x_to - g.inner_x_from + sides * p.printing.wall;
  double y = 2 * (g.inner_y + p.printing.wall);
  const auto widen = [&](double to_x, double to_y) {
    x = std::max(x, to_x);
    y = std::max(y, to_y);
  };
  if (p.top.knob) widen(p.top.knob_diameter, p.top.knob_diameter);
  if (p.mount.puck) widen(p.mount.width, p.mount.width);
  if (p.camera.body == hardware::CameraBody::board) widen(p.camera.width, p.camera.depth);
  out.size_x = x;
  out.size_y = y;
  out.height = g.top - g.bottom;
}

/// Fields of one row; "..." holds commas.
std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

}  // namespace

VariantFigures measure_variant(const hardware::Parameters& p) {
  const hardware::Geometry g = hardware::geometry(p);
  VariantFigures out;
  out.name = p.name;
  out.about = p.about;
  out.range = hardware::range(p, g);
  out.frame_rate = p.camera.frame_rate;
  study::Instrument instrument;
  take_hardware(p, instrument);
  const Matrix6 bound =
      study::displacement_bound(instrument.tags, instrument.origin, instrument.picture);
  const Matrix6& k = instrument.stiffness;
  out.edge_displacement = bound.diagonal().cwiseSqrt();
  out.edge_bound = (k * bound * k.transpose()).diagonal().cwiseSqrt();
  out.modes = study::natural_frequencies(k, instrument.platform);
  take_size(p, g, out);
  out.loop = closed_loop(scenario_of(p), g, out.range);
  return out;
}

hardware::Parameters with_roof(hardware::Parameters mirror) {
  mirror.name += ", roof";
  mirror.target.layout = hardware::TagLayout::roof;
  mirror.target.angle = std::numbers::pi / 4;
  return mirror;
}

std::optional<PriceRange> parts_price(const std::string& file, const std::string& variant) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  PriceRange sum;
  std::string line;
  std::getline(in, line);  // header
  while (std::getline(in, line)) {
    const std::vector<std::string> row = fields(line);
    if (row.size() < 6) continue;
    std::istringstream variants(row[0]);
    for (std::string name; variants >> name;) {
      if (name != variant && name != "all") continue;
      const double quantity = std::stod(row[2]);
      sum.low += quantity * std::stod(row[4]);
      sum.high += quantity * std::stod(row[5]);
    }
  }
  return sum;
}

}  // namespace tagwrench::bench

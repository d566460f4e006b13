// The shipped program against the simulated sensor: rendered frames in, newtons out, compared with
// the truth. The simulator shares no maths with the tracker or the wrench model, so an error in
// either shows here.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

using Row = std::array<double, 12>;  // dx dy dz rx ry rz (m, rad), fx fy fz mx my mz (N, N m)

std::vector<Row> read_truth(const std::filesystem::path& path) {
  std::istringstream in(read_file(path));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "seq,t_ns,dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm");
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    std::getline(fields, field, ',');
    Row row{};
    for (double& value : row) {
      std::getline(fields, field, ',');
      value = std::stod(field);
    }
    rows.push_back(row);
  }
  return rows;
}

struct Result {
  std::vector<Row> truth;
  std::vector<nlohmann::json> samples;
  std::string err;
};

constexpr int kFrames = 300;

Result run_scenario(const std::string& scenario) {
  TemporaryFolder folder;
  const std::string frames = folder / "frames";
  Result result;
  std::vector<std::string> sim = {"sim", "--out", frames, "--frames", std::to_string(kFrames)};
  if (!scenario.empty())
    sim.insert(sim.end(), {"--scenario", std::string(TAGWRENCH_SCENARIOS) + "/" + scenario});
  const Outcome rendered = run_bridge(sim);
  EXPECT_EQ(rendered.status, 0) << rendered.err;
  const Outcome ran =
      run_bridge({"run", "--source", "images:" + frames, "--sensor", frames + "/sensor.yaml",
                  "--output", "jsonl:" + (folder / "out.jsonl").string(), "--fast"});
  EXPECT_EQ(ran.status, 0) << ran.err;
  result.err = ran.err;
  result.truth = read_truth(frames + "/truth.csv");
  std::istringstream lines(read_file(folder / "out.jsonl"));
  for (std::string line; std::getline(lines, line);)
    result.samples.push_back(nlohmann::json::parse(line));
  return result;
}

/// Frames after which the sensor must be ok: the rest frames of sensor.yaml, and no more.
constexpr std::size_t kRestFrames = 25;

struct Rms {
  std::array<double, 6> displacement{};  // m, rad
  std::array<double, 6> wrench{};        // N, N m
  std::array<double, 6> pushed{};        // RMS of the true wrench, for scale
};

Rms compare(const Result& result) {
  Rms rms;
  std::size_t n = 0;
  for (std::size_t i = kRestFrames; i < result.samples.size(); ++i, ++n) {
    const nlohmann::json& s = result.samples[i];
    EXPECT_TRUE(s["status"] == "ok" || s["status"] == "saturated") << s;
    for (std::size_t a = 0; a < 3; ++a) {
      rms.displacement[a] += std::pow(s["d_m"][a].get<double>() - result.truth[i][a], 2);
      rms.displacement[a + 3] += std::pow(s["d_rad"][a].get<double>() - result.truth[i][a + 3], 2);
      rms.wrench[a] += std::pow(s["f_n"][a].get<double>() - result.truth[i][a + 6], 2);
      rms.wrench[a + 3] += std::pow(s["m_nm"][a].get<double>() - result.truth[i][a + 9], 2);
      rms.pushed[a] += std::pow(result.truth[i][a + 6], 2);
      rms.pushed[a + 3] += std::pow(result.truth[i][a + 9], 2);
    }
  }
  for (auto* values : {&rms.displacement, &rms.wrench, &rms.pushed}) {
    for (double& v : *values) v = std::sqrt(v / static_cast<double>(n));
  }
  return rms;
}

struct Case {
  const char* name;
  const char* scenario;
};

class ClosedLoop : public testing::TestWithParam<Case> {};

TEST_P(ClosedLoop, DisplacementAndWrenchFollowTheTruth) {
  constexpr double kLateral_m = 5e-6;
  constexpr double kDepth_m = 15e-6;
  constexpr double kAngle_rad = 1.5e-3;
  const Result result = run_scenario(GetParam().scenario);
  ASSERT_EQ(result.samples.size(), static_cast<std::size_t>(kFrames));
  ASSERT_EQ(result.truth.size(), static_cast<std::size_t>(kFrames));
  for (std::size_t i = 0; i < result.samples.size(); ++i) EXPECT_EQ(result.samples[i]["seq"], i);

  const Rms rms = compare(result);
  const double limit[6] = {kLateral_m, kLateral_m, kDepth_m, kAngle_rad, kAngle_rad, kAngle_rad};
  const char* axis[6] = {"x", "y", "z", "rx", "ry", "rz"};
  for (int a = 0; a < 6; ++a) {
    EXPECT_LT(rms.displacement[a], limit[a]) << axis[a];
    RecordProperty(std::string("displacement_rms_") + axis[a], std::to_string(rms.displacement[a]));
    // The wrench truth is what the hand applies; the springs see it less the platform's inertia.
    // Displacement noise times stiffness plus 3 % of the push bounds the rest.
    const double noise[6] = {0.002, 0.002, 0.045, 4e-4, 4e-4, 1e-4};  // N, N m
    EXPECT_LT(rms.wrench[a], noise[a] + 0.03 * rms.pushed[a]) << "wrench " << axis[a];
    EXPECT_GT(rms.pushed[a], noise[a]) << "the scenario must push axis " << axis[a];
  }
  std::printf(
      "%-10s d RMS x %.2f y %.2f z %.2f um  rx %.3f ry %.3f rz %.3f mrad  f %.1f %.1f %.1f mN  m "
      "%.3f %.3f %.3f mN m\n",
      GetParam().name, rms.displacement[0] * 1e6, rms.displacement[1] * 1e6,
      rms.displacement[2] * 1e6, rms.displacement[3] * 1e3, rms.displacement[4] * 1e3,
      rms.displacement[5] * 1e3, rms.wrench[0] * 1e3, rms.wrench[1] * 1e3, rms.wrench[2] * 1e3,
      rms.wrench[3] * 1e3, rms.wrench[4] * 1e3, rms.wrench[5] * 1e3);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, ClosedLoop,
                         testing::Values(Case{"Default", ""}, Case{"OneTag", "one_tag.yaml"},
                                         Case{"AprilTag", "apriltag.yaml"},
                                         Case{"Grid", "grid.yaml"},
                                         Case{"Mirrored", "mirrored.yaml"}),
                         [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace tagwrench::test

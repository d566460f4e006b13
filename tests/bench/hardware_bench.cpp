// The sensors of hardware/sensors side by side, for somebody who chooses one to build. Standard
// output carries the tables.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <filesystem>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "host/core/config_error.h"
#include "host/tools/design/parameters.h"
#include "tests/bench/hardware_variant.h"
#include "tests/bench/table.h"

namespace tagwrench::bench {
namespace {

constexpr const char* kHeads =
    "Newtons: a push along camera x, y or z at the tags; mN m: about x, y, z. One standard "
    "deviation.";

using Figures = std::array<double, 6>;

/// N and N m in the table's units.
Figures in_units(const Vector6& wrench, double force, double torque) {
  Figures out{};
  for (int i = 0; i < 6; ++i)
    out[static_cast<std::size_t>(i)] = wrench[i] * (i < 3 ? force : torque);
  return out;
}

/// Those of hardware/sensors, all or by name, and files of others (*.yaml).
std::vector<hardware::Parameters> sensors(const std::vector<std::string>& asked) {
  namespace fs = std::filesystem;
  std::vector<fs::path> files;
  for (const std::string& name : asked) {
    const bool file = fs::path(name).extension() == ".yaml";
    files.push_back(file ? fs::path(name) : fs::path(TAGWRENCH_SENSORS) / (name + ".yaml"));
  }
  if (asked.empty()) {
    for (const auto& entry : fs::directory_iterator(TAGWRENCH_SENSORS))
      if (entry.path().extension() == ".yaml") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
  }
  std::vector<hardware::Parameters> out;
  for (const fs::path& file : files) out.push_back(load_buildable(file));
  return out;
}

void show_choice(const std::vector<VariantFigures>& variants) {
  fmt::print("\n{:<12}{:>11}{:>15}{:>18}{:>14}{:>13}  {}\n", "variant", "range, N", "noise Fz, mN",
             "size, mm", "true to, Hz", "parts, $", "");
  for (const VariantFigures& v : variants) {
    const double usable = std::min(v.modes.front() / std::sqrt(21.0), 0.5 * v.frame_rate);

    const auto price = parts_price(TAGWRENCH_SENSORS "/../bom.csv", v.name);
    fmt::print(
        "{:<12}{:>11}{:>15}{:>18}{:>14.1f}{:>13}  {}\n", v.name,
        fmt::format("+-{:.2g}", v.range.head<3>().minCoeff()),
        fmt::format("{:.2g}", 1e3 * v.loop.noise[2]),
        fmt::format("{:.0f} x {:.0f} x {:.0f}", 1e3 * v.size_x, 1e3 * v.size_y, 1e3 * v.height),
        usable, price ? fmt::format("{:.0f} to {:.0f}", price->low, price->high) : "-", v.about);
  }
  fmt::print(
      "  range: along the weakest axis, before a stop; size: over all but the ears; true to: a\n"
      "  motion so fast is shown within 5 % (lowest mode / sqrt(21), or half the pictures' rate);\n"
      "  parts: without the board (LED driver), lowest and highest price of hardware/bom.csv.\n");
}

void show_axes(const std::vector<VariantFigures>& variants, Table& table) {
  const std::array<std::string, 6> mn{"Fx mN", "Fy mN", "Fz mN", "Mx mN m", "My mN m", "Mz mN m"};
  const std::array<std::string, 6> um{"x um", "y um", "z um", "rx mrad", "ry mrad", "rz mrad"};
  table.columns("range before a stop, +-",
                {"Fx N", "Fy N", "Fz N", "Mx mN m", "My mN m", "Mz mN m"});
  for (const VariantFigures& v : variants) table.figures(v.name, in_units(v.range, 1, 1e3), 2);
  table.columns("noise of one picture, simulated", mn);
  for (const VariantFigures& v : variants)
    table.figures(v.name, in_units(v.loop.noise, 1e3, 1e3), 4);
  table.columns("Cramer-Rao bound of the same pictures", mn);
  for (const VariantFigures& v : variants)
    table.figures(v.name, in_units(v.loop.bound, 1e3, 1e3), 4);
  table.columns("noise of one picture, displacement", um);
  for (const VariantFigures& v : variants)
    table.figures(v.name, in_units(v.loop.displacement_noise, 1e6, 1e3), 4);
  table.columns("bound by the edges (`tagwrench design`)", mn);
  for (const VariantFigures& v : variants)
    table.figures(v.name, in_units(v.edge_bound, 1e3, 1e3), 4);
  table.columns("the same, displacement", um);
  for (const VariantFigures& v : variants)
    table.figures(v.name, in_units(v.edge_displacement, 1e6, 1e3), 4);
}

void show_cross_talk(const std::vector<VariantFigures>& variants, Table& table) {
  const std::array<std::string, 6> axes{"Fx %", "Fy %", "Fz %", "Mx %", "My %", "Mz %"};
  table.columns("cross-talk", axes);
  for (const VariantFigures& v : variants)
    table.figures(v.name, in_units(v.loop.cross_talk, 100, 100), 3);
  table.line(
      "worst wrong reading of an axis while another one alone bears half of its range, in % of the "
      "range;\n  the simulated springs have no cross-talk of their own: it is that of the tags' "
      "places");
}

void show_modes(const std::vector<VariantFigures>& variants, Table& table) {
  table.columns("modes of the platform, Hz; pictures a second", {"1", "2", "3", "4", "5", "6"});
  for (const VariantFigures& v : variants)
    table.figures(fmt::format("{}; {:g}", v.name, v.frame_rate), v.modes, 1);
  for (const VariantFigures& v : variants) {
    if (v.loop.lost > 0) {
      table.line(fmt::format("{}: {} of {} pictures at fixed loads gave no numbers", v.name,
                             v.loop.lost, v.loop.frames));
    }
  }
}

/// Same camera, tags, distance and springs: only what the tags sit on differs.
void show_mirror(const VariantFigures& mirror, const VariantFigures& roof, Table& table) {
  table.columns("what a mirror is worth: displacement",
                {"x um", "y um", "z um", "rx mrad", "ry mrad", "rz mrad"});
  table.figures(mirror.name, in_units(mirror.loop.displacement_noise, 1e6, 1e3), 4);
  table.figures(roof.name, in_units(roof.loop.displacement_noise, 1e6, 1e3), 4);
  const Vector6 gain = roof.loop.noise.cwiseQuotient(mirror.loop.noise);
  const Vector6 possible = roof.loop.bound.cwiseQuotient(mirror.loop.bound);
  table.columns("noise with a roof over noise with a mirror", {"Fx", "Fy", "Fz", "Mx", "My", "Mz"});
  table.figures("simulated", in_units(gain, 1, 1), 2);
  table.figures("by the bounds", in_units(possible, 1, 1), 2);
}

}  // namespace
}  // namespace tagwrench::bench

int main(int argc, char** argv) {
  using namespace tagwrench::bench;
  cv::setNumThreads(1);
  try {
    const std::vector<std::string> names(argv + 1, argv + argc);
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<tagwrench::hardware::Parameters> chosen = sensors(names);
    std::vector<VariantFigures> variants;
    for (const auto& sensor : chosen) variants.push_back(measure_variant(sensor));
    Table table;
    fmt::print("{}\n", kHeads);
    show_choice(variants);
    show_axes(variants, table);
    show_cross_talk(variants, table);
    show_modes(variants, table);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (chosen[i].target.layout == tagwrench::hardware::TagLayout::mirror)
        show_mirror(variants[i], measure_variant(with_roof(chosen[i])), table);
    }
    fmt::print("\n{:.0f} s\n",
               std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  } catch (const tagwrench::ConfigError& e) {
    fmt::print(stderr, "bench hardware: {}\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench hardware: {}\n", e.what());
    return 1;
  }
}

#include "tests/hardware/drawn_sensor.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <sstream>

#include "host/tools/design/parameters.h"

namespace tagwrench::test {
namespace {

constexpr double kToMm = 1e3;
const std::string kProbe = TAGWRENCH_HARDWARE_TESTS "/probe.scad";

const std::map<std::string, std::string> kPackages{{"openscad", "openscad"},
                                                   {"admesh", "admesh"},
                                                   {"prusa-slicer", "prusa-slicer"},
                                                   {"Xvfb", "xvfb"}};

/// From the corner with arms of 1, 2 and 3 mm along x, y and z that the probe puts on the bed.
Eigen::Isometry3d bed_T_drawing(const Mesh& corner) {
  for (const Triangle& face : corner) {
    for (const Eigen::Vector3d& origin : face) {
      std::array<std::optional<Eigen::Vector3d>, 3> arms;
      for (const Triangle& other : corner) {
        for (const Eigen::Vector3d& end : other) {
          const double length = (end - origin).norm();
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const double arm = static_cast<double>(axis + 1);
            if (std::abs(length - arm) < 1e-4) arms[axis] = (end - origin) / arm;
          }
        }
      }
      if (!arms[0] || !arms[1] || !arms[2]) continue;
      Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
      out.linear() << *arms[0], *arms[1], *arms[2];
      out.translation() = origin;
      return out;
    }
  }
  throw std::runtime_error("the part is not moved as a rigid body onto the bed");
}

std::vector<std::string> part_names(const std::filesystem::path& folder) {
  std::smatch found;
  const std::string text = read_file(folder / "parameters.scad");
  if (!std::regex_search(text, found, std::regex("\nparts = (.*);")))
    throw std::runtime_error("parameters.scad does not list the parts");
  return nlohmann::json::parse(found[1].str()).get<std::vector<std::string>>();
}

/// parts.csv, by part and column.
std::map<std::string, std::map<std::string, std::string>> table(const std::filesystem::path& path) {
  std::istringstream in(read_file(path));
  const auto fields = [](const std::string& line) {
    std::istringstream cells(line);
    std::vector<std::string> out;
    for (std::string cell; std::getline(cells, cell, ',');) out.push_back(cell);
    return out;
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> header = fields(line);
  std::map<std::string, std::map<std::string, std::string>> out;
  while (std::getline(in, line)) {
    const std::vector<std::string> row = fields(line);
    for (std::size_t i = 0; i < std::min(row.size(), header.size()); ++i)
      out[row[0]][header[i]] = row[i];
  }
  return out;
}

}  // namespace

std::string missing_tool(const std::vector<std::string>& tools) {
  for (const std::string& tool : tools) {
    if (run_tool({"sh", "-c", "command -v " + tool}).status != 0)
      return tool + " is missing: sudo apt install " + kPackages.at(tool);
  }
  return "";
}

Outcome run_tool(std::vector<std::string> command) {
  return Bridge(command, "/dev/null", "/usr/bin/env").finish();
}

Outcome draw(const std::filesystem::path& folder, const std::string& scad, const std::string& part,
             const std::filesystem::path& out, const std::vector<std::string>& set) {
  std::filesystem::remove(out);  // an empty drawing leaves an old file alone
  const std::string drawings = TAGWRENCH_HARDWARE "/scad";
  std::vector<std::string> command{"OPENSCADPATH=" + folder.string() + ":" + drawings,
                                   "openscad",
                                   "--hardwarnings",
                                   "--export-format",
                                   "binstl",
                                   "-o",
                                   out.string(),
                                   "-D",
                                   "part=\"" + part + "\""};
  for (const std::string& one : set) command.insert(command.end(), {"-D", one});
  command.push_back(scad);
  return run_tool(command);
}

DrawnSensor::DrawnSensor(const std::filesystem::path& yaml, const std::filesystem::path& folder)
    : parameters(load_hardware(yaml.string())), geometry(hardware::geometry(parameters)) {
  const TemporaryFolder drawn;
  const auto probe = [&](const std::string& part, const std::string& group) {
    const Outcome outcome =
        draw(folder, kProbe, part, drawn / "probe.stl", {"group=\"" + group + "\""});
    if (outcome.status != 0) throw std::runtime_error(part + " " + group + ": " + outcome.err);
    return read_stl(drawn / "probe.stl");
  };
  auto measured = table(folder / "parts.csv");
  for (const std::string& name : part_names(folder)) {
    DrawnPart part;
    part.name = name;
    part.moves = name == "top_plate" || name == "light_shield" || name == "knob";
    part.printed = read_stl(folder / (name + ".stl"));
    part.there = moved(bed_T_drawing(probe(name, "bed")).inverse(), part.printed);
    part.print_s = std::stod(measured[name].at("print_s"));
    part.filament_g = std::stod(measured[name].at("filament_g"));
    parts.push_back(std::move(part));
  }
  bought_fixed = probe("", "fixed");
  bought_moving = probe("", "moving");
}

const DrawnPart& DrawnSensor::part(const std::string& name) const {
  for (const DrawnPart& part : parts)
    if (part.name == name) return part;
  throw std::runtime_error("no part " + name);
}

bool DrawnSensor::has(const std::string& name) const {
  return std::any_of(parts.begin(), parts.end(),
                     [&](const DrawnPart& p) { return p.name == name; });
}

Mesh DrawnSensor::group(bool moving, bool bought) const {
  Mesh out;
  if (bought) out = moving ? bought_moving : bought_fixed;
  for (const DrawnPart& part : parts) {
    if (part.moves == moving) out.insert(out.end(), part.there.begin(), part.there.end());
  }
  return out;
}

Eigen::Isometry3d displaced(const hardware::Geometry& geometry, const Vector6& displacement) {
  const Eigen::Vector3d origin(0, 0, kToMm * geometry.platform);
  const Eigen::Vector3d turn = displacement.tail<3>();
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(origin + kToMm * displacement.head<3>());
  if (turn.norm() > 0) out.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  return out.translate(-origin);
}

}  // namespace tagwrench::test

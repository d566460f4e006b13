// A variant as `hardware/export.py` drew it: its STL files, put together again.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"
#include "tests/cli/bridge.h"
#include "tests/hardware/mesh.h"

namespace tagwrench::test {

/// Empty, or what is missing and how to get it.
std::string missing_tool(const std::vector<std::string>& tools);

/// A program that is found as a shell would.
Outcome run_tool(std::vector<std::string> command);

/// OpenSCAD's command line, on numbers of the exported `folder`: a binary STL of `part`.
Outcome draw(const std::filesystem::path& folder, const std::string& scad, const std::string& part,
             const std::filesystem::path& out, const std::vector<std::string>& set = {});

struct DrawnPart {
  std::string name;
  bool moves = false;
  Mesh printed;  ///< as it lies on the bed
  Mesh there;    ///< in the drawing frame, at rest
  double print_s = 0;
  double filament_g = 0;
};

struct DrawnSensor {
  /// Of the exported `folder`; draws what is bought itself. Throws std::runtime_error.
  DrawnSensor(const std::filesystem::path& yaml, const std::filesystem::path& folder);

  const DrawnPart& part(const std::string& name) const;
  bool has(const std::string& name) const;

  /// Printed parts of one group, and with `bought` camera and screws, as one heap of triangles.
  Mesh group(bool moving, bool bought) const;

  hardware::Parameters parameters;
  hardware::Geometry geometry;
  std::vector<DrawnPart> parts;
  Mesh bought_fixed, bought_moving;
};

/// Drawing frame (mm) from that of the platform at rest, for a displacement in m and rad.
Eigen::Isometry3d displaced(const hardware::Geometry& geometry, const Vector6& displacement);

}  // namespace tagwrench::test

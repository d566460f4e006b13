#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/tools/design/checks.h"

namespace tagwrench::hardware {
namespace {

constexpr double kToMm = 1e3;
constexpr double kNothing = 1e-9;  // rounding
constexpr double kMinBoltThread = 2e-3;
constexpr double kCountersink = 1e-3;     // depth of an M2 head
constexpr double kRim = 0.8e-3;           // of the ledge at its thin edge
constexpr double kEarEdge = 3e-3;         // around a hole in an ear
constexpr double kRimOutside = 3e-3;      // from a knob to the outside of the rim below it
constexpr double kBaseScrewInset = 5e-3;  // from the base's edge
constexpr double kBaseScrewHead = 3.2e-3;
constexpr double kBayLeast = 13e-3;   // floor, board with its plug, and wires
constexpr double kBaseLeast = 78e-3;  // board and plug, one behind the other
constexpr double kBaseWall = 2.4e-3;
constexpr double kWeightDensity = 0.5 * 7.8e3;  // steel, half of the room
constexpr double kBoardShare = 0.35;            // of the bay, for board, wires and posts
constexpr double kGlassAndBack = 2.2e-3;        // of the mirror and what it is glued on
constexpr double kCheek = 1.7e-3;               // beside the mirror, with the glass' play
constexpr double kBesideSight = 0.2e-3;         // from the holder to a line of sight
constexpr double kHolderFoot = 6.8e-3;          // of the mirror's holder beyond the lens

class PartChecker {
 public:
  PartChecker(const Parameters& p, const Geometry& g) : p_(p), g_(g) {}

  std::vector<Complaint> run() {
    threads();
    cover();
    p_.mount.puck ? base() : ears();
    if (g_.mirror) mirror();
    return std::move(found_);
  }

 private:
  void say(const char* parameter, std::string message) {
    found_.push_back({parameter, std::move(message)});
  }

  void thread(const char* parameter, double hole, double screw) {
    if (hole < screw - kNothing) return;
    say(parameter, fmt::format("a hole of {:.1f} mm gives a screw of {:.1f} mm no thread; take "
                               "about {:.1f} mm",
                               kToMm * hole, kToMm * screw, 0.85 * kToMm * screw));
  }

  void threads() {
    thread("stops.thread_hole_mm", p_.stops.thread_hole, p_.stops.screw);
    thread("top.thread_hole_mm", p_.top.thread_hole, p_.top.screw);
    thread("cover.thread_hole_mm", p_.cover.thread_hole, p_.camera.hole);
    const double least = kCountersink + 2 * p_.printing.layer;
    if (p_.top.roof < least - kNothing)
      say("top.roof_mm", fmt::format("{:.1f} mm leave nothing under the heads of the screws; take "
                                     "{:.1f} mm or more",
                                     kToMm * p_.top.roof, kToMm * least));
  }

  void cover() {
    const bool board = p_.camera.body == CameraBody::board;
    const double foot = board ? g_.board_top : p_.mount.thickness;
    const double rim = g_.ledge - std::max(g_.overhang_x, g_.overhang_y) - foot;
    if (rim < kRim - kNothing) {
      say("cover.ledge_mm",
          fmt::format("the ledge slopes at 45 degrees to what the camera's board stands out, and "
                      "ends {:.1f} mm thin; make it {:.1f} mm or more",
                      kToMm * rim, kToMm * (p_.cover.ledge + kRim - rim)));
    } else if (g_.bolt_length - foot < kMinBoltThread - kNothing) {
      say("cover.ledge_mm",
          fmt::format(
              "the bolts find {:.1f} mm of thread in the cover, {:.0f} are needed; make the "
              "ledge {:.1f} mm or more",
              std::max(0.0, kToMm * (g_.bolt_length - foot)), kToMm * kMinBoltThread,
              kToMm * (p_.cover.ledge + kMinBoltThread - (g_.bolt_length - foot))));
    }
    const double room = g_.cover_top - foot - p_.light.diffuser;
    if (p_.light.height > room)
      say("light.height_mm", fmt::format("{:.1f} mm do not fit under the diffuser, where there are "
                                         "{:.1f} mm; take a flatter LED",
                                         kToMm * p_.light.height, kToMm * room));
    for (const Eigen::Vector2d& at : g_.bolts) {
      const double clear = at.norm() - g_.bore - 0.5 * p_.camera.hole;
      if (clear >= p_.cover.wall - kNothing) continue;
      say("camera", fmt::format("a mounting hole of {} is {:.1f} mm from the hole for its lens, a "
                                "wall of {:.1f} mm is needed; check hole_spacing_mm and "
                                "lens_diameter_mm",
                                p_.camera.name, kToMm * clear, kToMm * p_.cover.wall));
      break;
    }
  }

  void ears() {
    const double foot = std::max(0.5 * p_.camera.depth, p_.cover.y_half);
    const double inside = 0.5 * p_.mount.width - kEarEdge - p_.mount.hole;
    if (inside < foot + p_.printing.clearance)
      say("mount.width_mm",
          fmt::format(
              "the holes in the ears are under the cover; take {:.0f} mm "
              "or more",
              std::ceil(2 * kToMm * (foot + p_.printing.clearance + kEarEdge + p_.mount.hole))));
  }

  void base() {
    double least = kBaseLeast;
    if (p_.top.knob)
      least = std::max(least,
                       p_.top.knob_diameter + 2 * (kRimOutside + kBaseScrewHead + kBaseScrewInset));
    if (p_.mount.width < least - kNothing)
      say("mount.width_mm", fmt::format("a base of {:.0f} mm has no room for knob, screws and the "
                                        "board with its plug; take {:.0f} mm or more",
                                        kToMm * p_.mount.width, std::ceil(kToMm * least)));
    if (p_.mount.bay_height < kBayLeast)
      say("mount.bay_height_mm", fmt::format("{:.1f} mm are too low for the board; take {:.0f} mm "
                                             "or more",
                                             kToMm * p_.mount.bay_height, kToMm * kBayLeast));
    const double radius = 0.5 * p_.mount.width - kBaseWall;
    const double most = (1 - kBoardShare) * std::numbers::pi * radius * radius *
                        std::max(0.0, p_.mount.bay_height - kBaseWall) * kWeightDensity;
    if (p_.mount.weight > most)
      say("mount.weight_g", fmt::format("{:.0f} g of steel do not fit beside the board, about "
                                        "{:.0f} g do; take less, or a wider mount.width_mm",
                                        kToMm * p_.mount.weight, kToMm * most));
  }

  void mirror() {
    const Mirror& m = *g_.mirror;
    const double beside = m.half_y + kCheek + p_.stops.y + 0.5 * p_.springs.outer_diameter;
    if (0.5 * p_.springs.spacing_y < beside)
      say("springs.spacing_mm",
          fmt::format("the mirror's holder needs {:.1f} mm between the springs across (y), plus "
                      "their width and travel: {:.1f} mm from axis to axis",
                      kToMm * 2 * (m.half_y + kCheek), kToMm * 2 * beside));
    const double top = m.centre.z() + (m.half_slope + kGlassAndBack) * std::sqrt(0.5);
    if (top + p_.stops.z > g_.plate_bottom)
      say("stops.z_mm",
          fmt::format("at the end of the travel the plate meets the mirror, {:.1f} mm "
                      "too high; take less travel or a smaller target.tag_size_mm",
                      kToMm * (top + p_.stops.z - g_.plate_bottom)));
    if (p_.cover.x_to < g_.bore + kHolderFoot)
      say("cover.x_mm",
          fmt::format("the mirror's holder stands out to x = {:.1f} mm, the cover ends "
                      "at {:.1f} mm; lengthen it",
                      kToMm * (g_.bore + kHolderFoot), kToMm * p_.cover.x_to));
    const double hidden = behind_holder();
    if (hidden > kNothing)
      say("target.ridge_gap_mm",
          fmt::format("at the end of the travel the mirror's holder hides the flat tag, {:.2f} mm "
                      "too near to its line of sight; take {:.2f} mm or more, or less stops.x_mm",
                      kToMm * hidden, kToMm * (p_.target.ridge_gap + hidden)));
  }

  /// How far the lower end of the mirror, with what holds it, reaches into the way from the lens to
  /// the tag that is not seen in it.
  double behind_holder() const {
    const Mirror& m = *g_.mirror;
    const Eigen::Vector3d up_slope = Eigen::Vector3d::UnitY().cross(m.normal);
    const Eigen::Vector3d glass =
        m.centre - m.half_slope * std::copysign(1.0, up_slope.z()) * up_slope;
    const Eigen::Vector3d back = glass - kGlassAndBack * m.normal;
    Geometry flat = g_;
    std::erase_if(flat.tags, [](const TagPlace& tag) { return tag.in_mirror; });
    double most = 0;
    for (const Vector6& d : travel_corners(p_, g_)) {
      for (const Eigen::Vector3d& corner : paper_corners(p_, flat, d)) {
        for (const Eigen::Vector3d& end : {glass, back}) {
          const double sight = corner.x() * (end.z() - g_.pupil) / (corner.z() - g_.pupil);
          most = std::max(most, sight + kBesideSight - end.x());
        }
      }
    }
    return most;
  }

  const Parameters& p_;
  const Geometry& g_;
  std::vector<Complaint> found_;
};

}  // namespace

std::vector<Complaint> part_complaints(const Parameters& parameters, const Geometry& geometry) {
  return PartChecker(parameters, geometry).run();
}

double buckling_deflection(double length, double mean_diameter) {
  constexpr double kGOverE = 0.385;  // of steel, Poisson ratio 0.3
  const double slender = std::numbers::pi * mean_diameter / length;
  const double under = 1 - (1 - kGOverE) / (0.5 + kGOverE) * slender * slender;
  if (under < 0) return std::numeric_limits<double>::infinity();
  return length * 0.5 / (1 - kGOverE) * (1 - std::sqrt(under));
}

}  // namespace tagwrench::hardware

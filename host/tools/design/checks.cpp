#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/tools/design/geometry.h"
#include "host/tracker/acquire.h"

namespace tagwrench::hardware {
namespace {

constexpr double kToMm = 1e3;
constexpr double kImageMargin_px = 4;
constexpr double kMinTag_px = 60;      // of the black square: below, bits and noise suffer
constexpr double kSpringGap = 0.3e-3;  // between a spring and a line of sight
constexpr double kFromSolid = 0.3e-3;  // between coils in all, at the stop
constexpr double kMinWalls = 2;        // nozzle widths
constexpr double kNothing = 1e-9;      // rounding
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

/// Distance between the segments a..b and c..d.
double distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d) {
  // Ericson, Real-Time Collision Detection, 5.1.9, minimises the same quadratic.
  const Eigen::Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w),
               vw = v.dot(w);
  const double det = uu * vv - uv * uv;
  double s = det > 1e-18 ? std::clamp((uv * vw - vv * uw) / det, 0.0, 1.0) : 0.0;
  double t = (uv * s + vw) / vv;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
  }
  return (w + s * u - t * v).norm();
}

class Checker {
 public:
  Checker(const Parameters& p, const Geometry& g) : p_(p), g_(g) {}

  std::vector<Complaint> run() {
    prints();
    fits();
    springs();
    lens();
    threads();
    cover();
    p_.mount.puck ? base() : ears();
    if (g_.mirror) mirror();
    if (found_.empty()) views();
    return std::move(found_);
  }

 private:
  template <typename... Args>
  void say(const char* parameter, fmt::format_string<Args...> message, Args&&... args) {
    found_.push_back({parameter, fmt::format(message, std::forward<Args>(args)...)});
  }

  void wall(const char* parameter, double thickness) {
    const double least = kMinWalls * p_.printing.nozzle;
    if (thickness < least)
      say(parameter,
          "{:.2f} mm is thinner than two lines of the {:.2f} mm nozzle; take {:.2f} mm or more",
          kToMm * thickness, kToMm * p_.printing.nozzle, kToMm * least);
  }

  void prints() {
    wall("print.wall_mm", p_.printing.wall);
    wall("cover.wall_mm", p_.cover.wall);
    wall("top.plate_mm", p_.top.plate - p_.springs.socket);
    if (p_.light.diffuser < p_.printing.layer)
      say("light.diffuser_mm", "{:.2f} mm is less than a layer of {:.2f} mm",
          kToMm * p_.light.diffuser, kToMm * p_.printing.layer);
  }

  /// In the plane: lens, springs, LED, walls of the cover.
  void fits() {
    const double spring = 0.5 * p_.springs.outer_diameter + p_.printing.clearance;
    const double half_x = 0.5 * p_.springs.spacing_x, half_y = 0.5 * p_.springs.spacing_y;
    const auto reach = [&](char axis, double socket, double edge) {
      if (socket + p_.cover.wall <= edge) return;
      say("springs.spacing_mm",
          "the sockets reach to {0} = {1:.1f} mm, the cover with its wall only to {2:.1f} mm; "
          "bring the springs together or widen cover.{0}_mm",
          axis, kToMm * socket, kToMm * (edge - p_.cover.wall));
    };
    reach('x', half_x + spring, std::min(p_.cover.x_to, -p_.cover.x_from));
    reach('y', half_y + spring, p_.cover.y_half);
    if (std::hypot(half_x, half_y) < g_.bore + spring + p_.printing.nozzle)
      say("springs.spacing_mm",
          "springs of {:.2f} mm stand in the way of a lens holder of {:.1f} mm; take them {:.1f} "
          "mm from the middle at least",
          kToMm * p_.springs.outer_diameter, kToMm * p_.camera.lens_diameter,
          kToMm * (g_.bore + spring + p_.printing.nozzle));
    const double led = std::abs(p_.light.x) - 0.5 * p_.light.width;
    if (std::abs(p_.light.y) < g_.bore && led < g_.bore + p_.printing.nozzle)
      say("light.position_mm",
          "the LED's seat begins {:.1f} mm from the middle, in the hole for the lens, which ends "
          "at {:.1f} mm; move it out",
          kToMm * led, kToMm * g_.bore);
    const double led_end = led + p_.light.width + p_.cover.wall;
    const double end = p_.light.x < 0 ? -p_.cover.x_from : p_.cover.x_to;
    if (led_end > end)
      say("light.position_mm",
          "the LED's seat leaves less than a wall to the cover's end; move it in by {:.1f} mm or "
          "lengthen cover.x_mm",
          kToMm * (led_end - end));
    const double knob =
        2 * (std::hypot(std::max(g_.inner_x_to, -g_.inner_x_from), g_.inner_y) + p_.printing.wall);
    if (p_.top.knob && p_.top.knob_diameter < knob)
      say("top.knob_mm",
          "{:.1f} mm do not go around the cover and its travel; take {:.1f} mm or more",
          kToMm * p_.top.knob_diameter, kToMm * knob);
    const auto plate = [&](const char* cover, double half, double inner, const char* as,
                           const char* more) {
      if (half + p_.printing.clearance <= inner) return;
      say(cover,
          "the plate on the springs, {:.1f} mm {}, does not fit into the shield; make the cover {}",
          kToMm * 2 * half, as, more);
    };
    plate("cover.x_mm", g_.plate_x, std::min(-g_.inner_x_from, g_.inner_x_to), "long",
          "longer at its shorter side");
    plate("cover.y_mm", g_.plate_y, g_.inner_y, "wide", "wider");
    if (p_.stops.gap < std::max(p_.stops.x, p_.stops.y))
      say("stops.gap_mm",
          "the walls are {:.1f} mm from the cover and meet it before the stop screws do; take "
          "{:.1f} mm or more",
          kToMm * p_.stops.gap, kToMm * std::max(p_.stops.x, p_.stops.y));
    stop_slots();
  }

  /// What the stop screws reach into.
  void stop_slots() {
    const double least = 2 * p_.printing.nozzle;
    for (const Geometry::StopScrew& screw : g_.stop_screws) {
      const bool back = screw.along == 0;
      const double bottom = back ? g_.shield_bottom_x : g_.shield_bottom_y;
      const double under = screw.at.z() - 0.5 * p_.stops.screw - bottom;
      if (under < least - kNothing) {
        say("stops.z_mm",
            "the stop screws sit {:.1f} mm too low for the wall that they go through; lengthen "
            "target.lens_distance_mm, or take less travel, a lower cover.ledge_mm or shorter "
            "springs",
            kToMm * (least - under));
        break;
      }
    }
    for (const Geometry::StopScrew& screw : g_.stop_screws) {
      const bool back = screw.along == 0;
      const double travel = back ? p_.stops.x : p_.stops.y;
      const double across = 0.5 * p_.stops.screw + (back ? p_.stops.y : p_.stops.x);
      const double inner = std::abs(screw.at[screw.along]) - screw.reach - travel;
      const double beside = std::max(0.0, std::abs(screw.at[1 - screw.along]) - across);
      if (inner < 0 || std::hypot(inner, beside) < g_.bore + least - kNothing) {
        say(back ? "stops.x_mm" : "stops.y_mm",
            "at the end of the travel the stop screw, {:.1f} mm deep in the cover, touches the "
            "lens; take less travel or a {} cover",
            kToMm * (screw.reach + travel), back ? "longer" : "wider");
        break;
      }
    }
  }

  void springs() {
    const double least = g_.spring_clear - deepest();
    const double solid = g_.spring_solid - 2 * p_.springs.socket;
    if (!(g_.spring_solid > 0) || g_.spring_solid >= p_.springs.free_length) {
      say("springs.wire_mm",
          "with {:.2f} mm of wire, {:.2f} mm wide and {:.2f} N/mm the coils would be {:.1f} mm "
          "long when closed, of {:.1f} mm in all; check the spring's numbers",
          kToMm * p_.springs.wire, kToMm * p_.springs.outer_diameter, p_.springs.axial / kToMm,
          kToMm * g_.spring_solid, kToMm * p_.springs.free_length);
      return;
    }
    if (least - kFromSolid < std::max(0.0, solid))
      say("stops.z_mm",
          "the springs' coils close after {:.2f} mm, before the stops at {:.2f} mm; take less "
          "travel or longer springs",
          kToMm * (p_.springs.free_length - g_.spring_solid - kFromSolid), kToMm * deepest());
    const double sideways =
        buckling_deflection(g_.spring_clear, p_.springs.outer_diameter - p_.springs.wire);
    if (deepest() > sideways)
      say("springs.free_length_mm",
          "the springs give way sideways when shortened by {:.1f} mm, the stops are at {:.1f} mm; "
          "take shorter or wider springs, or less stops.z_mm",
          kToMm * sideways, kToMm * deepest());
  }

  /// Most that a spring is shortened over the travel.
  double deepest() const {
    double most = 0;
    for (const Vector6& d : travel_corners(p_, g_)) {
      for (const Eigen::Vector2d& at : g_.springs) {
        const Eigen::Vector3d top(at.x(), at.y(), 0);
        most = std::max(most, -(d.head<3>() + d.tail<3>().cross(top)).z());
      }
    }
    return most;
  }

  void lens() {
    double nearest = p_.target.lens_distance;
    for (const TagPlace& tag : g_.tags)
      if (!tag.in_mirror)
        nearest = std::min(nearest, p_.target.lens_distance + tag.platform_T_tag.translation().z());
    if (nearest < p_.camera.nearest_focus)
      say("target.lens_distance_mm",
          "{:.1f} mm is nearer than {} focuses ({:.0f} mm); take a longer distance or another "
          "camera",
          kToMm * nearest, p_.camera.name, kToMm * p_.camera.nearest_focus);
    const double tag_px = p_.camera.image.fx_px * p_.target.tag_size / p_.target.lens_distance;
    if (tag_px < kMinTag_px)
      say("target.tag_size_mm",
          "tags of {:.2f} mm are {:.0f} px wide at {:.1f} mm, {:.0f} are needed; take larger tags, "
          "a shorter target.lens_distance_mm, or a camera of more pixels",
          kToMm * p_.target.tag_size, tag_px, kToMm * p_.target.lens_distance, kMinTag_px);
    Geometry plain = g_;  // the real papers at rest, none mirrored
    plain.mirror.reset();
    double lowest = g_.platform;
    for (const Eigen::Vector3d& corner : paper_corners(p_, plain, Vector6::Zero()))
      lowest = std::min(lowest, corner.z());
    if (lowest - p_.stops.z < g_.lens_front + 1e-3)
      say("target.lens_distance_mm",
          "at the end of the travel the tags are {:.1f} mm from the lens; take a longer distance "
          "or less stops.z_mm",
          kToMm * (lowest - p_.stops.z - g_.lens_front));
  }

  void views() {
    bool outside = false, behind_spring = false, behind_plate = false, behind_cover = false;
    double most_outside = 0;
    for (const Vector6& d : travel_corners(p_, g_)) {
      for (const Eigen::Vector3d& corner : paper_corners(p_, g_, d)) {
        const Eigen::Vector2d at = seen_at(p_, g_, corner);
        const double out = std::max({kImageMargin_px - at.x(), kImageMargin_px - at.y(),
                                     at.x() - (p_.camera.image.width_px - 1 - kImageMargin_px),
                                     at.y() - (p_.camera.image.height_px - 1 - kImageMargin_px)});
        if (!(out <= 0)) outside = true;
        most_outside = std::max(most_outside, out);
        behind_spring = behind_spring || spring_between(d, corner);
        behind_cover = behind_cover || cover_between(corner);
      }
      behind_plate = behind_plate || plate_between(d);
    }
    if (outside)
      say("target.lens_distance_mm",
          "at the end of the travel a tag leaves the picture by {:.0f} px; take a longer distance, "
          "smaller target.tag_size_mm or less travel in stops",
          most_outside);
    if (behind_spring)
      say("springs.spacing_mm", "at the end of the travel a spring hides a tag; move them apart");
    if (behind_cover)
      say("camera.lens_diameter_mm",
          "the cover's hole for the lens cuts into the view of the tags; the lens sits too deep: "
          "lengthen target.lens_distance_mm or shorten the springs");
    if (behind_plate)
      say("top.plate_mm", "the edge of the plate's opening hides a tag at the end of the travel");
  }

  bool spring_between(const Vector6& d, const Eigen::Vector3d& corner) const {
    const Eigen::Vector3d eye(0, 0, g_.pupil);
    const Eigen::Isometry3d pose = platform_pose(g_, d);
    return std::any_of(g_.springs.begin(), g_.springs.end(), [&](const Eigen::Vector2d& at) {
      const Eigen::Vector3d foot(at.x(), at.y(), g_.cover_top);
      const Eigen::Vector3d head = pose * Eigen::Vector3d(at.x(), at.y(), 0);
      return distance(eye, corner, foot, head) < 0.5 * p_.springs.outer_diameter + kSpringGap;
    });
  }

  bool cover_between(const Eigen::Vector3d& corner) const {
    if (g_.cover_top <= g_.pupil) return false;
    const double share = (g_.cover_top - g_.pupil) / (corner.z() - g_.pupil);
    return share * corner.head<2>().norm() > g_.bore;
  }

  /// The plate's opening moves with the tags; only what is behind the plate can be hidden by it.
  bool plate_between(const Vector6& d) const {
    const Eigen::Isometry3d platform_T_drawing = platform_pose(g_, d).inverse();
    const Eigen::Vector3d eye = platform_T_drawing * Eigen::Vector3d(0, 0, g_.pupil);
    for (const Eigen::Vector3d& there : paper_corners(p_, g_, d)) {
      const Eigen::Vector3d corner = platform_T_drawing * there;
      const double plate = g_.plate_bottom - g_.platform;
      if (corner.z() <= plate) continue;
      const Eigen::Vector3d through =
          eye + (plate - eye.z()) / (corner.z() - eye.z()) * (corner - eye);
      if (std::abs(through.x()) > g_.window_x || std::abs(through.y()) > g_.window_y) return true;
    }
    return false;
  }

  // Whether each printed part holds what is put into it.

  void thread(const char* parameter, double hole, double screw) {
    if (hole < screw - kNothing) return;
    say(parameter, "a hole of {:.1f} mm gives a screw of {:.1f} mm no thread; take about {:.1f} mm",
        kToMm * hole, kToMm * screw, 0.85 * kToMm * screw);
  }

  void threads() {
    thread("stops.thread_hole_mm", p_.stops.thread_hole, p_.stops.screw);
    thread("top.thread_hole_mm", p_.top.thread_hole, p_.top.screw);
    thread("cover.thread_hole_mm", p_.cover.thread_hole, p_.camera.hole);
    const double least = kCountersink + 2 * p_.printing.layer;
    if (p_.top.roof < least - kNothing)
      say("top.roof_mm",
          "{:.1f} mm leave nothing under the heads of the screws; take {:.1f} mm or more",
          kToMm * p_.top.roof, kToMm * least);
  }

  void cover() {
    const bool board = p_.camera.body == CameraBody::board;
    const double foot = board ? g_.board_top : p_.mount.thickness;
    const double rim = g_.ledge - std::max(g_.overhang_x, g_.overhang_y) - foot;
    if (rim < kRim - kNothing) {
      say("cover.ledge_mm",
          "the ledge slopes at 45 degrees to what the camera's board stands out, and ends {:.1f} "
          "mm thin; make it {:.1f} mm or more",
          kToMm * rim, kToMm * (p_.cover.ledge + kRim - rim));
    } else if (g_.bolt_length - foot < kMinBoltThread - kNothing) {
      say("cover.ledge_mm",
          "the bolts find {:.1f} mm of thread in the cover, {:.0f} are needed; make the ledge "
          "{:.1f} mm or more",
          std::max(0.0, kToMm * (g_.bolt_length - foot)), kToMm * kMinBoltThread,
          kToMm * (p_.cover.ledge + kMinBoltThread - (g_.bolt_length - foot)));
    }
    const double room = g_.cover_top - foot - p_.light.diffuser;
    if (p_.light.height > room)
      say("light.height_mm",
          "{:.1f} mm do not fit under the diffuser, where there are {:.1f} mm; take a flatter LED",
          kToMm * p_.light.height, kToMm * room);
    for (const Eigen::Vector2d& at : g_.bolts) {
      const double clear = at.norm() - g_.bore - 0.5 * p_.camera.hole;
      if (clear >= p_.cover.wall - kNothing) continue;
      say("camera",
          "a mounting hole of {} is {:.1f} mm from the hole for its lens, a wall of {:.1f} mm is "
          "needed; check hole_spacing_mm and lens_diameter_mm",
          p_.camera.name, kToMm * clear, kToMm * p_.cover.wall);
      break;
    }
  }

  void ears() {
    const double foot = std::max(0.5 * p_.camera.depth, p_.cover.y_half);
    const double inside = 0.5 * p_.mount.width - kEarEdge - p_.mount.hole;
    if (inside < foot + p_.printing.clearance)
      say("mount.width_mm", "the holes in the ears are under the cover; take {:.0f} mm or more",
          std::ceil(2 * kToMm * (foot + p_.printing.clearance + kEarEdge + p_.mount.hole)));
  }

  void base() {
    double least = kBaseLeast;
    if (p_.top.knob)
      least = std::max(least,
                       p_.top.knob_diameter + 2 * (kRimOutside + kBaseScrewHead + kBaseScrewInset));
    if (p_.mount.width < least - kNothing)
      say("mount.width_mm",
          "a base of {:.0f} mm has no room for knob, screws and the board with its plug; take "
          "{:.0f} mm or more",
          kToMm * p_.mount.width, std::ceil(kToMm * least));
    if (p_.mount.bay_height < kBayLeast)
      say("mount.bay_height_mm", "{:.1f} mm are too low for the board; take {:.0f} mm or more",
          kToMm * p_.mount.bay_height, kToMm * kBayLeast);
    const double radius = 0.5 * p_.mount.width - kBaseWall;
    const double most = (1 - kBoardShare) * std::numbers::pi * radius * radius *
                        std::max(0.0, p_.mount.bay_height - kBaseWall) * kWeightDensity;
    if (p_.mount.weight > most)
      say("mount.weight_g",
          "{:.0f} g of steel do not fit beside the board, about {:.0f} g do; take less, or a wider "
          "mount.width_mm",
          kToMm * p_.mount.weight, kToMm * most);
  }

  void mirror() {
    const Mirror& m = *g_.mirror;
    const double beside = m.half_y + kCheek + p_.stops.y + 0.5 * p_.springs.outer_diameter;
    if (0.5 * p_.springs.spacing_y < beside)
      say("springs.spacing_mm",
          "the mirror's holder needs {:.1f} mm between the springs across (y), plus their width "
          "and travel: {:.1f} mm from axis to axis",
          kToMm * 2 * (m.half_y + kCheek), kToMm * 2 * beside);
    const double top = m.centre.z() + (m.half_slope + kGlassAndBack) * std::sqrt(0.5);
    if (top + p_.stops.z > g_.plate_bottom)
      say("stops.z_mm",
          "at the end of the travel the plate meets the mirror, {:.1f} mm too high; take less "
          "travel or a smaller target.tag_size_mm",
          kToMm * (top + p_.stops.z - g_.plate_bottom));
    if (p_.cover.x_to < g_.bore + kHolderFoot)
      say("cover.x_mm",
          "the mirror's holder stands out to x = {:.1f} mm, the cover ends at {:.1f} mm; lengthen "
          "it",
          kToMm * (g_.bore + kHolderFoot), kToMm * p_.cover.x_to);
    const double hidden = behind_holder();
    if (hidden > kNothing)
      say("target.ridge_gap_mm",
          "at the end of the travel the mirror's holder hides the flat tag, {:.2f} mm too near to "
          "its line of sight; take {:.2f} mm or more, or less stops.x_mm",
          kToMm * hidden, kToMm * (p_.target.ridge_gap + hidden));
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

std::vector<Complaint> complaints(const Parameters& parameters, const Geometry& geometry) {
  return Checker(parameters, geometry).run();
}

Eigen::Vector2d seen_at(const Parameters& p, const Geometry& g, const Eigen::Vector3d& point) {
  const CameraModel& camera = p.camera.image;
  const double away = point.z() - g.pupil;
  return {camera.cx_px + camera.fx_px * point.x() / away,
          camera.cy_px + camera.fy_px * point.y() / away};
}

std::vector<Eigen::Vector3d> paper_corners(const Parameters& p, const Geometry& g,
                                           const Vector6& displacement) {
  const Eigen::Isometry3d pose = platform_pose(g, displacement);
  const double half = 0.5 * p.target.tag_size + p.target.border;
  std::vector<Eigen::Vector3d> out;
  for (const TagPlace& tag : g.tags) {
    for (const Eigen::Vector3d& on_tag : square_corners(half)) {
      const Eigen::Vector3d corner = pose * (tag.platform_T_tag * on_tag);
      out.push_back(tag.in_mirror && g.mirror ? g.mirror->behind(corner) : corner);
    }
  }
  return out;
}

double buckling_deflection(double length, double mean_diameter) {
  constexpr double kGOverE = 0.385;  // of steel, Poisson ratio 0.3
  const double slender = std::numbers::pi * mean_diameter / length;
  const double under = 1 - (1 - kGOverE) / (0.5 + kGOverE) * slender * slender;
  if (under < 0) return std::numeric_limits<double>::infinity();
  return length * 0.5 / (1 - kGOverE) * (1 - std::sqrt(under));
}

}  // namespace tagwrench::hardware

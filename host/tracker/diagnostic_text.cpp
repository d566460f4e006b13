#include "host/tracker/diagnostic_text.h"

#include <fmt/format.h>

#include <cmath>

namespace tagwrench {
namespace {

/// "tag 5", "tags 5 and 2", "tags 5, 2 and 7".
std::string tags(const DiagnosticDetails::Ids& ids) {
  std::string text = ids.count == 1 ? "tag" : "tags";
  for (std::size_t i = 0; i < ids.count; ++i) {
    const char* before = i == 0 ? " " : i + 1 == ids.count ? " and " : ", ";
    text += before + std::to_string(ids.id[i]);
  }
  return text;
}

const char* is(const DiagnosticDetails::Ids& ids) { return ids.count == 1 ? "is" : "are"; }

std::string from_rest(const DiagnosticDetails& d) {
  const Eigen::Vector3d mm = d.offset.head<3>() * 1e3;
  return fmt::format("{:.1f} mm (x {:+.1f}, y {:+.1f}, z {:+.1f}) and {:.0f} degrees from",
                     mm.norm(), mm.x(), mm.y(), mm.z(), d.offset.tail<3>().norm() * 180 / M_PI);
}

std::string other_scale(const DiagnosticDetails& d) {
  return fmt::format(
      "{} are {:.0f} % {} than target.tag_size_mm in sensor.yaml for the distance between them; "
      "measure the print (100 %?), or place the tags anew with `tagwrench calibrate target`",
      tags(d.concerned), 100 * std::abs(d.amount - 1), d.amount > 1 ? "larger" : "smaller");
}

std::string rest_elsewhere(const DiagnosticDetails& d) {
  return fmt::format("{} {} seen, but the target is {} {}, farther than its springs let it go; {}",
                     tags(d.seen), is(d.seen), from_rest(d),
                     d.rest_given ? "rest as sensor.yaml has it" : "where it was at rest",
                     d.rest_given ? "run `tagwrench calibrate target`, or put camera and platform "
                                    "back"
                                  : "put camera and platform back, or start again");
}

std::string picture(Diagnostic diagnostic, const DiagnosticDetails& d) {
  switch (diagnostic) {
    case Diagnostic::image_black:
      return fmt::format(
          "the image is black (its brightest parts have grey level {:.0f} of 255); is the lens cap "
          "off, the LED on, the exposure long enough?",
          d.amount);
    case Diagnostic::image_saturated:
      return fmt::format(
          "{:.0f} % of the image is white (saturated); shorten the camera's exposure or dim the "
          "light",
          100 * d.amount);
    case Diagnostic::image_empty:
      return fmt::format(
          "the image shows nothing but smooth grey (up to level {:.0f} of 255); is something right "
          "before the lens, or the focus lost?",
          d.amount);
    case Diagnostic::image_unsharp:
      return fmt::format(
          "the image is not sharp (its edges are blurred over {:.0f} pixels); focus the lens on "
          "the tags, and turn its autofocus off",
          2 * d.amount);
    default:
      return fmt::format(
          "no tag is seen, neither {} of {} nor any other; are they in view, whole, flat and with "
          "their white margin?",
          tags(d.expected), d.expected_family);
  }
}

}  // namespace

std::string diagnostic_text(Diagnostic diagnostic, const DiagnosticDetails& d) {
  switch (diagnostic) {
    case Diagnostic::none:
      return {};
    case Diagnostic::image_looks_mirrored:
      return "the image looks mirrored (tags decode only when it is flipped left to right); set "
             "camera.mirrored: true in sensor.yaml, unless the tags themselves are printed "
             "mirrored";
    case Diagnostic::image_looks_unmirrored:
      return "the image does not look mirrored, but sensor.yaml says so; set camera.mirrored: "
             "false in sensor.yaml";
    case Diagnostic::rest_learned:
      return "rest pose learned; the wrench counts from here";
    case Diagnostic::moved_while_learning:
      return "the platform moved while its rest pose was learned; let it rest for a moment";
    case Diagnostic::appearance_does_not_fit:
      return "the target does not look like its picture at rest (light, focus, dirt or another "
             "lens?); run `tagwrench calibrate target`, or remove the picture";
    case Diagnostic::far_from_rest:
      return fmt::format(
          "the target stands still {} rest as sensor.yaml has it; if nothing presses on it, run "
          "`tagwrench calibrate target`",
          from_rest(d));
    case Diagnostic::shutter_rolls:
      return "pictures are sheared when the platform moves: the camera exposes row by row (rolling "
             "shutter); set camera.readout_ms in sensor.yaml (`tagwrench calibrate target` "
             "measures it)";
    case Diagnostic::image_black:
    case Diagnostic::image_saturated:
    case Diagnostic::image_empty:
    case Diagnostic::image_unsharp:
    case Diagnostic::no_tag:
      return picture(diagnostic, d);
    case Diagnostic::wrong_family:
      return fmt::format(
          "{} of {} {} seen, but sensor.yaml has {} of {}; correct target.family and target.tags, "
          "or print the tags it names",
          tags(d.seen), d.family, is(d.seen), tags(d.expected), d.expected_family);
    case Diagnostic::wrong_ids:
      return fmt::format(
          "{} {} seen, but sensor.yaml has {}; correct target.tags, or show the tags it names",
          tags(d.seen), is(d.seen), tags(d.expected));
    case Diagnostic::tag_missing:
      return fmt::format(
          "{} {} seen, {} {} not; uncover it, bring it into view and light, or take it out of "
          "target.tags in sensor.yaml",
          tags(d.seen), is(d.seen), tags(d.concerned), is(d.concerned));
    case Diagnostic::tag_twice:
      return fmt::format(
          "{} {} seen in two places at once; take the one that is not the sensor's out of view",
          tags(d.concerned), is(d.concerned));
    case Diagnostic::tag_printed_mirrored:
      return fmt::format("{} {} printed mirrored ({} as it should be); print anew, not mirrored",
                         tags(d.concerned), is(d.concerned), tags(d.seen));
    case Diagnostic::other_scale:
      return other_scale(d);
    case Diagnostic::other_places:
      return fmt::format(
          "{} sit differently to each other than target.tags in sensor.yaml says (swapped, turned "
          "or glued anew?); run `tagwrench calibrate target`",
          tags(d.concerned));
    case Diagnostic::rest_elsewhere:
      return rest_elsewhere(d);
  }
  return {};
}

}  // namespace tagwrench

#include "host/commands/check_text.h"

#include <fmt/format.h>

#include "host/core/axis_names.h"

namespace tagwrench {
namespace {

constexpr const char* kAgain = "`tagwrench calibrate target`, then `tagwrench calibrate wrench`";

const char* name(Subject subject) {
  switch (subject) {
    case Subject::light:
      return "light";
    case Subject::focus:
      return "focus";
    case Subject::tags:
      return "tags";
    case Subject::residual:
      return "residual";
    case Subject::zero:
      return "zero";
    case Subject::scale:
      return "scale";
  }
  return "?";
}

std::string moved(const Vector6& move) {
  return fmt::format("by {:.1f} um ({:+.1f} {:+.1f} {:+.1f}) and {:.1f} mrad",
                     move.head<3>().norm() * 1e6, move[0] * 1e6, move[1] * 1e6, move[2] * 1e6,
                     move.tail<3>().norm() * 1e3);
}

std::string fine(const InSituFinding& f) {
  switch (f.subject) {
    case Subject::light:
      return fmt::format("the tags' white is at {:.0f} of 255; {:.0f} when calibrated", f.amount,
                         f.expected);
    case Subject::focus:
      return fmt::format("the variance of the edges' blur has changed by {:+.2f} px^2", f.amount);
    case Subject::tags:
      return fmt::format("they agree to {:.1f} um and {:.1f} mrad", f.move.head<3>().norm() * 1e6,
                         f.move.tail<3>().norm() * 1e3);
    case Subject::residual:
      return fmt::format("{:.1f} % of the contrast is not explained by the picture at rest",
                         100 * f.amount);
    case Subject::zero:
      return fmt::format("reads {:+.2f} % of the range on {}", 100 * f.amount, kWrenchAxes[f.axis]);
    case Subject::scale:
      return fmt::format("measured / known = {:.4f} +/- {:.4f}", f.amount, f.sigma);
  }
  return "";
}

std::string not_known(Subject subject) {
  switch (subject) {
    case Subject::tags:
      return "one tag alone: nothing tells whether it has slipped";
    case Subject::zero:
      return "cannot be told: the tags disagree or are not held (see above), or no range is known";
    case Subject::scale:
      return "the load did not act long enough, or far too little";
    case Subject::light:
    case Subject::focus:
    case Subject::residual:
      break;
  }
  return "no tag is held: see the other lines";
}

std::string wrong(const InSituFinding& f) {
  switch (f.fault) {
    case Fault::too_dark:
      return fmt::format(
          "too dark: the tags' white is at {:.0f} of 255, at {:.0f} when calibrated: mend the "
          "light, "
          "or let `run --board` set it",
          f.amount, f.expected);
    case Fault::too_bright:
      return fmt::format(
          "too bright: {:.0f} % of the tags are clipped, {:.0f} % when calibrated: less light or a "
          "shorter exposure",
          100 * f.amount, 100 * f.expected);
    case Fault::out_of_focus:
      if (f.expected > 0) {
        return fmt::format(
            "out of focus: edges are blurred by {:.1f} px, by {:.1f} when calibrated: focus again; "
            "if it stays, {}",
            f.amount, f.expected, kAgain);
      }
      return fmt::format(
          "the lens has moved: the variance of the edges' blur has changed by {:+.2f} px^2: focus "
          "again; if it stays, {}",
          f.amount, kAgain);
    case Fault::tag_not_seen:
      return fmt::format(
          "tag {} is not held: is it covered, dirty, out of focus or loose? then check again",
          f.tag);
    case Fault::tag_moved:
      return fmt::format("tag {} has moved {} against the other: fix it, then {}", f.tag,
                         moved(f.move), kAgain);
    case Fault::some_tag_moved:
      return fmt::format("a tag has moved {} against another, perhaps tag {}: fix them, then {}",
                         moved(f.move), f.tag, kAgain);
    case Fault::residual_grown:
      return fmt::format(
          "{:.1f} % of tag {}'s contrast is not explained by the picture at rest (up to {:.0f} % "
          "is "
          "fine): clean tag and lens, look for glare; if it stays, {}",
          100 * f.amount, f.tag, 100 * f.expected, kAgain);
    case Fault::zero_drifted:
      return fmt::format("reads {:+.1f} % of the range on {} with hands off: `tagwrench zero`",
                         100 * f.amount, kWrenchAxes[f.axis]);
    case Fault::rest_elsewhere:
      return fmt::format(
          "reads {:+.0f} % of the range on {} with hands off, too far for drift: take off what "
          "lies "
          "on it; in another mounting, {}",
          100 * f.amount, kWrenchAxes[f.axis], kAgain);
    case Fault::scale_wrong:
      return fmt::format(
          "measured / known = {:.4f} +/- {:.4f}: `tagwrench calibrate wrench`, if the load is "
          "right",
          f.amount, f.sigma);
    case Fault::load_elsewhere:
      return fmt::format(
          "{:.0f} % of the range on {} is not what this load does (scale {:.3f}): check where it "
          "takes hold and which way it pulls (--at, --gravity, --direction); if they are right, "
          "`tagwrench calibrate wrench`",
          100 * f.expected, kWrenchAxes[f.axis], f.amount);
    case Fault::none:
    case Fault::not_known:
      break;
  }
  return "";
}

}  // namespace

std::string text(const InSituFinding& finding) {
  const bool unknown = finding.fault == Fault::not_known;
  return fmt::format("{:<7}{:<10}{}",
                     finding.fine() ? "fine"
                     : unknown      ? "?"
                                    : "OFF",
                     name(finding.subject),
                     finding.fine() ? fine(finding)
                     : unknown      ? not_known(finding.subject)
                                    : wrong(finding));
}

}  // namespace tagwrench

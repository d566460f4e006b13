#include "host/tracker/diagnostics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include "host/core/count_text.h"
#include "host/tracker/acquire.h"
#include "host/tracker/picture_quality.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

/// Times that cameras take from the first row to the last, in kUnit.
constexpr double kUnit = 10e-3;  // s
constexpr double kReadouts[] = {1, 2, 3, 4};
/// A shear must be seen to be mended: motion of the platform in the image during kUnit, px.
constexpr double kMinMotion_px = 0.5;
constexpr int kEnough = 8;         ///< pictures mended
constexpr double kMaxOfAll = 0.5;  ///< of the pictures tried

using std::chrono::milliseconds;

/// A hand that passes by says nothing: the first look comes this late, and two must agree.
constexpr Duration kFirstLook = milliseconds(300);
constexpr Duration kBetweenLooks = milliseconds(400);
/// So long a line can be read before the next one comes.
constexpr Duration kQuiet = milliseconds(2000);

constexpr int kBlack = 40;           ///< grey levels
constexpr int kEvenContrast = 25;    ///< grey levels
constexpr double kMaxWhite = 0.4;    ///< of the picture
constexpr double kUnsharp_px = 4.5;  ///< tags of the published size decode up to about this blur

constexpr double kOtherScale = 0.03;  ///< beside what is said not to be known of it
constexpr double kSameScale = 0.01;   ///< motion shears a rolling shutter's picture, never alike
/// Between tags, as four corners each tell it: rad.
constexpr double kOtherTurn = 0.25;
constexpr double kOtherDirection = 0.2;

/// Frames in a row that a given picture of the target may fail to fit before it is called wrong.
constexpr int kMisfits = 15;

/// Frames in a row that show another tag before it is said.
constexpr int kOtherPrints = 5;

/// Farther from a given reference pose than anybody seats a platform twice: m and rad; how long it
/// stands there; and how long it must stand near it for the pose to be right.
constexpr double kFar = 0.3e-3;
constexpr double kFarAngle = 0.026;
constexpr Duration kStillTime = milliseconds(1500);
constexpr Duration kSettling = milliseconds(200);

bool holds(const DiagnosticDetails::Ids& ids, int id) {
  return std::find(ids.id.begin(), ids.id.begin() + ids.count, id) != ids.id.begin() + ids.count;
}

/// How two tags sit to each other, as seen against as described.
struct PairMisfit {
  double scale = 1;  ///< size of the tags over what was described, if the distance is right
  double turn = 0;   ///< rad
  double direction = 0;

  double total() const { return turn + direction; }
  bool elsewhere() const { return turn > kOtherTurn || direction > kOtherDirection; }
};

/// Of the poses that the corners of each tag allow, those that fit best.
std::optional<PairMisfit> compare(const FoundTag& a, const FoundTag& b,
                                  const Eigen::Isometry3d& platform_T_a,
                                  const Eigen::Isometry3d& platform_T_b) {
  const Eigen::Isometry3d described = platform_T_a.inverse() * platform_T_b;
  std::optional<PairMisfit> best;
  for (const Eigen::Isometry3d& camera_T_a : a.camera_T_tag) {
    for (const Eigen::Isometry3d& camera_T_b : b.camera_T_tag) {
      const Eigen::Isometry3d seen = camera_T_a.inverse() * camera_T_b;
      const double distance = seen.translation().norm();
      const double described_distance = described.translation().norm();
      if (!(distance > 0) || !(described_distance > 0)) continue;
      PairMisfit misfit;
      misfit.scale = described_distance / distance;
      misfit.turn = rotation_to_vector(seen.linear() * described.linear().transpose()).norm();
      misfit.direction = std::acos(std::clamp(
          seen.translation().dot(described.translation()) / distance / described_distance, -1.0,
          1.0));
      if (!best || misfit.total() < best->total()) best = misfit;
    }
  }
  return best;
}

/// Are tags where the description has them, to each other and to the reference? A cause if not.
Diagnostic judge_geometry(const TargetDescription& target, const KnownReference& reference,
                          const Finding& finding, DiagnosticDetails& details) {
  const std::vector<FoundTag>& tags = finding.tags;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    for (std::size_t j = i + 1; j < tags.size(); ++j) {
      const auto& platform_T_a = target.tags[tags[i].index].platform_T_tag;
      const auto& platform_T_b = target.tags[tags[j].index].platform_T_tag;
      if (!platform_T_a || !platform_T_b) continue;
      const auto misfit = compare(tags[i], tags[j], *platform_T_a, *platform_T_b);
      if (!misfit) continue;
      details.concerned = {};
      details.concerned.add(target.tags[tags[i].index].id);
      details.concerned.add(target.tags[tags[j].index].id);
      details.amount = misfit->scale;
      if (misfit->elsewhere()) return Diagnostic::other_places;
      if (std::abs(misfit->scale - 1) > kOtherScale + 2 * target.scale_sigma)
        return Diagnostic::other_scale;
    }
  }
  details.concerned = {};
  details.amount = 0;
  if (!reference.known) return Diagnostic::none;
  // The nearest of all poses that any tag allows: what is out of reach then is so beyond doubt.
  double nearest = 1e9;
  for (const FoundTag& tag : tags) {
    for (const Eigen::Isometry3d& camera_T_tag : tag.camera_T_tag) {
      const Eigen::Isometry3d pose = camera_T_tag * reference.platform_T_tag[tag.index].inverse();
      if (within_reach(reference.camera_T_platform, pose)) return Diagnostic::none;
      const Vector6 offset = motion_between(reference.camera_T_platform, pose);
      const double far =
          offset.head<3>().norm() / reference.camera_T_platform.translation().norm() +
          offset.tail<3>().norm();
      if (far >= nearest) continue;
      nearest = far;
      details.offset = offset;
      details.rest_given = reference.given;
    }
  }
  return nearest < 1e9 ? Diagnostic::rest_elsewhere : Diagnostic::none;
}

/// Light and focus, if they are so bad that tags may not be found.
Diagnostic judge_light(const PictureQuality& quality, DiagnosticDetails& details) {
  const auto because = [&](Diagnostic cause, double amount) {
    details.amount = amount;
    return cause;
  };
  const int bright = quality.bright_counts;
  if (bright < kBlack) return because(Diagnostic::image_black, bright);
  if (quality.white_fraction > kMaxWhite)
    return because(Diagnostic::image_saturated, quality.white_fraction);
  if (bright - quality.dark_counts < kEvenContrast) return because(Diagnostic::image_empty, bright);
  if (quality.blur_px > kUnsharp_px)
    return because(Diagnostic::image_unsharp, quality.blur_px.value_or(0));
  return Diagnostic::none;
}

/// Why not all of the target's tags are found.
Diagnostic judge_missing(const CameraModel& camera, const TargetDescription& target,
                         const ImageView& image, const Finding& finding,
                         DiagnosticDetails& details) {
  DiagnosticDetails::Ids mirrored;
  std::vector<ReadSquare> others;
  const std::span<const std::int16_t> missing(details.concerned.id.data(), details.concerned.count);
  const std::optional<FlippedImage> flipped =
      camera.mirrored ? std::optional<FlippedImage>(image) : std::nullopt;
  for (const ReadSquare& tag :
       read_squares(flipped ? flipped->view() : image, finding.squares, target.family, missing)) {
    if (tag.mirrored && !holds(mirrored, tag.id)) mirrored.add(tag.id);
    if (tag.family != target.family) others.push_back(tag);
  }
  if (mirrored.count > 0) {
    // All of them: the image is flipped, which is told elsewhere.
    if (finding.tags.empty()) return Diagnostic::none;
    details.concerned = mirrored;
    details.seen = {};
    for (const FoundTag& tag : finding.tags) details.seen.add(target.tags[tag.index].id);
    return Diagnostic::tag_printed_mirrored;
  }
  if (!finding.other_ids.empty()) return Diagnostic::wrong_ids;
  if (finding.tags.empty() && !others.empty()) {
    details.family = name(others.front().family);
    for (const ReadSquare& tag : others)
      if (tag.family == others.front().family && !holds(details.seen, tag.id))
        details.seen.add(tag.id);
    return Diagnostic::wrong_family;
  }
  const PictureQuality quality = picture_quality(image);
  if (const Diagnostic light = judge_light(quality, details); light != Diagnostic::none)
    return light;
  if (!finding.tags.empty()) return Diagnostic::tag_missing;
  details.amount = quality.bright_counts;
  return quality.blur_px ? Diagnostic::no_tag : Diagnostic::image_empty;
}

/// The same thing to say, though the numbers may differ.
bool same(const Diagnosis& a, const Diagnosis& b) {
  return a.cause == b.cause && a.details.seen == b.details.seen &&
         a.details.concerned == b.details.concerned && a.details.family == b.details.family;
}

/// "tag 5", "tags 5 and 2", "tags 5, 2 and 7".
std::string tags(const DiagnosticDetails::Ids& ids) {
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < ids.count; ++i) numbers.push_back(std::to_string(ids.id[i]));
  return (ids.count == 1 ? "tag " : "tags ") + listed(numbers);
}

const char* is(const DiagnosticDetails::Ids& ids) { return ids.count == 1 ? "is" : "are"; }

std::string from_rest(const DiagnosticDetails& d) {
  const Eigen::Vector3d mm = d.offset.head<3>() * 1e3;
  return fmt::format("{:.1f} mm (x {:+.1f}, y {:+.1f}, z {:+.1f}) and {:.0f} degrees from",
                     mm.norm(), mm.x(), mm.y(), mm.z(), d.offset.tail<3>().norm() * 180 / M_PI);
}

}  // namespace

bool ShutterCheck::rolls(PhotometricAligner& aligner, const PixelWindow& image, TimePoint time,
                         const Eigen::Isometry3d& pose, const PhotometricState& before) noexcept {
  if (done_) return false;
  const Vector6 velocity = predictor_.velocity(time, pose);
  const double speed_px = aligner.pixels().camera.fy_px * velocity.head<2>().norm() /
                          std::max(1e-3, pose.translation().z());
  if (!(speed_px * kUnit > kMinMotion_px)) return false;
  ++tried_;
  const auto fits = [&](double readout) {  // only its product with the velocity matters
    PhotometricState state = before;
    const PhotometricFit fit = aligner.align(image, pose, {kUnit, readout * velocity}, state);
    return accepted(fit, state);
  };
  const auto fits_backwards = [&](double readout) { return fits(-readout); };
  if (std::any_of(std::begin(kReadouts), std::end(kReadouts), fits) &&
      std::none_of(std::begin(kReadouts), std::end(kReadouts), fits_backwards))
    ++mended_;
  done_ = mended_ >= kEnough && mended_ > kMaxOfAll * tried_;
  return done_;
}

Diagnosis diagnose(const CameraModel& camera, const TargetDescription& target,
                   const KnownReference& reference, const ImageView& image,
                   const Finding& finding) {
  Diagnosis out;
  if (finding.other_way_round) return out;  // said at once
  DiagnosticDetails& details = out.details;
  details.expected_family = details.family = name(target.family);
  const auto found = [&finding](std::size_t t) {
    return std::any_of(finding.tags.begin(), finding.tags.end(),
                       [t](const FoundTag& tag) { return tag.index == t; });
  };
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    details.expected.add(target.tags[t].id);
    (found(t) ? details.seen : details.concerned).add(target.tags[t].id);
  }
  for (const int id : finding.other_ids) details.seen.add(id);

  if (!finding.twice.empty()) {
    details.concerned = {};
    for (const int id : finding.twice) details.concerned.add(id);
    out.cause = Diagnostic::tag_twice;
    return out;
  }
  const DiagnosticDetails::Ids missing = details.concerned;
  out.cause = judge_geometry(target, reference, finding, details);
  if (out.cause != Diagnostic::none || missing.count == 0) return out;
  details.concerned = missing;
  out.cause = judge_missing(camera, target, image, finding, details);
  return out;
}

/// Once, as soon as the target is held: tags of the wrong size, or in other places than described,
/// may be held, but what is measured is wrong.
void TrackingDiagnostics::check_geometry(const FrameFacts& facts, Track& track) {
  if (geometry_checked_) return;
  geometry_checked_ = true;
  if (facts.finding.tags.size() != target_.tags.size()) return;
  const Diagnosis look =
      diagnose(camera_, target_, facts.reference, facts.frame.image, facts.finding);
  if (look.cause != Diagnostic::other_scale && look.cause != Diagnostic::other_places) return;
  distance_checked_ = true;  // a wrong scale looks like a wrong distance
  track.diagnostic = look.cause;
  track.details = look.details;
}

/// Once each time, when another tag is where one of the target's should be.
void TrackingDiagnostics::check_print(const FrameFacts& facts, Track& track) {
  other_prints_ = facts.other_print ? other_prints_ + 1 : 0;
  if (other_prints_ != kOtherPrints) return;
  track.diagnostic = Diagnostic::other_print;
  track.details = {};
  track.details.concerned.add(target_.tags[facts.other_print->tag].id);
  track.details.seen.add(facts.other_print->seen_id);
}

/// Once, when pictures of a moving target that are not accepted turn out to be sheared.
void TrackingDiagnostics::check_shutter(const FrameFacts& facts, Track& track) {
  if (camera_.readout > 0 || !facts.aligner.ready()) return;
  const ImageView& image = facts.frame.image;
  const PixelWindow window{image.pixels, image.stride, 0, 0, image.width, image.height};
  if (shutter_.rolls(facts.aligner, window, facts.frame.capture_time, *facts.pose,
                     facts.photometric) &&
      track.diagnostic == Diagnostic::none)
    track.diagnostic = Diagnostic::shutter_rolls;
}

/// When a picture of the target that was given does not show what the camera sees.
void TrackingDiagnostics::check_picture(const FrameFacts& facts, Track& track) {
  if (!facts.reference.picture_given) return;
  misfits_ = facts.accepted ? 0 : misfits_ + 1;
  if (misfits_ >= kMisfits && track.diagnostic == Diagnostic::none)
    track.diagnostic = Diagnostic::appearance_does_not_fit;
}

/// Once, when the target has stood still, but not where its reference was given; never after it was
/// seen there.
void TrackingDiagnostics::check_distance(const FrameFacts& facts, Track& track) {
  if (distance_checked_ || !facts.reference.given) return;
  const TimePoint time = facts.frame.capture_time;
  const Vector6& offset = track.displacement;
  if (!still_since_ || still_by_picture_ != facts.by_picture || !stands_still(offset - still_at_)) {
    still_since_ = time;
    still_at_ = offset;
    still_by_picture_ = facts.by_picture;
  }
  if (time - *still_since_ < kSettling) return;
  const bool far = offset.head<3>().norm() > kFar || offset.tail<3>().norm() > kFarAngle;
  if (far && time - *still_since_ < kStillTime) return;
  distance_checked_ = true;
  if (!far) return;
  track.diagnostic = Diagnostic::far_from_rest;
  track.details.offset = offset;
  track.details.rest_given = true;
}

/// Why there are no numbers, now and then.
void TrackingDiagnostics::explain(const FrameFacts& facts, Track& track) {
  const TimePoint time = facts.frame.capture_time;
  if (!not_held_since_ || time < *not_held_since_) {
    not_held_since_ = time;
    next_look_ = time + kFirstLook;
    last_look_ = {};
  }
  if (time < next_look_) return;
  next_look_ = time + kBetweenLooks;
  const Diagnosis look =
      diagnose(camera_, target_, facts.reference, facts.frame.image, facts.finding);
  const bool agreed = same(look, last_look_) &&
                      (look.cause != Diagnostic::other_scale ||
                       std::abs(look.details.amount - last_look_.details.amount) < kSameScale);
  last_look_ = look;
  if (!agreed || look.cause == Diagnostic::none || same(look, said_) || time < quiet_until_) return;
  quiet_until_ = time + kQuiet;
  said_ = look;
  track.diagnostic = look.cause;
  track.details = look.details;
}

void TrackingDiagnostics::add(const FrameFacts& facts, Track& track) {
  using Progress = ReferenceEstimator::Progress;
  if (facts.searched && facts.finding.other_way_round) {
    track.diagnostic =
        camera_.mirrored ? Diagnostic::image_looks_unmirrored : Diagnostic::image_looks_mirrored;
  }
  if (facts.learning == Progress::moved) track.diagnostic = Diagnostic::moved_while_learning;
  if (facts.learning == Progress::done) track.diagnostic = Diagnostic::rest_learned;
  if (facts.pose) {
    check_print(facts, track);
    const bool explained = facts.other_print.has_value();
    if (!facts.accepted && !explained) check_shutter(facts, track);
    shutter_.seen(facts.frame.capture_time, *facts.pose);
    if (!explained) check_picture(facts, track);
    if (facts.accepted) check_distance(facts, track);
  } else {
    shutter_.lost();
  }
  if (facts.accepted || facts.learning == Progress::learning) {
    if (not_held_since_) said_ = {};
    not_held_since_.reset();
    if (facts.accepted && track.diagnostic == Diagnostic::none) check_geometry(facts, track);
  } else if (facts.searched && !facts.other_print && track.diagnostic == Diagnostic::none) {
    explain(facts, track);
  }
}

std::string diagnostic_text(Diagnostic diagnostic, const DiagnosticDetails& d) {
  switch (diagnostic) {
    case Diagnostic::none: return {};
    case Diagnostic::image_looks_mirrored:
      return "the image looks mirrored (tags decode only when it is flipped left to right); set "
             "camera.mirrored: true in sensor.yaml, unless the tags themselves are printed "
             "mirrored";
    case Diagnostic::image_looks_unmirrored:
      return "the image does not look mirrored, but sensor.yaml says so; set camera.mirrored: "
             "false in sensor.yaml";
    case Diagnostic::rest_learned:
      if (d.amount > 0)
        return fmt::format(
            "rest pose learned while the platform swayed by {:.0f} um; all numbers are uncertain "
            "by "
            "as much; for better ones put it on something firm, hands off, and start again",
            d.amount * 1e6);
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
    case Diagnostic::no_tag:
      return fmt::format(
          "no tag is seen, neither {} of {} nor any other; are they in view, whole, flat and with "
          "their white margin?",
          tags(d.expected), d.expected_family);
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
      return fmt::format(
          "{} are {:.0f} % {} than target.tag_size_mm in sensor.yaml for the distance between "
          "them; measure the print (100 %?), or place the tags anew with `tagwrench calibrate "
          "target`",
          tags(d.concerned), 100 * std::abs(d.amount - 1), d.amount > 1 ? "larger" : "smaller");
    case Diagnostic::other_places:
      return fmt::format(
          "{} sit differently to each other than target.tags in sensor.yaml says (swapped, turned "
          "or glued anew?); run `tagwrench calibrate target`",
          tags(d.concerned));
    case Diagnostic::other_print:
      return fmt::format(
          "{} is seen where sensor.yaml has {}; correct target.tags and run `tagwrench calibrate "
          "target`, or put {} in its place",
          tags(d.seen), tags(d.concerned), tags(d.concerned));
    case Diagnostic::rest_elsewhere:
      return fmt::format(
          "{} {} seen, but the target is {} {}, farther than its springs let it go; {}",
          tags(d.seen), is(d.seen), from_rest(d),
          d.rest_given ? "rest as sensor.yaml has it" : "where it was at rest",
          d.rest_given ? "run `tagwrench calibrate target`, or put camera and platform back"
                       : "put camera and platform back, or start again");
  }
  return {};
}

}  // namespace tagwrench

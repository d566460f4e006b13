#include "host/tracker/tracker.h"

#include <algorithm>
#include <array>
#include <optional>

#include "host/tracker/acquire.h"
#include "host/tracker/diagnostics.h"
#include "host/tracker/edges.h"
#include "host/tracker/photometric.h"
#include "host/tracker/print_check.h"
#include "host/tracker/reference.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

/// Around the place where the target is expected: a motion this large between frames is followed
/// without the whole frame, px. Chosen: 25 mm/s at 25 frames a second, 20 mm before the lens.
constexpr int kMargin_px = 40;

/// A target that was held so lately is looked for near that place first: a tap or a hand moves it
/// that far, px. A whole large image costs several times as much.
constexpr Duration kLately = std::chrono::seconds(1);
constexpr int kSearchMargin_px = 80;

/// What a frame showed of the target. A frame of which too small a part was decoded to tell, and
/// one that counts for the reference, leave the state as it is.
enum class Outcome : std::uint8_t { nothing, target_by_edges, target_by_picture };

/// Every transition: the state after a frame, by the state before it and what it showed. A frame
/// that completes the reference shows the target; whether by edges or by picture is up to whether
/// there is a template then. There is one from the moment it is made or loaded, for good.
constexpr TrackingState next_state(TrackingState state, Outcome outcome) {
  using enum TrackingState;
  // clang-format off
  constexpr std::array<std::array<TrackingState, 3>, 5> kNext = {{
      //                        nothing             target_by_edges  target_by_picture
      /* learning_reference */ {learning_reference, held_by_edges,   held_by_picture},
      /* searching          */ {searching,          held_by_edges,   held_by_picture},
      /* held_by_edges      */ {lost,               held_by_edges,   held_by_picture},
      /* held_by_picture    */ {lost,               held_by_edges,   held_by_picture},
      /* lost               */ {lost,               held_by_edges,   held_by_picture},
  }};
  // clang-format on
  return kNext[static_cast<std::size_t>(state)][static_cast<std::size_t>(outcome)];
}

constexpr bool is_held(TrackingState state) {
  return state == TrackingState::held_by_edges || state == TrackingState::held_by_picture;
}

/// Of a frame that does not show the target.
constexpr Status absent(TrackingState state) {
  const bool never_seen =
      state == TrackingState::learning_reference || state == TrackingState::searching;
  return never_seen ? Status::acquiring : Status::lost;
}

/// Covariance of the rotation vector r of exp(r), from that of a small rotation after it: the
/// inverse of the left Jacobian of SO(3) to second order (Sola, "A micro Lie theory", arXiv
/// 1812.01537, equation 146).
Matrix6 displacement_covariance(const Matrix6& motion, const Vector6& displacement) {
  const Eigen::Matrix3d r = cross_matrix(displacement.tail<3>());
  Matrix6 turn = Matrix6::Identity();
  turn.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() - 0.5 * r + r * r / 12.0;
  return turn * motion * turn.transpose();
}

/// Where the target seems to be in one frame.
struct Estimate {
  PhotometricFit fit;  ///< without a template, the edges' pose in its form
  Refinement edges;    ///< lost: there are none, or they were not needed
  bool anew = false;   ///< found without the frame before

  const Eigen::Isometry3d& pose() const {
    return fit.converged ? fit.camera_T_platform : edges.camera_T_platform;
  }
};

}  // namespace

struct Tracker::Impl {
  Impl(const CameraModel& model, const TargetDescription& description,
       const ReferenceOptions& options)
      : camera(model),
        target(description),
        acquirer(model, description),
        refiner(model),
        learner(model, description, options, acquirer.patterns()),
        prints(model, description.family, acquirer.patterns()),
        diagnostics(model, description) {
    reference.given = options.camera_T_platform.has_value();
    const bool placed = std::all_of(description.tags.begin(), description.tags.end(),
                                    [](const Tag& tag) { return tag.platform_T_tag.has_value(); });
    if (!placed || !reference.given) return;
    LearnedReference given;
    given.camera_T_platform = given.seen_from = *options.camera_T_platform;
    for (std::size_t t = 0; t < description.tags.size(); ++t) {
      const Tag& tag = description.tags[t];
      given.target.tags.push_back(make_edge_tag(acquirer.patterns()[t], *tag.platform_T_tag));
      given.tag_covariance.push_back(
          tag_covariance(tag, (given.camera_T_platform * *tag.platform_T_tag).linear()));
    }
    given.scale_sigma = description.scale_sigma;
    if (options.appearance) given.image = *options.appearance;
    reference.picture_given = options.appearance.has_value();
    adopt(given);
    state = TrackingState::searching;
  }

  /// From now on displacement counts from there.
  void adopt(const LearnedReference& learned) {
    reference.camera_T_platform = learned.camera_T_platform;
    refiner.set_target(learned.target);
    reference.platform_T_tag.clear();
    for (const EdgeTag& tag : learned.target.tags)
      reference.platform_T_tag.push_back(tag.platform_T_tag);
    reference.tag_sigma.clear();
    for (std::size_t t = 0; t < learned.target.tags.size(); ++t) {
      const Eigen::Isometry3d camera_T_tag =
          learned.seen_from * learned.target.tags[t].platform_T_tag;
      reference.tag_sigma.push_back(tag_sigma(learned.tag_covariance[t], camera_T_tag.linear()));
    }
    reference.scale_sigma = learned.scale_sigma;
    predictor.start({}, reference.camera_T_platform);
    reference.known = true;
    const ReferenceImage& image = learned.image;
    if (image.level.empty() || image.width != camera.width_px || image.height != camera.height_px)
      return;
    aligner.set_template(
        make_pixel_template(camera, {image.level.data(), image.width, image.height, image.width},
                            std::max(1, image.frames), learned.noise, acquirer.patterns(),
                            learned.target, learned.seen_from, {}));
    pose_covariance = reference.given ? learned.pose_covariance : learned.sway;
    geometry.set(aligner, learned.seen_from, learned.tag_covariance, learned.scale_sigma);
    photometric = {};
  }

  void learn(FrameFacts& facts, Track& track) {
    const Frame& frame = facts.frame;
    if (learner.wants_finding()) search_whole(facts);
    facts.learning = learner.add(frame.image, finding);
    track.tags_held = static_cast<std::uint8_t>(learner.tags_seen());
    if (facts.learning != ReferenceEstimator::Progress::done) return;
    adopt(learner.learned());
    track.details.amount = std::sqrt(learner.learned().sway.diagonal().head<3>().maxCoeff());
    predictor.start(frame.capture_time, reference.camera_T_platform);
    enter_held();
  }

  /// Where reference pose and placement are given but no picture is, one is taken as soon as the
  /// platform stands still, wherever that is.
  void learn_picture(const Frame& frame) {
    finding = learner.wants_finding() ? acquirer.find(frame.image) : Finding{};
    if (learner.add(frame.image, finding) != ReferenceEstimator::Progress::done) return;
    const Eigen::Isometry3d now = predictor.last();
    adopt(learner.learned());
    predictor.start(frame.capture_time, now);
    enter_held();
  }

  PhotometricFit align(const Frame& frame, const Eigen::Isometry3d& start) {
    const Region part = frame.readable();
    const PixelWindow window{frame.image.pixels,  frame.image.stride,  part.x, part.y,
                             part.x + part.width, part.y + part.height};
    PhotometricFit fit = aligner.align(window, start, rows(frame.capture_time, start), photometric);
    if (fit.converged && camera.readout > 0) {
      fit = aligner.align(window, fit.camera_T_platform,
                          rows(frame.capture_time, fit.camera_T_platform), photometric);
    }
    if (fit.converged && !within_reach(reference.camera_T_platform, fit.camera_T_platform))
      fit.converged = false;
    return fit;
  }

  Refinement refine_within_reach(const Frame& frame, const Eigen::Isometry3d& start) {
    Refinement fit = refiner.refine(frame.image, start);
    if (fit.verdict != Verdict::lost &&
        !within_reach(reference.camera_T_platform, fit.camera_T_platform))
      fit = {};
    return fit;
  }

  /// The edges find a target that is further away than alignment reaches.
  Refinement find_near(const Frame& frame) {
    if (!is_held(state)) return {};
    const Refinement fit = refine_within_reach(frame, predictor.predict(frame.capture_time));
    // A motion that stops dead is nearer to where it was than to where it was going.
    return fit.verdict != Verdict::lost ? fit : refine_within_reach(frame, predictor.last());
  }

  Refinement find_anywhere(FrameFacts& facts) {
    const Refinement near = find_where_it_was(facts);
    if (near.verdict != Verdict::lost) return near;
    search_whole(facts);
    return refine_found(facts.frame);
  }

  /// All tags or nothing: of one that is missing the whole image tells why.
  Refinement find_where_it_was(FrameFacts& facts) {
    if (!seen || facts.frame.capture_time - *seen > kLately || !aligner.ready()) return {};
    const Region part = aligner.region(predictor.last(), kSearchMargin_px);
    if (part.empty()) return {};
    finding = acquirer.find_in(facts.frame.image, part);
    if (finding.tags.size() != target.tags.size()) return {};
    facts.searched = finding.looked;
    return refine_found(facts.frame);
  }

  Refinement refine_found(const Frame& frame) {
    if (finding.tags.empty()) return {};
    const std::optional<Eigen::Isometry3d> start =
        pose_from_corners(camera, target.tag_size, finding.tags, reference.platform_T_tag,
                          reference.camera_T_platform);
    if (!start) return {};
    return refine_within_reach(frame, *start);
  }

  /// From what the edges found to the pose that counts.
  PhotometricFit finish(const Frame& frame, const Refinement& edges) {
    if (aligner.ready()) return align(frame, edges.camera_T_platform);
    PhotometricFit fit;
    fit.camera_T_platform = edges.camera_T_platform;
    fit.covariance = edges.covariance;
    fit.tags_held = edges.tags_held;
    fit.converged = edges.verdict == Verdict::held;
    return fit;
  }

  /// Alignment from the prediction was not accepted, or could not be tried.
  Estimate search(FrameFacts& facts) {
    Estimate near;
    near.edges = find_near(facts.frame);
    if (near.edges.verdict != Verdict::lost) {
      near.fit = finish(facts.frame, near.edges);
      if (is_accepted(near.fit)) return near;
    }
    Estimate anew;
    anew.anew = true;
    anew.edges = find_anywhere(facts);
    if (anew.edges.verdict == Verdict::lost) return near;
    anew.fit = finish(facts.frame, anew.edges);
    return anew;
  }

  /// The target is there: numbers if the fit is accepted, and what the next frame needs.
  void conclude(const Estimate& found, FrameFacts& facts, Track& track) {
    const TimePoint time = facts.frame.capture_time;
    const PhotometricFit& fit = found.fit;
    const Eigen::Isometry3d& pose = found.pose();
    if (!found.anew && is_held(state))
      predictor.add(time, pose);
    else
      predictor.start(time, pose);
    enter_held();
    const bool own_tags = prints.agrees(facts.frame, pose, reference.platform_T_tag, found.anew);
    seen = time;
    facts.accepted = is_accepted(fit) && own_tags;
    facts.other_print = prints.other();
    facts.pose = pose;
    facts.by_picture = state == TrackingState::held_by_picture;
    track.tags_held = fit.converged ? fit.tags_held : found.edges.tags_held;
    track.residual_px = found.edges.residual_px;
    if (fit.converged) {
      track.residual_fraction = fit.residual_fraction;
      track.blur_px2 = 2 * photometric.blur[0];
    }
    track.status = Status::doubtful;
    set_corners(camera, target, reference.platform_T_tag, pose, track);
    if (!facts.accepted) return;
    track.status = Status::ok;
    track.displacement = motion_between(reference.camera_T_platform, pose);
    track.covariance = displacement_covariance(fit.covariance, track.displacement) +
                       geometry.covariance(track.displacement, fit.tag_share) + pose_covariance;
    if (state == TrackingState::held_by_picture) {
      // Supposing that the next frame comes after the same time as this one.
      track.wanted = aligner.region(predictor.predict(time + predictor.period()), kMargin_px);
    } else if (stands_still(predictor.step())) {
      learn_picture(facts.frame);
    }
  }

  bool readable(const ImageView& image) const {
    return image.pixels != nullptr && image.width == camera.width_px &&
           image.height == camera.height_px && image.stride >= image.width;
  }
  bool is_accepted(const PhotometricFit& fit) const {
    return aligner.ready() ? accepted(fit, photometric) : fit.converged;
  }
  RowMotion rows(TimePoint time, const Eigen::Isometry3d& pose) const {
    return {camera.readout, predictor.velocity(time, pose)};
  }
  void enter(Outcome outcome) { state = next_state(state, outcome); }
  void enter_held() {
    enter(aligner.ready() ? Outcome::target_by_picture : Outcome::target_by_edges);
  }
  void search_whole(FrameFacts& facts) {
    finding = acquirer.find(facts.frame.image);
    facts.searched = finding.looked;
  }

  CameraModel camera;
  TargetDescription target;
  Acquirer acquirer;
  Refiner refiner;
  ReferenceEstimator learner;
  PrintWatch prints;
  TrackingDiagnostics diagnostics;
  TrackingState state = TrackingState::learning_reference;
  KnownReference reference;
  Finding finding;                ///< of the last search
  std::optional<TimePoint> seen;  ///< when the target was last held
  ConstantVelocityPredictor predictor;
  PhotometricAligner aligner;
  PhotometricState photometric;
  GeometryUncertainty geometry;
  /// Of the picture's place against a given reference, or of a platform that swayed at rest.
  Matrix6 pose_covariance = Matrix6::Zero();
};

Tracker::Tracker(const CameraModel& camera, const TargetDescription& target,
                 const ReferenceOptions& reference)
    : impl_(std::make_unique<Impl>(camera, target, reference)) {}

Tracker::~Tracker() = default;

const KnownReference& Tracker::reference() const noexcept { return impl_->reference; }

TrackingState Tracker::state() const noexcept { return impl_->state; }

Track Tracker::track(const Frame& frame) noexcept {
  Impl& own = *impl_;
  Track track;
  if (!own.readable(frame.image)) {
    own.enter(Outcome::nothing);
    track.status = absent(own.state);
    return track;
  }
  track.status = absent(own.state);
  FrameFacts facts{frame, own.reference, own.finding, own.aligner, own.photometric};
  if (own.state == TrackingState::learning_reference) {
    own.learn(facts, track);
    own.diagnostics.add(facts, track);
    return track;
  }
  Estimate found;
  if (own.state == TrackingState::held_by_picture)
    found.fit = own.align(frame, own.predictor.predict(frame.capture_time));
  bool there = own.is_accepted(found.fit);
  if (!there) {
    track.needs_whole_frame =
        !frame.readable().contains({0, 0, frame.image.width, frame.image.height});
    if (track.needs_whole_frame) return track;
    found = own.search(facts);
    there = found.edges.verdict != Verdict::lost;
  }
  if (there) {
    own.conclude(found, facts, track);
  } else {
    own.enter(Outcome::nothing);
    own.photometric = {};
  }
  own.diagnostics.add(facts, track);
  return track;
}

}  // namespace tagwrench

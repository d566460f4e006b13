#include "host/source/simulator/disturbances.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench::sim {
namespace {

constexpr double kTau = 2 * std::numbers::pi;
constexpr double kSlowFade = 1.0;        // s; a slower change of light is a drift
constexpr double kDark = 0.05;           // light factor
constexpr int kRandomDirtPerTag = 3;     // different ones
constexpr double kSecondEvent = 0.25;    // probability
constexpr double kReachAcross_px = 800;  // the diagonal of an image 640 px wide

DisturbanceKind kind_of(const Occluder&) { return DisturbanceKind::occluder; }
DisturbanceKind kind_of(const Glare&) { return DisturbanceKind::glare; }
DisturbanceKind kind_of(const Flicker&) { return DisturbanceKind::flicker; }
DisturbanceKind kind_of(const TurningLight&) { return DisturbanceKind::turning_light; }
DisturbanceKind kind_of(const FocusChange&) { return DisturbanceKind::focus; }
DisturbanceKind kind_of(const LightChange& change) {
  if (change.factor < kDark) return DisturbanceKind::darkness;
  return change.fade >= kSlowFade ? DisturbanceKind::light_drift : DisturbanceKind::light_step;
}

// The start of the turn that reaches into [from, to]; false if none does.
bool turn_at(const Occurrence& when, double from, double to, double& begin) noexcept {
  if (to < when.start) return false;
  begin = when.start;
  if (when.every > 0) begin += when.every * std::floor((to - when.start) / when.every);
  return from < begin + when.length;
}

template <typename T>
void add_going(const T& what, double begin, StaticVector<Going<T>>& into, Happening& h) noexcept {
  into.push({what, begin});
  h.kinds |= bit(kind_of(what));
}

template <typename T>
void add_all(const std::vector<T>& list, double from, double to, StaticVector<Going<T>>& into,
             Happening& h) noexcept {
  double begin = 0;
  for (const T& what : list)
    if (turn_at(what.when, from, to, begin)) add_going(what, begin, into, h);
}

// 0 outside of the time of a disturbance, 1 inside, smooth in between.
template <typename T>
double strength(const Going<T>& going, double time) noexcept {
  const double inside = std::min(time - going.begin, going.end() - time);
  if (inside < 0) return 0;
  if (inside >= going.what.fade) return 1;
  const double x = inside / going.what.fade;
  return x * x * (3 - 2 * x);
}

}  // namespace

DisturbancePlayer::DisturbancePlayer(const Disturbances& disturbances, std::uint64_t seed,
                                     int width_px, int tags)
    : all_(disturbances),
      seed_(seed),
      image_scale_(width_px / 640.0),
      tags_(tags),
      dirt_(disturbances.dirt) {
  if (!std::isfinite(all_.random.start)) return;
  Random random(seed_, kDirt);
  for (int i = 0; i < tags * kRandomDirtPerTag; ++i) {
    dirt_.push_back({.when = {},
                     .tag = i / kRandomDirtPerTag,
                     .specks = 1 + static_cast<int>(random.uniform(0, 6)),
                     .scratches = static_cast<int>(random.uniform(0, 3)),
                     .size = random.uniform(0.08e-3, 0.5e-3),
                     .reflectance = random.uniform(0.1, 0.8)});
  }
}

Happening DisturbancePlayer::between(double from, double to) const noexcept {
  Happening h;
  add_all(all_.occluders, from, to, h.occluders, h);
  add_all(all_.glare, from, to, h.glare, h);
  add_all(all_.light, from, to, h.light, h);
  add_all(all_.flicker, from, to, h.flicker, h);
  add_all(all_.turning_light, from, to, h.turning_light, h);
  add_all(all_.focus, from, to, h.focus, h);
  double begin = 0;
  for (std::size_t i = 0; i < all_.dirt.size(); ++i) {
    if (!turn_at(all_.dirt[i].when, from, to, begin)) continue;
    h.dirt.push({static_cast<std::size_t>(all_.dirt[i].tag), i});
    h.kinds |= bit(DisturbanceKind::dirt);
  }
  if (to < all_.random.start) return h;
  // Nothing reaches over the end of a period, so the one at `to` is all that can be there.
  const auto period = static_cast<std::uint64_t>((to - all_.random.start) / all_.random.every);
  Random random = Random::numbered(seed_, kDisturbances, period);
  const double start = all_.random.start + static_cast<double>(period) * all_.random.every;
  const int next = Random::shuffled(seed_, kDisturbanceOrder, period, kEvents.size());
  add_one(kEvents[static_cast<std::size_t>(next)], random, start, from, to, h);
  if (random.uniform() >= kSecondEvent) return h;
  const double any = random.uniform(0, kEvents.size());
  add_one(kEvents[static_cast<std::size_t>(any)], random, start, from, to, h);
  return h;
}

void DisturbancePlayer::add_one(Event event, Random& random, double period_start, double from,
                                double to, Happening& h) const noexcept {
  const double begin = period_start + all_.random.every * random.uniform(0, 0.25);
  Occurrence when;
  when.length = all_.random.every * random.uniform(0.1, 0.5);
  // Numbers of its own: what comes after it stays the same whether or not it is on.
  Random own(random.next());
  if (to < begin || from >= begin + when.length) return;
  const auto add = [&](auto what, auto& into) {
    what.when = when;
    add_going(what, begin, into, h);
  };
  const bool coin = own.uniform() < 0.5;
  switch (event) {
    case Event::hair:
    case Event::cable:
    case Event::fingertip:
    case Event::hand: add(random_occluder(event, own, when.length), h.occluders); break;
    case Event::glare:
      add(Glare{.when = when,
                .peak_counts = own.uniform(60, 800),
                .sigma_px = image_scale_ * own.uniform(6, 70),
                .aim_px = random_aim(own),
                .wander_px = image_scale_ * own.uniform(0, 80),
                .wander_hz = own.uniform(0.2, 3),
                .fade = own.uniform() < 0.3 ? 0.0 : own.uniform(0.02, 0.2)},
          h.glare);
      break;
    case Event::light_step:  // down, or up to clipping
      add(LightChange{when, coin ? own.uniform(0.25, 0.85) : own.uniform(1.15, 2.0),
                      own.uniform() < 0.5 ? 0.0 : 0.2},
          h.light);
      break;
    case Event::darkness: add(LightChange{when, 0.0, coin ? 0.0 : 0.15}, h.light); break;
    case Event::flicker:
      add(Flicker{when, own.uniform(0.03, 0.35), coin ? 50.0 : 60.0}, h.flicker);
      break;
    case Event::turning_light:
      add(TurningLight{when, own.uniform(0.1, 0.5), own.uniform(0.5, 4.0), 0.1}, h.turning_light);
      break;
    case Event::dirt: {
      const int tag = static_cast<int>(own.uniform(0, tags_));
      const int face =
          tag * kRandomDirtPerTag + static_cast<int>(own.uniform(0, kRandomDirtPerTag));
      h.dirt.push(
          {static_cast<std::size_t>(tag), all_.dirt.size() + static_cast<std::size_t>(face)});
      h.kinds |= bit(DisturbanceKind::dirt);
      break;
    }
    case Event::focus:
      add(FocusChange{when, coin ? own.uniform(1e-3, 9e-3) : own.uniform(-9e-3, -1e-3), 0.1,
                      own.uniform() < 0.3 ? own.uniform(1, 4) : 0.0},
          h.focus);
      break;
  }
}

Occluder DisturbancePlayer::random_occluder(Event event, Random& random,
                                            double length) const noexcept {
  // Width and softness, each from and to, px of an image 640 px wide.
  constexpr double kSizes[4][4] = {{2, 8, 1, 4},         // hair
                                   {15, 70, 2, 12},      // cable
                                   {60, 300, 3, 25},     // fingertip
                                   {500, 1500, 5, 40}};  // a hand over everything
  const auto& [thin, wide, sharp, soft] = kSizes[static_cast<std::size_t>(event)];
  Occluder o;
  o.shape = event == Event::fingertip ? OccluderShape::disc : OccluderShape::band;
  o.direction = random.uniform(0, kTau);
  o.aim_px = random_aim(random);
  o.reflectance = random.uniform(0.02, 0.9);
  o.texture = random.uniform(0.0, 0.15);
  o.texture_wavelength_px = image_scale_ * random.uniform(8, 60);
  o.width_px = image_scale_ * random.uniform(thin, wide);
  o.softness_px = image_scale_ * random.uniform(sharp, soft);
  if (event == Event::hair) {  // falls onto the lens and lies, or creeps across
    o.speed_px_per_s = random.uniform() < 0.5 ? 0.0 : image_scale_ * random.uniform(20, 150);
    return o;
  }
  // It comes from outside of the view and leaves it.
  const double across = image_scale_ * kReachAcross_px + o.width_px;
  o.speed_px_per_s = across / length * random.uniform(1.0, 1.5);
  return o;
}

Eigen::Vector2d DisturbancePlayer::random_aim(Random& random) const noexcept {
  return image_scale_ * Eigen::Vector2d(random.uniform(-90, 90), random.uniform(-120, 120));
}

bool DisturbancePlayer::frame_lost(std::uint64_t sequence) const noexcept {
  const LostFrames& lost = all_.lost_frames;
  if (lost.share <= 0) return false;
  const auto reach = static_cast<std::uint64_t>(lost.most_in_a_row);
  for (std::uint64_t back = 0; back < reach && back <= sequence; ++back) {
    Random random = Random::numbered(seed_, kLostFrames, sequence - back);
    if (random.uniform() >= lost.share) continue;
    if (1 + std::floor(random.uniform(0, lost.most_in_a_row)) > static_cast<double>(back))
      return true;
  }
  return false;
}

Eigen::Vector2d place(const Going<Occluder>& occluder, double time) noexcept {
  const Occluder& o = occluder.what;
  const double since_middle = time - occluder.begin - 0.5 * o.when.length;
  const double way = o.speed_px_per_s * since_middle;
  return o.aim_px + way * Eigen::Vector2d(std::cos(o.direction), std::sin(o.direction));
}

double half_edge_px(const Occluder& occluder, double exposure) noexcept {
  return 0.5 * (occluder.softness_px + std::abs(occluder.speed_px_per_s) * exposure) + 1e-3;
}

double covered(const Going<Occluder>& occluder, const Eigen::Vector2d& pixel, double time,
               double exposure) noexcept {
  const Occluder& o = occluder.what;
  if (time < occluder.begin || time >= occluder.end()) return 0;
  const Eigen::Vector2d off = pixel - place(occluder, time);
  const double from_middle =
      o.shape == OccluderShape::disc
          ? off.norm()
          : std::abs(off.x() * std::cos(o.direction) + off.y() * std::sin(o.direction));
  const double outside = from_middle - 0.5 * o.width_px;
  return std::clamp(0.5 - 0.5 * outside / half_edge_px(o, exposure), 0.0, 1.0);
}

Spot spot(const Going<Glare>& glare, double time) noexcept {
  const Glare& g = glare.what;
  const double turned = kTau * g.wander_hz * (time - glare.begin);
  return {g.aim_px + g.wander_px * Eigen::Vector2d(std::sin(0.73 * turned), std::sin(turned + 1)),
          g.peak_counts * strength(glare, time)};
}

double light_factor(const Happening& happening, double time, double exposure) noexcept {
  double factor = 1;
  for (const auto& change : happening.light)
    factor *= 1 + (change.what.factor - 1) * strength(change, time);
  for (const auto& lamp : happening.flicker) {
    if (time < lamp.begin || time >= lamp.end()) continue;
    // The mean of a sine over a window T is the sine times sin(pi f T) / (pi f T).
    const double frequency = 2 * lamp.what.mains_hz;
    const double half_turn = 0.5 * kTau * frequency * exposure;
    const double kept = half_turn > 1e-9 ? std::sin(half_turn) / half_turn : 1.0;
    factor *= 1 + lamp.what.depth * kept * std::sin(kTau * frequency * time);
  }
  return factor;
}

Eigen::Vector2d light_gradient(const Happening& happening, double time) noexcept {
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  for (const auto& light : happening.turning_light) {
    const double angle = kTau * (time - light.begin) / light.what.turn;
    gradient += light.what.depth * strength(light, time) *
                Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  // Several together do not make the light negative in a corner.
  return gradient / std::max(1.0, gradient.norm());
}

double focus_shift(const Happening& happening, double time) noexcept {
  double shift = 0;
  for (const auto& focus : happening.focus) {
    const double swing =
        focus.what.hunt_hz > 0 ? std::sin(kTau * focus.what.hunt_hz * (time - focus.begin)) : 1.0;
    shift += focus.what.shift * strength(focus, time) * swing;
  }
  return shift;
}

}  // namespace tagwrench::sim

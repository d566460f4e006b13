// The disturbances that go on at a time, found without memory of the past: any frame can be asked
// for, and the same seed gives the same trouble. Their settings: scenario.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/source/simulator/random.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// What is going on in a frame; bits of a mask, 1U << kind.
enum class DisturbanceKind : std::uint8_t {
  occluder,
  glare,
  light_step,   ///< a LightChange with a fade of less than a second
  light_drift,  ///< one with a longer fade
  darkness,     ///< one with a factor below 0.05
  flicker,
  turning_light,
  dirt,
  focus,
};
constexpr int kDisturbanceKinds = 9;

constexpr const char* name(DisturbanceKind kind) {
  constexpr const char* kNames[kDisturbanceKinds] = {"occluder", "glare",    "light step",
                                                     "drift",    "darkness", "flicker",
                                                     "turning",  "dirt",     "focus"};
  return kNames[static_cast<int>(kind)];
}

constexpr std::uint32_t bit(DisturbanceKind kind) { return 1U << static_cast<unsigned>(kind); }

/// Up to eight of a kind at the same time; more are not shown.
template <typename T>
class StaticVector {
 public:
  static constexpr std::size_t kMax = 8;
  void push(const T& item) noexcept {
    if (count_ < kMax) items_[count_++] = item;
  }
  const T* begin() const noexcept { return items_.data(); }
  const T* end() const noexcept { return items_.data() + count_; }
  bool empty() const noexcept { return count_ == 0; }

 private:
  std::array<T, kMax> items_{};
  std::size_t count_ = 0;
};

/// A disturbance and the time at which this turn of it began, s.
template <typename T>
struct Going {
  T what;
  double begin = 0;
  double end() const noexcept { return begin + what.when.length; }
};

/// Dirt that is on a tag: which tag, and which of DisturbancePlayer::dirt().
struct DirtShown {
  std::size_t tag = 0;
  std::size_t dirt = 0;
};

/// Everything that goes on in one frame.
struct Happening {
  StaticVector<Going<Occluder>> occluders;
  StaticVector<Going<Glare>> glare;
  StaticVector<Going<LightChange>> light;
  StaticVector<Going<Flicker>> flicker;
  StaticVector<Going<TurningLight>> turning_light;
  StaticVector<Going<FocusChange>> focus;
  StaticVector<DirtShown> dirt;
  std::uint32_t kinds = 0;  ///< bit() of each DisturbanceKind that is there
};

class DisturbancePlayer {
 public:
  /// The image's width scales what is drawn at random.
  DisturbancePlayer(const Disturbances& disturbances, std::uint64_t seed, int width_px, int tags);

  /// What goes on between two times less than a frame period apart, s. No heap.
  Happening between(double from, double to) const noexcept;

  bool frame_lost(std::uint64_t sequence) const noexcept;

  /// All dirt that between() may speak of, in its order.
  const std::vector<Dirt>& dirt() const noexcept { return dirt_; }

 private:
  // clang-format off
  enum class Event : std::uint8_t {
    hair, cable, fingertip, hand,
    glare, light_step, darkness, flicker, turning_light, dirt, focus,
  };
  // clang-format on
  static constexpr std::array<Event, 12> kEvents = {
      Event::hair,  Event::cable,      Event::fingertip, Event::hand,    Event::glare,
      Event::glare, Event::light_step, Event::darkness,  Event::flicker, Event::turning_light,
      Event::dirt,  Event::focus};  ///< of one round of random ones

  void add_one(Event event, Random& random, double period_start, double from, double to,
               Happening& h) const noexcept;
  Occluder random_occluder(Event event, Random& random, double length) const noexcept;
  Eigen::Vector2d random_aim(Random& random) const noexcept;

  Disturbances all_;
  std::uint64_t seed_;
  double image_scale_;  ///< of this image to one 640 px wide
  int tags_;
  std::vector<Dirt> dirt_;
};

/// Where an occluder's middle is, px from the image centre.
Eigen::Vector2d place(const Going<Occluder>& occluder, double time) noexcept;

/// Half of the width of an occluder's edge, px, with the way it goes during the exposure.
double half_edge_px(const Occluder& occluder, double exposure) noexcept;

/// Share of the light from a pixel (px from the image centre) that an occluder keeps off, 0..1.
double covered(const Going<Occluder>& occluder, const Eigen::Vector2d& pixel, double time,
               double exposure) noexcept;

struct Spot {
  Eigen::Vector2d place_px;  ///< from the image centre
  double counts = 0;         ///< in its middle
};
Spot spot(const Going<Glare>& glare, double time) noexcept;

/// Factor on all light, for an exposure around `time`.
double light_factor(const Happening& happening, double time, double exposure) noexcept;

/// Gradient of the light: the factor is 1 + gradient . off, off = place from the image centre over
/// half its diagonal.
Eigen::Vector2d light_gradient(const Happening& happening, double time) noexcept;

/// m, to be added to the focal distance.
double focus_shift(const Happening& happening, double time) noexcept;

}  // namespace tagwrench::sim

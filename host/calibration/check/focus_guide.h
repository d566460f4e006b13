// From the width of edges, frame by frame while somebody turns a lens, to what to do next.
#pragma once

#include <cstdint>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

enum class FocusTurn : std::uint8_t {
  begin,     ///< nothing to compare with yet
  sharper,   ///< go on
  blurrier,  ///< turn back
  away,      ///< nobody turns, and it was sharper before
  try_on,    ///< nobody turns, the best so far, but it may get better still
  best,      ///< nobody turns, and either way it is worse
};

/// All widths are standard deviations, px.
class FocusGuide {
 public:
  /// `tags` says which tags the width is of, one bit each: when others come into view, what was
  /// before does not compare.
  void add(TimePoint time, double width_px, unsigned tags);

  FocusTurn turn() const { return turn_; }
  double now_px() const { return now_px_; }
  double best_px() const { return best_px_; }  ///< held for two frames at least
  /// Growth of the noise over that at the best, 0: none. It goes with the root of the blur, the
  /// pixel's own width included (study/design.h).
  double more_noise() const;

 private:
  struct Seen {
    TimePoint time;
    double width_px;
  };
  std::vector<Seen> seen_;  ///< of the last second
  unsigned tags_ = 0;
  double now_px_ = 0, best_px_ = 0;
  double dip_px_ = 0;                                ///< the best when it last got clearly better
  double worst_before_px_ = 0, worst_since_px_ = 0;  ///< that
  FocusTurn turn_ = FocusTurn::begin;
};

}  // namespace tagwrench

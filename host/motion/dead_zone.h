// Rest of one axis, with hysteresis and without a jump.
#pragma once

namespace tagwrench {

/// An axis leaves rest when it is pushed beyond `outer`, and deflects from zero there. While it is
/// pushed on, to twice `outer`, the place of zero moves down to `inner`; on the way back deflection
/// ends where zero is then. So the edge has a width that noise does not cross to and fro, and the
/// way out and the way back are both continuous.
class DeadZone {
 public:
  struct Edges {
    double outer = 0;
    double inner = 0;       ///< 0..outer
    double full_scale = 1;  ///< greater than outer
  };

  /// Deflection, -1..1. `smooth` counts, but what `raw` says is released is released at once,
  /// however far the smoothing lags behind.
  double deflection(double smooth, double raw, const Edges& edges) noexcept;

  bool resting() const noexcept { return zero_ == 0; }

 private:
  double zero_ = 0;  ///< where deflection begins, with the push's sign; 0: at rest
};

}  // namespace tagwrench

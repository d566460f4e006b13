// How deflection answers to a push: a curve from 0..1 to 0..1 that never falls.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tagwrench {

// Rest of one axis, with hysteresis and without a jump.

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

enum class CurveKind : std::uint8_t {
  linear,
  power,   ///< out = in^power: above 1 gentle near rest, below 1 eager
  points,  ///< a smooth curve through points
};

struct CurvePoint {
  double in = 0;
  double out = 0;
  bool operator==(const CurvePoint&) const = default;
};

inline constexpr std::size_t kMaxCurvePoints = 16;

struct CurveOptions {
  CurveKind kind = CurveKind::linear;
  double power = 1;  ///< greater than 0
  /// The first `count` of them, at least two: from (0, 0), `in` growing up to 1, `out` never
  /// falling and at most 1.
  std::array<CurvePoint, kMaxCurvePoints> points{};
  std::size_t count = 0;
  bool operator==(const CurveOptions&) const = default;
};

/// Through points it is the monotone cubic of Fritsch and Carlson, "Monotone piecewise cubic
/// interpolation", SIAM J. Numer. Anal. 17(2), 1980: it rises wherever the points do, and nowhere
/// exceeds them.
class ResponseCurve {
 public:
  ResponseCurve() = default;
  /// `options` must keep to the rules above.
  explicit ResponseCurve(const CurveOptions& options) noexcept;

  /// What is below 0 counts as 0, above 1 as 1.
  double operator()(double in) const noexcept;

 private:
  double between_points(double in) const noexcept;

  CurveOptions options_;
  std::array<double, kMaxCurvePoints> slope_{};  ///< at the points
};

}  // namespace tagwrench

// The platform swings on its springs when a hand lets go at once: that is no push.
#pragma once

#include "host/core/types.h"

namespace tagwrench {

/// Knows a release by its suddenness: what was pushed within the last 60 ms or so is gone from one
/// frame to the next, or turned round. Nothing smaller than that push is one then, in any
/// direction, for a time that shrinks as the swing does. A hand that turns round by itself is slow
/// beside that and soon beyond it.
class RingdownSuppressor {
 public:
  /// `decay`: s, in which a swing falls to 1/e; 0: nothing is taken for one.
  explicit RingdownSuppressor(double decay) noexcept : decay_(decay) {}

  void reset() noexcept;
  /// `push` in full scales, `seconds` after the last one.
  void add(double seconds, const Vector6& push) noexcept;
  /// In full scales: what may be swing, on any axis.
  double size() const noexcept { return size_; }

 private:
  double decay_;
  double size_ = 0;
  Vector6 push_ = Vector6::Zero();  ///< the strongest of late
};

}  // namespace tagwrench

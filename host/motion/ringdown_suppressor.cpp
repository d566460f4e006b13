#include "host/motion/ringdown_suppressor.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr double kOfLate = 0.06;  // s
constexpr double kLeft = 0.1;     // of a push: it is gone
constexpr double kMargin = 1.15;  // of its size: axes swing into each other
constexpr double kMin = 0.02;

}  // namespace

void RingdownSuppressor::reset() noexcept {
  size_ = 0;
  push_.setZero();
}

void RingdownSuppressor::add(double seconds, const Vector6& push) noexcept {
  if (decay_ <= 0) return;
  size_ *= std::exp(-seconds / decay_);
  if (push.dot(push_) <= kLeft * push_.squaredNorm())
    size_ = std::max(size_, kMargin * push_.norm());
  if (size_ < kMin) size_ = 0;
  push_ *= std::exp(-seconds / kOfLate);
  if (push.squaredNorm() > push_.squaredNorm()) push_ = push;
}

}  // namespace tagwrench

// Exit statuses that verbs share.
#pragma once

namespace tagwrench {

/// Of a calibration that its user has stopped.
inline constexpr int kExitStopped = 1;

}  // namespace tagwrench

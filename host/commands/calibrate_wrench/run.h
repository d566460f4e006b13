// The loop of a calibration: frames, readings, keys and signals to the guide; what it says to the
// terminal; what it has accepted to the disk.
#pragma once

#include <filesystem>
#include <optional>

#include "host/app/input.h"
#include "host/calibration/wrench/guide.h"
#include "host/calibration/wrench/record.h"
#include "host/commands/calibrate_wrench/recording.h"
#include "host/commands/calibrate_wrench/result.h"
#include "host/commands/events.h"

namespace tagwrench {

struct GuideRun {
  BenchInput* at = nullptr;
  Reference* reference = nullptr;           ///< null: masses
  CalibrationRecorder* recorder = nullptr;  ///< null: nothing is recorded
  const UniqueFd* stop = nullptr;           ///< of termination_fd()
  const WrenchPlan* plan = nullptr;
  std::filesystem::path progress;
  ProgressOf of;
  std::optional<double> seconds;
  Events* events = nullptr;
};

enum class GuideEnd : std::uint8_t {
  done,
  stopped,  ///< by a key, a signal or the time limit
  ended,    ///< the source has no more frames
  failed,   ///< the guide says why
};

/// Runs until the guide is done or something ends it. What was accepted is in `progress` by then.
/// Throws std::runtime_error if that cannot be written.
GuideEnd run_guide(const GuideRun& run, WrenchGuide& guide);

}  // namespace tagwrench

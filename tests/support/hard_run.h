// The tracker over a scenario that makes trouble, judged frame by frame against what the simulator
// knows.
//
// Wrong ok   A frame that is ok although on some axis the displacement is off (from its mean over
//            the exposure, which the picture shows) by more than 5 of the claimed standard
//            deviations and by more than anybody would feel: 3 um in x and y, 12 um in z, 0.6 mrad,
//            and 1 % of the excursion (a wrong scale of the learned geometry, which a calibration
//            takes up). A turn is an excursion too: of tags 2 mm from the middle; and a shift is a
//            turn, as seen from 20 mm away.
// Trouble    Any disturbance but a drifting lamp; a tag that is not wholly visible; a tag that
// moves
//            3 px or more within one exposure; a step from the last frame of more than 0.6 mm or 3
//            degrees, which is what the tracker must follow. Frames without are clear.
// Recovery   Clear frames that are not ok after trouble in which the tracker was not ok.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/disturbances.h"

namespace tagwrench::test {

inline constexpr int kMotionTrouble = sim::kDisturbanceKinds;  ///< blurred or jumping
inline constexpr int kNoTrouble = kMotionTrouble + 1;
inline constexpr int kTroubleKinds = kNoTrouble + 1;

const char* trouble_name(int kind);

struct WrongOk {
  std::uint64_t sequence = 0;
  std::uint32_t trouble = 0;  ///< bits 1U << kind, of this frame or of the two before it
  int axis = 0;               ///< the worst: 0..5 = x y z rx ry rz
  double error = 0;           ///< m or rad
  double sigma = 0;           ///< m or rad, as claimed
  double least_visible = 1;   ///< share of the tag that is seen least
  double smear_px = 0;        ///< way of the tags in the image during the exposure
  double swing = 0;  ///< m or rad, from the middle of the exposure to its mean, on that axis
};

struct TroubleScore {  ///< of one kind; a frame with two counts for both
  int frames = 0;
  int ok = 0;
  int doubtful = 0;
  int lost = 0;  ///< or acquiring
  int wrong = 0;
  double worst_sigmas = 0;  ///< largest error of an ok frame on any axis, in claimed sigmas
};

struct HardRun {
  int frames = 0;  ///< judged, from the end of the rest frames on
  int dropped = 0;
  std::array<TroubleScore, kTroubleKinds> scores{};
  std::vector<WrongOk> wrong;
  std::vector<std::uint64_t> lost_in_the_clear;  ///< not ok for no reason, later than two frames
                                                 ///< after any trouble
  int recoveries = 0;
  int slowest_recovery = 0;                    ///< clear frames that were not ok
  std::vector<std::uint64_t> slow_recoveries;  ///< where one took more than two
  double clear_error_squared = 0;  ///< mean of e' C^-1 e over clear ok frames; 6 if the sigmas are
                                   ///< true
};

/// Renders `frames` frames in memory and tracks them with the sensor file that the simulator gives.
HardRun run_hard(const sim::Scenario& scenario, int frames);

/// A table of the kinds of trouble, and the first `most` wrong oks.
std::string report(const HardRun& run, int most = 40);

/// Frames asked for in the environment variable TAGWRENCH_HARD_FRAMES, or `otherwise`.
int hard_frames(int otherwise);

}  // namespace tagwrench::test

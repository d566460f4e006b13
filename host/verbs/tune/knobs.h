// What can be tuned of a profile while it is felt, and how that changes the profile's text.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host/config/profile_config.h"

namespace tagwrench {

/// One slider, switch or choice. Values are as the profile has them; a switch is 0 or 1, a choice
/// the position of its name.
struct Knob {
  enum class Kind : unsigned char { number, choice };
  std::string label;
  std::string_view unit;
  double unit_value = 1;  ///< of the unit, in the profile's
  Kind kind = Kind::number;
  double lowest = 0;
  double highest = 1;
  double step = 1;                      ///< added, or times where `by_ratio`
  bool by_ratio = false;                ///< then all are greater than 0
  std::vector<std::string_view> names;  ///< of a choice
  double value = 0;                     ///< in the profile given
  bool applies = true;                  ///< to the profile given
  std::function<void(Profile&, double)> set;
};

/// In the order in which they are shown.
std::vector<Knob> tuning_knobs(const Profile& profile);

/// The value `steps` further, at most at the end; a choice goes round.
double moved(const Knob& knob, int steps);
/// 0..1, for a slider.
double place(const Knob& knob);
/// "0.6 N", "on".
std::string shown(const Knob& knob);

/// `profile` with what its text cannot say, as `earlier` has it: numbers of filters that are not
/// chosen now, but may be again.
Profile with_unsaid(Profile profile, const Profile& earlier);

/// The text of `before` with what differs in `after` written into it: comments and all else stay.
/// Throws ConfigError, naming `file`, if the text is no YAML mapping.
std::string with_changes(const std::string& text, const std::string& file, const Profile& before,
                         const Profile& after);

}  // namespace tagwrench

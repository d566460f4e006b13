// Numbers as people read them. The spaces in them do not break.
#pragma once

#include <string>

namespace tagwrench {

/// N or N m, with a prefix that leaves 1 to 999, three significant digits: "1.40 mN". What is not
/// finite is a dash.
std::string load_text(double value, int axis);

/// From low to high: "±0.45 N" where they are alike within 5 %, else "-0.450 to 0.900 N": three
/// significant digits of the larger, and as many decimals of the other.
std::string range_text(double low, double high, int axis);

/// Three significant digits, a dash for what is not finite.
std::string number_text(double value);

/// Two significant digits and a percent sign; "<0.01 %" for less, either way.
std::string percent_text(double value);

}  // namespace tagwrench

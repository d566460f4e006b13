#include "host/wrench/zero_text.h"

namespace tagwrench {

std::string_view zero_text(ZeroAnswer answer) noexcept {
  switch (answer) {
    case ZeroAnswer::none:
      return {};
    case ZeroAnswer::waits:
      return "zero: waits until the platform rests; hands off";
    case ZeroAnswer::done:
      return "zero: what read is nothing now";
    case ZeroAnswer::loaded:
      return "zero: refused, something presses on the platform; take it off, or run `tagwrench "
             "zero`";
    case ZeroAnswer::moving:
      return "zero: refused, the platform did not come to rest; let go of it";
    case ZeroAnswer::no_range:
      return "zero: refused, the sensor's range is not known; give wrench.range_n in sensor.yaml";
  }
  return {};
}

}  // namespace tagwrench

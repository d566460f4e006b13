// Says what was refused: of each kind the first at once, then once a minute how many more.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/core/types.h"
#include "host/web/server/request_guard.h"

namespace tagwrench {

class RefusalLog {
 public:
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  /// The line for people; empty if nothing is to be said now. Of `detail`, a stranger's text, a few
  /// harmless characters are shown.
  std::string line(Refusal refusal, std::string_view detail, TimePoint now);

 private:
  struct Kind {
    bool said = false;
    TimePoint when{};
    std::uint64_t more = 0;
  };
  std::array<Kind, 16> kinds_;
};

}  // namespace tagwrench

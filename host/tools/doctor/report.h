// One line a finding.
#pragma once

#include <array>
#include <cstdint>
#include <ostream>
#include <string_view>

namespace tagwrench {

enum class Mark : std::uint8_t {
  ok,
  absent,   ///< not there, and not needed
  missing,  ///< the remedy stands behind it
};

class Report {
 public:
  explicit Report(std::ostream& out) : out_(out) {}
  void line(Mark mark, std::string_view text) {
    static constexpr std::array<std::string_view, 3> kMarks = {"ok", "--", "!!"};
    out_ << kMarks[static_cast<std::size_t>(mark)] << "  " << text << '\n';
  }

 private:
  std::ostream& out_;
};

}  // namespace tagwrench

// What a run says to people: lines to the outputs that show them, else to the log; diagnostics once
// each.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "host/output/output.h"
#include "host/tracker/tracker.h"

namespace tagwrench {

class StatusLines {
 public:
  /// Borrowed.
  explicit StatusLines(std::span<Output* const> outputs) noexcept : outputs_(outputs) {}

  /// An empty line is none.
  void say(std::string_view line) noexcept;
  /// Why the target is not held. What was wrong is taken away once it is held.
  void say_diagnostic(const Track& track) noexcept;

  /// The last line that said why the target is not held.
  const std::string& trouble() const noexcept { return trouble_; }

 private:
  std::span<Output* const> outputs_;
  Diagnostic last_diagnostic_ = Diagnostic::none;
  bool trouble_shown_ = false;  ///< since the target was last held
  std::string trouble_;
};

}  // namespace tagwrench

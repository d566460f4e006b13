#include "host/app/status_lines.h"

#include <exception>

#include "host/core/log.h"
#include "host/tracker/diagnostic_text.h"

namespace tagwrench {

void StatusLines::say(std::string_view line) noexcept {
  if (line.empty()) return;
  bool shown = false;
  for (Output* output : outputs_) shown = output->notice(line) || shown;
  if (!shown) log_info(line);
}

void StatusLines::say_diagnostic(const Track& track) noexcept {
  if (track.status == Status::ok && trouble_shown_) {
    trouble_shown_ = false;
    for (Output* output : outputs_) output->notice({});
  }
  // The tracker itself sees to it that troubles are not said too often.
  const bool trouble = is_trouble(track.diagnostic);
  if (track.diagnostic == Diagnostic::none || (track.diagnostic == last_diagnostic_ && !trouble))
    return;
  last_diagnostic_ = track.diagnostic;
  try {
    const std::string line = diagnostic_text(track.diagnostic, track.details);
    if (track.status != Status::ok && track.diagnostic != Diagnostic::rest_learned) trouble_ = line;
    trouble_shown_ = trouble_shown_ || (trouble && track.status != Status::ok);
    say(line);
  } catch (const std::exception&) {
    return;  // out of memory: unsaid
  }
}

}  // namespace tagwrench

#include "host/web/bridge/web_output.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace tagwrench {

WebOutput::WebOutput(Parts parts) : parts_(std::move(parts)) {}

std::string_view WebOutput::service() noexcept {
  parts_.control->run_requests(*this);
  return {};
}

/// Others show it too.
bool WebOutput::notice(std::string_view line) noexcept {
  if (recording_ != nullptr) recording_->note(line);
  try {
    std::vector<std::string> programs;
    if (parts_.programs != nullptr) {
      for (const SpnavPeer& peer : parts_.programs->programs())
        programs.emplace_back(peer.name.data());
    }
    parts_.news(std::string(line), std::move(programs));
  } catch (const std::exception&) {
    return false;  // out of memory: unsaid
  }
  return false;
}

void WebOutput::frame(const LoggedFrame& all) noexcept {
  parts_.feed->sample(all.sample, &all.track);
  if (parts_.feed->wants_picture(std::chrono::steady_clock::now())) parts_.feed->picture(all);
  look(all.track, all.sample);
  if (recording_ != nullptr) recording_->frame(all);
  if (next_ != nullptr) next_->frame(all);
}

void WebOutput::missing(const Sample& sample) noexcept {
  parts_.feed->sample(sample, nullptr);
  Track nothing;
  nothing.status = Status::lost;
  look(nothing, sample);
  if (recording_ != nullptr) recording_->missing(sample);
  if (next_ != nullptr) next_->missing(sample);
}

void WebOutput::disconnected(std::string_view detail) noexcept {
  if (recording_ != nullptr) recording_->disconnected(detail);
  if (next_ != nullptr) next_->disconnected(detail);
}

void WebOutput::reconnected(std::string_view detail) noexcept {
  if (recording_ != nullptr) recording_->reconnected(detail);
  if (next_ != nullptr) next_->reconnected(detail);
}

/// The tracker says a trouble now and then; it holds until the target is held.
void WebOutput::look(const Track& track, const Sample& sample) noexcept {
  seen_.status = sample.status;
  seen_.zero_state = sample.zero_state;
  seen_.corners = track.corners;
  seen_.corner_count = track.corner_count;
  seen_.residual_fraction = track.residual_fraction;
  if (skipped_ != nullptr) seen_.skipped = *skipped_;
  if (track.status == Status::ok) {
    seen_.trouble = Diagnostic::none;
  } else if (is_trouble(track.diagnostic)) {
    seen_.trouble = track.diagnostic;
    seen_.details = track.details;
  }
  parts_.views->seen.put(seen_);
  if (parts_.board != nullptr) parts_.views->board.put(parts_.board->reading());
}

}  // namespace tagwrench

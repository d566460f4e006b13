#include "host/web/server/sample_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "host/output/output.h"
#include "host/output/sample_text.h"

namespace tagwrench {
namespace {

/// JSON has no other numbers.
double finite(double value) { return std::isfinite(value) ? value : 0; }

void append_six(std::string& text, std::string_view key, const Vector6& six) {
  fmt::format_to(std::back_inserter(text), R"(,"{}":[{},{},{},{},{},{}])", key, finite(six[0]),
                 finite(six[1]), finite(six[2]), finite(six[3]), finite(six[4]), finite(six[5]));
}

}  // namespace

std::string sample_text(const LiveSample& live) {
  LineBuffer buffer;
  const std::string_view line = json_line(buffer, live.sample);
  std::string text(line.substr(0, line.rfind('}')));
  const bool numbers = carries_numbers(shown_status(live.sample));
  append_six(text, "zero", live.sample.zero);
  append_six(text, "motion", numbers ? live.sample.deflection : Vector6::Zero());
  fmt::format_to(std::back_inserter(text),
                 R"(,"zero_state":"{}","buttons":{},"residual_px":{:.4g},"tags_held":{}}})",
                 name(live.sample.zero_state), live.sample.buttons, finite(live.residual_px),
                 live.tags_held);
  return text;
}

void SampleStream::pull() {
  const std::uint64_t written = feed_.written();
  if (written - next_ > LiveFeed::kKept) next_ = written - LiveFeed::kKept;
  for (; next_ < written; ++next_) {
    const std::optional<LiveSample> live = feed_.read(next_);
    if (!live) continue;  // overwritten meanwhile
    window_.add(live->sample.output_time, latency_us(live->sample));
    frames_ = live->frames;
    dropped_ = live->dropped;
    entries_.push_back({next_, sample_text(*live)});
    if (entries_.size() > kMax) entries_.pop_front();
    made_ = nullptr;
  }
}

void SampleStream::skip() {
  next_ = feed_.written();
  entries_.clear();
  window_.clear();
  made_ = nullptr;
}

std::shared_ptr<const std::string> SampleStream::message(std::uint64_t from) {
  if (from >= next_ || entries_.empty()) return nullptr;
  if (made_ != nullptr && made_from_ == from) return made_;
  const auto first = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.position >= from; });
  if (first == entries_.end()) return nullptr;
  std::string text = R"({"type":"samples","samples":[)";
  for (auto entry = first; entry != entries_.end(); ++entry) {
    if (entry != first) text += ',';
    text += entry->text;
  }
  const auto sent = static_cast<std::uint64_t>(std::distance(first, entries_.end()));
  fmt::format_to(std::back_inserter(text), R"(],"lost":{}}})", next_ - from - sent);
  made_ = std::make_shared<const std::string>(std::move(text));
  made_from_ = from;
  return made_;
}

LiveFigures SampleStream::figures(TimePoint now) const {
  LiveFigures out = window_.figures(now);
  out.frames = frames_;
  out.dropped = dropped_;
  return out;
}

}  // namespace tagwrench

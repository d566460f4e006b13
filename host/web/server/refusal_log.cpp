#include "host/web/server/refusal_log.h"

#include "host/web/server/static_site.h"

namespace tagwrench {
namespace {

constexpr std::size_t kShown = 60;

std::string harmless(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, kShown)) out += c > ' ' && c < 127 && c != '"' ? c : '?';
  return out;
}

}  // namespace

std::string RefusalLog::line(Refusal refusal, std::string_view detail, TimePoint now) {
  Kind& kind = kinds_[static_cast<std::size_t>(refusal) % kinds_.size()];
  if (kind.said && now - kind.when < kQuiet) {
    ++kind.more;
    return {};
  }
  std::string line = "web: refused: " + std::string(refusal_text(refusal));
  if (!detail.empty()) line += " (\"" + harmless(detail) + "\")";
  if (kind.more > 0) line += " " + std::to_string(kind.more) + " more of these before.";
  kind = {true, now, 0};
  return line;
}

}  // namespace tagwrench

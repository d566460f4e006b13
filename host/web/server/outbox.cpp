#include "host/web/server/outbox.h"

#include <algorithm>

namespace tagwrench {

bool Outbox::keep(std::shared_ptr<const std::string> text) {
  if (kept_.size() == kMaxKept) return false;
  kept_.push_back(std::move(text));
  return true;
}

void Outbox::replace(std::string_view type, std::shared_ptr<const std::string> text) {
  const auto same = std::find_if(latest_.begin(), latest_.end(),
                                 [&](const auto& waiting) { return waiting.first == type; });
  if (same != latest_.end())
    same->second = std::move(text);
  else if (latest_.size() < kMaxTypes)
    latest_.emplace_back(type, std::move(text));
}

void Outbox::replace_picture(std::shared_ptr<const std::vector<std::uint8_t>> picture) {
  picture_ = std::move(picture);
}

std::shared_ptr<const std::string> Outbox::next_text() {
  std::shared_ptr<const std::string> text;
  if (!kept_.empty()) {
    text = std::move(kept_.front());
    kept_.pop_front();
  } else if (!latest_.empty()) {
    text = std::move(latest_.front().second);
    latest_.pop_front();
  }
  return text;
}

std::shared_ptr<const std::vector<std::uint8_t>> Outbox::next_picture() {
  return std::exchange(picture_, nullptr);
}

}  // namespace tagwrench

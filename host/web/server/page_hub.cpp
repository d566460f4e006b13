#include "host/web/server/page_hub.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "host/core/json/json_text.h"
#include "host/web/server/page_message.h"

namespace tagwrench {
namespace {

using nlohmann::json;

// Of RFC 6455, section 7.4.1.
constexpr std::uint16_t kGoingAway = 1001;
constexpr std::uint16_t kPolicyError = 1008;

std::shared_ptr<const std::string> shared_text(const json& message) {
  return std::make_shared<const std::string>(dump_json(message));
}

std::string message_type(const json& message) { return message.value("type", std::string()); }

}  // namespace

PageHub::PageHub(boost::asio::io_context& context, const WebPatience& patience)
    : timer_(context), patience_(patience) {}

/// A page may go while it is told: what is iterated is a copy.
template <typename Work>
void PageHub::each(Work work) {
  std::vector<std::shared_ptr<PageSocket>> all;
  for (const auto& [id, page] : pages_) all.push_back(page);
  for (const auto& page : all) work(*page);
}

void PageHub::add(PageUpgrade&& request) {
  const std::uint64_t id = next_page_++;
  const auto page = PageSocket::make(std::move(request), id, *this, patience_);
  pages_.emplace(id, page);
  page->open();
}

void PageHub::opened(PageSocket& page) {
  if (!ticking_) {
    stream_.skip();
    tick();
  }
  page.next_sample = stream_.end();
  if (hello_ != nullptr) page.keep(hello_);
  want_pictures();
  if (handler_ != nullptr) handler_->page_came(page.id());
}

void PageHub::gone(std::uint64_t page) {
  const auto found = pages_.find(page);
  if (found == pages_.end()) return;
  const bool was_open = found->second->was_open();
  pages_.erase(found);
  want_pictures();
  if (was_open && handler_ != nullptr) handler_->page_gone(page);
}

void PageHub::said(PageSocket& page, std::string_view text) {
  PageMessage message = parse_page_message(text);
  if (!message.id) {
    misbehaved(Refusal::nonsense);
    return page.close(kPolicyError, message.fault);
  }
  if (!message.fault.empty())
    return answer(page.id(), *message.id, false, std::string(message.fault));
  if (message.what != "pictures") return pass_on(page, std::move(message));
  const auto on = message.arguments.find("on");
  const bool valid = on != message.arguments.end() && on->is_boolean();
  if (valid) page.wants_pictures = on->get<bool>();
  want_pictures();
  answer(page.id(), *message.id, valid, valid ? "" : "pictures: \"on\" is true or false");
}

void PageHub::pass_on(PageSocket& page, PageMessage message) {
  try {
    handler_->handle(
        {page.id(), *message.id, std::move(message.what), std::move(message.arguments)});
  } catch (const std::exception& error) {
    answer(page.id(), *message.id, false, error.what());
  }
}

void PageHub::misbehaved(Refusal refusal) {
  if (on_misbehaviour) on_misbehaviour(refusal);
}

std::shared_ptr<const std::string> PageHub::samples(PageSocket& page) {
  return stream_.message(std::exchange(page.next_sample, stream_.end()));
}

void PageHub::tick() {
  ticking_ = !pages_.empty();
  if (!ticking_) return;
  timer_.after(kTick, [this] { tick(); });
  stream_.pull();
  take_picture();
  each([](PageSocket& page) { page.samples_due(); });
}

void PageHub::take_picture() {
  const LivePicture* const picture = feed_.take_picture();
  if (picture == nullptr) return;
  const std::optional<ImageView> whole = maker_.decode(*picture);
  if (whole && watcher_) watcher_(*whole);
  if (whole && pictures_wanted_)
    if (auto message = maker_.message(*picture, *whole)) send_picture(std::move(message));
  feed_.release(picture);
}

void PageHub::want_pictures() {
  bool wanted = false;
  for (const auto& [id, page] : pages_) wanted = wanted || page->wants_pictures;
  pictures_wanted_ = wanted;
  const bool watched = watcher_ && !pages_.empty();
  feed_.want_pictures(wanted ? kPictureEvery : watched ? kWatchEvery : Duration::max());
}

void PageHub::check(TimePoint now) {
  each([now](PageSocket& page) { page.check(now); });
}

void PageHub::close_all() {
  each([](PageSocket& page) { page.close(kGoingAway, "the program ends"); });
}

void PageHub::deliver(PageSocket& page, std::string_view type, const Text& text) {
  if (type == "say" || type == "answer")
    page.keep(text);
  else
    page.replace(type, text);
}

void PageHub::answer(std::uint64_t page, std::int64_t id, bool ok, std::string text) {
  answer(page, id, ok, std::move(text), nullptr);
}

void PageHub::answer(std::uint64_t page, std::int64_t id, bool ok, std::string text,
                     const json& data) {
  json message{{"type", "answer"}, {"id", id}, {"ok", ok}, {"text", std::move(text)}};
  if (!data.is_null()) message["data"] = data;
  send(page, message);
}

void PageHub::send(std::uint64_t page, const json& message) {
  const auto found = pages_.find(page);
  if (found == pages_.end()) return;
  const std::shared_ptr<PageSocket> kept = found->second;
  deliver(*kept, message_type(message), shared_text(message));
}

void PageHub::send_all(const json& message) {
  if (pages_.empty()) return;
  const Text text = shared_text(message);
  const std::string type = message_type(message);
  each([&](PageSocket& page) { deliver(page, type, text); });
}

void PageHub::send_picture(std::shared_ptr<const std::vector<std::uint8_t>> message) {
  each([&](PageSocket& page) { page.show(message); });
}

void PageHub::set_hello(const json& hello) {
  hello_ = shared_text(hello);
  each([&](PageSocket& page) { page.replace("hello", hello_); });
}

void PageHub::watch_pictures(std::function<void(const ImageView&)> watcher) {
  watcher_ = std::move(watcher);
  want_pictures();
}

}  // namespace tagwrench

#include "host/web/server/page_hub.h"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>

#include "host/core/json/json_text.h"

namespace tagwrench {
namespace {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::beast::error_code;
using nlohmann::json;

constexpr int kSendBuffer = 128 * 1024;  // the kernel's; what waits longer is replaced, not queued

TimePoint page_clock() { return std::chrono::steady_clock::now(); }

Text shared_text(const json& message) {
  return std::make_shared<const std::string>(dump_json(message));
}

std::string message_type(const json& message) { return message.value("type", std::string()); }

}  // namespace

bool Outbox::keep(Text text) {
  if (kept_.size() == kMaxKept) return false;
  kept_.push_back(std::move(text));
  return true;
}

void Outbox::replace(std::string_view type, Text text) {
  const auto same = std::find_if(latest_.begin(), latest_.end(),
                                 [&](const auto& waiting) { return waiting.first == type; });
  if (same != latest_.end())
    same->second = std::move(text);
  else if (latest_.size() < kMaxTypes)
    latest_.emplace_back(type, std::move(text));
}

Text Outbox::next_text() {
  Text text;
  if (!kept_.empty()) {
    text = std::move(kept_.front());
    kept_.pop_front();
  } else if (!latest_.empty()) {
    text = std::move(latest_.front().second);
    latest_.pop_front();
  }
  return text;
}

/// One page: its WebSocket, what it is still to be sent, and what it may send.
class PageHub::Page : public std::enable_shared_from_this<Page> {
 public:
  Page(asio::ip::tcp::socket socket, HttpRequest request, std::uint64_t page, PageHub& hub)
      : id(page), stream_(std::move(socket)), hub_(hub), request_(std::move(request)) {
    error_code ignored;
    stream_.next_layer().set_option(asio::ip::tcp::no_delay(true), ignored);
    stream_.next_layer().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    stream_.read_message_max(kMaxRequest);
    stream_.auto_fragment(false);
    stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(boost::beast::http::field::server, "tagwrench");
      if (response.result() == boost::beast::http::status::switching_protocols)
        response.set(boost::beast::http::field::sec_websocket_protocol,
                     boost::beast::string_view(RequestGuard::kProtocol.data(),
                                               RequestGuard::kProtocol.size()));
    }));
  }

  void open() {
    heard_ = pinged_ = page_clock();
    stream_.control_callback([this](websocket::frame_type, boost::beast::string_view) {
      heard_ = page_clock();
      if (!rate_.count(heard_)) drop();
    });
    stream_.async_accept(request_, [self = shared_from_this()](const error_code& error) {
      if (error || self->ended_) return self->end();
      self->open_ = true;
      self->heard_ = page_clock();
      self->hub_.opened(*self);
      self->read();
      self->pump();
    });
  }
  /// Goes out in its turn, or the page is closed: it has not read for long.
  void keep(Text text) {
    if (!is_open()) return;
    if (!outbox_.keep(std::move(text)))
      return close(websocket::close_code::try_again_later, "too slow");
    pump();
  }
  void replace(std::string_view type, Text text) {
    if (!is_open()) return;
    outbox_.replace(type, std::move(text));
    pump();
  }
  void show(Picture picture) {
    if (!is_open() || !wants_pictures) return;
    outbox_.replace_picture(std::move(picture));
    pump();
  }
  /// There may be new ones.
  void samples_due() {
    samples_due_ = true;
    pump();
  }
  void check(TimePoint now) {
    const bool deaf = now - heard_ > hub_.patience_.silence;
    const bool stuck = busy_ && now - busy_since_ > hub_.patience_.unread;
    const bool stays = closing_ && now - pinged_ > kGoodBye;
    if (deaf || stuck || stays) return drop();
    if (!is_open() || now - pinged_ < hub_.patience_.ping) return;
    pinged_ = now;
    ping_due_ = true;
    pump();
  }
  void close(std::uint16_t code, std::string_view reason) {
    if (closing_ || ended_) return;
    if (!open_) return drop();
    closing_ = true;
    pinged_ = page_clock();
    const websocket::close_reason why(static_cast<websocket::close_code>(code),
                                      boost::beast::string_view(reason.data(), reason.size()));
    stream_.async_close(why, [self = shared_from_this()](const error_code&) { self->end(); });
  }
  bool was_open() const noexcept { return open_; }

  const std::uint64_t id;
  std::uint64_t next_sample = 0;  ///< position of the first that it has not seen
  bool wants_pictures = false;

 private:
  bool is_open() const noexcept { return open_ && !closing_; }
  void read() {
    stream_.async_read(incoming_,
                       [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
                         self->take(error);
                       });
  }
  void take(const error_code& error) {
    if (error == websocket::error::message_too_big) hub_.on_misbehaviour(Refusal::flood);
    if (error) return end();
    heard_ = page_clock();
    if (!is_open()) return read();  // until its good-bye comes
    if (!rate_.count(heard_)) {
      hub_.on_misbehaviour(Refusal::flood);
      close(websocket::close_code::policy_error, "more than 40 messages a second");
    } else if (!stream_.got_text()) {
      close(websocket::close_code::unknown_data, "text only");
    } else {
      const auto bytes = incoming_.cdata();
      hub_.said(*this, {static_cast<const char*>(bytes.data()), bytes.size()});
    }
    incoming_.consume(incoming_.size());
    read();
  }
  void pump() {
    if (busy_ || !is_open()) return;
    if (ping_due_) return ping();
    if (auto text = outbox_.next_text()) return write(text, text->data(), text->size(), true);
    if (std::exchange(samples_due_, false))
      if (auto text = hub_.stream_.message(std::exchange(next_sample, hub_.stream_.end())))
        return write(text, text->data(), text->size(), true);
    if (auto picture = outbox_.next_picture())
      write(picture, picture->data(), picture->size(), false);
  }
  void write(std::shared_ptr<const void> owner, const void* bytes, std::size_t size, bool text) {
    busy_ = true;
    busy_since_ = page_clock();
    stream_.text(text);
    stream_.async_write(
        asio::buffer(bytes, size),
        [self = shared_from_this(), owner = std::move(owner)](
            const error_code& error, std::size_t /*sent*/) { self->finished(error); });
  }
  void ping() {
    ping_due_ = false;
    busy_ = true;
    busy_since_ = page_clock();
    stream_.async_ping(
        {}, [self = shared_from_this()](const error_code& error) { self->finished(error); });
  }
  void finished(const error_code& error) {
    busy_ = false;
    if (error) return end();
    pump();
  }
  void drop() noexcept {
    error_code ignored;
    stream_.next_layer().close(ignored);  // whatever waits for it ends with an error
  }
  void end() {
    if (std::exchange(ended_, true)) return;
    closing_ = true;
    drop();
    hub_.gone(id);
  }

  websocket::stream<asio::ip::tcp::socket, false> stream_;
  PageHub& hub_;
  HttpRequest request_;
  boost::beast::flat_buffer incoming_{kMaxRequest + 1};
  Outbox outbox_;
  MessageRate<kMaxRequestsPerSecond> rate_;
  bool open_ = false;
  bool closing_ = false;
  bool ended_ = false;
  bool busy_ = false;  ///< writing
  bool ping_due_ = false;
  bool samples_due_ = false;
  TimePoint busy_since_{};
  TimePoint heard_{};
  TimePoint pinged_{};
};

PageHub::PageHub(boost::asio::io_context& context, const WebPatience& patience)
    : timer_(context), patience_(patience) {}

PageHub::~PageHub() = default;

/// A page may go while it is told: what is iterated is a copy.
template <typename Work>
void PageHub::each(Work work) {
  std::vector<std::shared_ptr<Page>> all;
  for (const auto& [id, page] : pages_) all.push_back(page);
  for (const auto& page : all) work(*page);
}

void PageHub::add(asio::ip::tcp::socket socket, HttpRequest request) {
  const std::uint64_t id = next_page_++;
  const auto page = std::make_shared<Page>(std::move(socket), std::move(request), id, *this);
  pages_.emplace(id, page);
  page->open();
}

void PageHub::opened(Page& page) {
  if (!ticking_) {
    stream_.skip();
    tick();
  }
  page.next_sample = stream_.end();
  if (hello_ != nullptr) page.keep(hello_);
  want_pictures();
  if (handler_ != nullptr) handler_->page_came(page.id);
}

void PageHub::gone(std::uint64_t page) {
  const auto found = pages_.find(page);
  if (found == pages_.end()) return;
  const bool was_open = found->second->was_open();
  pages_.erase(found);
  want_pictures();
  if (was_open && handler_ != nullptr) handler_->page_gone(page);
}

void PageHub::said(Page& page, std::string_view text) {
  PageMessage message = parse_page_message(text);
  if (!message.id) {
    on_misbehaviour(Refusal::nonsense);
    return page.close(websocket::close_code::policy_error, message.fault);
  }
  if (!message.fault.empty())
    return answer(page.id, *message.id, false, std::string(message.fault));
  if (message.what != "pictures") {
    try {
      return handler_->handle(
          {page.id, *message.id, std::move(message.what), std::move(message.arguments)});
    } catch (const std::exception& error) {
      return answer(page.id, *message.id, false, error.what());
    }
  }
  const auto on = message.arguments.find("on");
  const bool valid = on != message.arguments.end() && on->is_boolean();
  if (valid) page.wants_pictures = on->get<bool>();
  want_pictures();
  answer(page.id, *message.id, valid, valid ? "" : "pictures: \"on\" is true or false");
}

void PageHub::tick() {
  ticking_ = !pages_.empty();
  if (!ticking_) return;
  timer_.after(kTick, [this] { tick(); });
  stream_.pull();
  if (const LivePicture* const picture = feed_.take_picture()) {
    const TimePoint begin = page_clock();
    const std::optional<ImageView> whole = maker_.decode(*picture);
    if (whole && watcher_) watcher_(*whole);
    if (whole && pictures_wanted_)
      if (auto message = maker_.message(*picture, *whole)) send_picture(message);
    feed_.release(picture);
    picture_took_ = std::min(page_clock() - begin, kLongestRest);
    want_pictures();
  }
  each([](Page& page) { page.samples_due(); });
}

void PageHub::want_pictures() {
  bool wanted = false;
  for (const auto& [id, page] : pages_) wanted = wanted || page->wants_pictures;
  pictures_wanted_ = wanted;
  const bool watched = watcher_ && !pages_.empty();
  // On a busy machine one takes long; what pages ask for is seen to in as long a rest.
  const Duration least = 2 * picture_took_;
  if (wanted)
    feed_.want_pictures(std::max(kPictureEvery, least));
  else
    feed_.want_pictures(watched ? std::max(kWatchEvery, least) : Duration::max());
}

void PageHub::check(TimePoint now) {
  each([now](Page& page) { page.check(now); });
}

void PageHub::close_all() {
  each([](Page& page) { page.close(websocket::close_code::going_away, "the program ends"); });
}

void PageHub::deliver(Page& page, std::string_view type, const Text& text) {
  if (type == "say" || type == "answer")
    page.keep(text);
  else
    page.replace(type, text);
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
  const std::shared_ptr<Page> kept = found->second;
  deliver(*kept, message_type(message), shared_text(message));
}

void PageHub::send_all(const json& message) {
  if (pages_.empty()) return;
  const Text text = shared_text(message);
  const std::string type = message_type(message);
  each([&](Page& page) { deliver(page, type, text); });
}

void PageHub::send_picture(const Picture& message) {
  each([&](Page& page) { page.show(message); });
}

void PageHub::set_hello(const json& hello) {
  hello_ = shared_text(hello);
  each([&](Page& page) { page.replace("hello", hello_); });
}

void PageHub::watch_pictures(std::function<void(const ImageView&)> watcher) {
  watcher_ = std::move(watcher);
  want_pictures();
}

}  // namespace tagwrench

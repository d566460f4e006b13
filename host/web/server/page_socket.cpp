#include "host/web/server/page_socket.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <utility>

#include "host/web/server/outbox.h"
#include "host/web/server/page_upgrade.h"
#include "host/web/server/web_server.h"

namespace tagwrench {
namespace {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::beast::error_code;

constexpr int kSendBuffer = 128 * 1024;  // the kernel's; what waits longer is replaced, not queued

TimePoint page_clock() { return std::chrono::steady_clock::now(); }

class WebSocketPage final : public PageSocket, public std::enable_shared_from_this<WebSocketPage> {
 public:
  WebSocketPage(PageUpgrade&& request, std::uint64_t id, PageOwner& daemon,
                const WebPatience& patience);

  void open() override;
  void keep(std::shared_ptr<const std::string> text) override;
  void replace(std::string_view type, std::shared_ptr<const std::string> text) override;
  void show(std::shared_ptr<const std::vector<std::uint8_t>> picture) override;
  void samples_due() override;
  void check(TimePoint now) override;
  void close(std::uint16_t code, std::string_view reason) override;

  std::uint64_t id() const noexcept override { return id_; }
  bool was_open() const noexcept override { return open_; }

 private:
  bool is_open() const noexcept { return open_ && !closing_; }
  void read();
  void take(const error_code& error);
  void pump();
  void write(std::shared_ptr<const void> owner, const void* bytes, std::size_t size, bool text);
  void ping();
  void finished(const error_code& error);
  void drop() noexcept;
  void end();

  websocket::stream<asio::ip::tcp::socket, false> stream_;
  std::uint64_t id_;
  PageOwner& daemon_;
  WebPatience patience_;
  WebSocketRequest request_;
  boost::beast::flat_buffer incoming_;
  Outbox outbox_;
  MessageRate<WebServer::kMaxPageRequestsPerSecond> rate_;
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

WebSocketPage::WebSocketPage(PageUpgrade&& request, std::uint64_t id, PageOwner& daemon,
                             const WebPatience& patience)
    : stream_(std::move(request.socket)),
      id_(id),
      daemon_(daemon),
      patience_(patience),
      request_(std::move(request.request)),
      incoming_(WebServer::kMaxPageRequest + 1) {
  error_code ignored;
  stream_.next_layer().set_option(asio::ip::tcp::no_delay(true), ignored);
  stream_.next_layer().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  stream_.read_message_max(WebServer::kMaxPageRequest);
  stream_.auto_fragment(false);
  stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(boost::beast::http::field::server, "tagwrench");
    if (response.result() == boost::beast::http::status::switching_protocols)
      response.set(boost::beast::http::field::sec_websocket_protocol,
                   boost::beast::string_view(RequestGuard::kProtocol.data(),
                                             RequestGuard::kProtocol.size()));
  }));
}

void WebSocketPage::open() {
  heard_ = pinged_ = page_clock();
  stream_.control_callback([this](websocket::frame_type, boost::beast::string_view) {
    heard_ = page_clock();
    if (!rate_.count(heard_)) drop();
  });
  stream_.async_accept(request_, [self = shared_from_this()](const error_code& error) {
    if (error || self->ended_) return self->end();
    self->open_ = true;
    self->heard_ = page_clock();
    self->daemon_.opened(*self);
    self->read();
    self->pump();
  });
}

void WebSocketPage::read() {
  stream_.async_read(incoming_,
                     [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
                       self->take(error);
                     });
}

void WebSocketPage::take(const error_code& error) {
  if (error == websocket::error::message_too_big) daemon_.misbehaved(Refusal::flood);
  if (error) return end();
  heard_ = page_clock();
  if (!is_open()) return read();  // until its good-bye comes
  if (!rate_.count(heard_)) {
    daemon_.misbehaved(Refusal::flood);
    close(websocket::close_code::policy_error, "more than 40 messages a second");
  } else if (!stream_.got_text()) {
    close(websocket::close_code::unknown_data, "text only");
  } else {
    const auto bytes = incoming_.cdata();
    daemon_.said(*this, {static_cast<const char*>(bytes.data()), bytes.size()});
  }
  incoming_.consume(incoming_.size());
  read();
}

void WebSocketPage::keep(std::shared_ptr<const std::string> text) {
  if (!is_open()) return;
  if (!outbox_.keep(std::move(text)))
    return close(websocket::close_code::try_again_later, "too slow");
  pump();
}

void WebSocketPage::replace(std::string_view type, std::shared_ptr<const std::string> text) {
  if (!is_open()) return;
  outbox_.replace(type, std::move(text));
  pump();
}

void WebSocketPage::show(std::shared_ptr<const std::vector<std::uint8_t>> picture) {
  if (!is_open() || !wants_pictures) return;
  outbox_.replace_picture(std::move(picture));
  pump();
}

void WebSocketPage::samples_due() {
  samples_due_ = true;
  pump();
}

void WebSocketPage::check(TimePoint now) {
  const bool deaf = now - heard_ > patience_.silence;
  const bool stuck = busy_ && now - busy_since_ > patience_.unread;
  const bool stays = closing_ && now - pinged_ > kGoodBye;
  if (deaf || stuck || stays) return drop();
  if (!is_open() || now - pinged_ < patience_.ping) return;
  pinged_ = now;
  ping_due_ = true;
  pump();
}

void WebSocketPage::pump() {
  if (busy_ || !is_open()) return;
  if (ping_due_) return ping();
  if (auto text = outbox_.next_text()) return write(text, text->data(), text->size(), true);
  if (std::exchange(samples_due_, false))
    if (auto text = daemon_.samples(*this)) return write(text, text->data(), text->size(), true);
  if (auto picture = outbox_.next_picture())
    write(picture, picture->data(), picture->size(), false);
}

void WebSocketPage::write(std::shared_ptr<const void> owner, const void* bytes, std::size_t size,
                          bool text) {
  busy_ = true;
  busy_since_ = page_clock();
  stream_.text(text);
  stream_.async_write(
      asio::buffer(bytes, size),
      [self = shared_from_this(), owner = std::move(owner)](
          const error_code& error, std::size_t /*sent*/) { self->finished(error); });
}

void WebSocketPage::ping() {
  ping_due_ = false;
  busy_ = true;
  busy_since_ = page_clock();
  stream_.async_ping(
      {}, [self = shared_from_this()](const error_code& error) { self->finished(error); });
}

void WebSocketPage::finished(const error_code& error) {
  busy_ = false;
  if (error) return end();
  pump();
}

void WebSocketPage::close(std::uint16_t code, std::string_view reason) {
  if (closing_ || ended_) return;
  if (!open_) return drop();
  closing_ = true;
  pinged_ = page_clock();
  const websocket::close_reason why(static_cast<websocket::close_code>(code),
                                    boost::beast::string_view(reason.data(), reason.size()));
  stream_.async_close(why, [self = shared_from_this()](const error_code&) { self->end(); });
}

void WebSocketPage::drop() noexcept {
  error_code ignored;
  stream_.next_layer().close(ignored);  // whatever waits for it ends with an error
}

void WebSocketPage::end() {
  if (std::exchange(ended_, true)) return;
  closing_ = true;
  drop();
  daemon_.gone(id_);
}

}  // namespace

std::shared_ptr<PageSocket> PageSocket::make(PageUpgrade&& request, std::uint64_t id,
                                             PageOwner& daemon, const WebPatience& patience) {
  return std::make_shared<WebSocketPage>(std::move(request), id, daemon, patience);
}

}  // namespace tagwrench

// One page: its WebSocket, what it is still to be sent, and what it may send.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "host/web/server/message_rate.h"
#include "host/web/server/outbox.h"
#include "host/web/server/request_guard.h"
#include "host/web/server/web_server.h"

namespace tagwrench {

using WebSocketRequest = boost::beast::http::request<boost::beast::http::empty_body>;

class PageSocket;

/// Whom a page tells.
class PageKeeper {
 public:
  virtual ~PageKeeper() = default;
  virtual void opened(PageSocket& page) = 0;
  virtual void said(PageSocket& page, std::string_view text) = 0;
  /// What the page has not seen yet; null: nothing.
  virtual std::shared_ptr<const std::string> samples(PageSocket& page) = 0;
  virtual void misbehaved(Refusal refusal) = 0;
  /// The last call.
  virtual void gone(std::uint64_t page) = 0;
};

class PageSocket : public std::enable_shared_from_this<PageSocket> {
 public:
  static constexpr Duration kGoodBye = std::chrono::milliseconds(500);

  PageSocket(boost::asio::ip::tcp::socket socket, std::uint64_t id, PageKeeper& keeper,
             const WebPatience& patience);

  void open(WebSocketRequest request);
  /// Goes out in its turn, or the page is closed: it has not read for long.
  void keep(std::shared_ptr<const std::string> text);
  void replace(std::string_view type, std::shared_ptr<const std::string> text);
  void show(std::shared_ptr<const std::vector<std::uint8_t>> picture);
  /// There may be new ones.
  void samples_due();
  /// Once or more a second: pings, and lets go a page that does not answer or read.
  void check(TimePoint now);
  void close(std::uint16_t code, std::string_view reason);

  std::uint64_t id() const noexcept { return id_; }
  bool is_open() const noexcept { return open_ && !closing_; }
  bool was_open() const noexcept { return open_; }

  std::uint64_t next_sample = 0;  ///< position of the first that it has not seen
  bool wants_pictures = false;

 private:
  using Error = boost::beast::error_code;

  void read();
  void take(const Error& error);
  void pump();
  void write(std::shared_ptr<const void> owner, const void* bytes, std::size_t size, bool text);
  void ping();
  void finished(const Error& error);
  void drop() noexcept;
  void end();

  boost::beast::websocket::stream<boost::asio::ip::tcp::socket, false> stream_;
  std::uint64_t id_;
  PageKeeper& keeper_;
  WebPatience patience_;
  WebSocketRequest request_;
  boost::beast::flat_buffer incoming_;
  Outbox outbox_;
  MessageRate<WebServer::kMostAsksASecond> rate_;
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

}  // namespace tagwrench

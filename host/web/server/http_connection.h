// One connection that asks for files, or becomes a page. Everything has its time.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/web/server/page_socket.h"
#include "host/web/server/static_site.h"

namespace tagwrench {

class HttpConnection;

/// Whom a connection asks.
class ConnectionKeeper {
 public:
  virtual ~ConnectionKeeper() = default;
  virtual WebAnswer answer(const WebRequest& request) = 0;
  /// Whether the request may become a page's socket.
  virtual Refusal admits(const WebRequest& request) = 0;
  virtual void becomes_page(boost::asio::ip::tcp::socket socket, WebSocketRequest request) = 0;
  /// With what the stranger sent, if that helps.
  virtual void refused(Refusal refusal, std::string_view detail) = 0;
  /// The last call.
  virtual void closed(HttpConnection& connection) = 0;
};

class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  static constexpr std::uint32_t kLongestHeader = 8192;
  static constexpr Duration kLinger = std::chrono::seconds(1);

  HttpConnection(boost::asio::ip::tcp::socket socket, ConnectionKeeper& keeper, Duration patience);

  void serve();
  /// One answer to whatever it asks, and good-bye.
  void turn_away(Refusal refusal);
  void check(TimePoint now);
  void drop() noexcept;
  bool is_turned_away() const noexcept { return turned_away_; }

 private:
  using Error = boost::beast::error_code;
  using Parser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

  void handle(const Error& error);
  void handle_request();
  void failed(const Error& error);
  void respond(WebAnswer answer, bool with_body);
  void send(std::size_t size);
  void send_file();
  void sent(const Error& error);
  void linger();
  void discard();
  void end();

  boost::asio::ip::tcp::socket socket_;
  ConnectionKeeper& keeper_;
  Duration patience_;
  boost::beast::flat_buffer incoming_;
  std::optional<Parser> parser_;
  std::vector<char> outgoing_;
  OpenedFile file_;  ///< of the answer; what is left of it
  std::uint64_t file_left_ = 0;
  bool keep_ = false;  ///< for the next request
  bool turned_away_ = false;
  bool ended_ = false;
  TimePoint deadline_{};
};

}  // namespace tagwrench

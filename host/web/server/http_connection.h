// One connection that asks for files, or becomes a page. Everything has its time.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <memory>
#include <string_view>

#include "host/core/types.h"
#include "host/web/server/request_guard.h"
#include "host/web/server/static_site.h"

namespace tagwrench {

class HttpConnection;
struct PageUpgrade;

/// Whom a connection asks.
class ConnectionOwner {
 public:
  virtual ~ConnectionOwner() = default;
  virtual WebAnswer answer(const WebRequest& request) = 0;
  /// Whether the request may become a page's socket.
  virtual Refusal admits(const WebRequest& request) = 0;
  /// What `request` holds may be moved from.
  virtual void becomes_page(PageUpgrade&& request) = 0;
  /// With what the stranger sent, if that helps.
  virtual void refused(Refusal refusal, std::string_view detail) = 0;
  /// The last call.
  virtual void closed(HttpConnection& connection) = 0;
};

class HttpConnection {
 public:
  static constexpr std::uint32_t kMaxHeader = 8192;
  static constexpr Duration kLinger = std::chrono::seconds(1);

  static std::shared_ptr<HttpConnection> make(boost::asio::ip::tcp::socket socket,
                                              ConnectionOwner& daemon, Duration patience);
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  virtual ~HttpConnection() = default;

  virtual void serve() = 0;
  /// One answer to whatever it asks, and good-bye.
  virtual void turn_away(Refusal refusal) = 0;
  virtual void check(TimePoint now) = 0;
  virtual void drop() noexcept = 0;
  virtual bool is_turned_away() const noexcept = 0;

 protected:
  HttpConnection() = default;
};

}  // namespace tagwrench

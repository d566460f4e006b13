// A connection that is to become a page: what a connection hands over, and the others only pass on.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

namespace tagwrench {

using WebSocketRequest = boost::beast::http::request<boost::beast::http::empty_body>;

struct PageUpgrade {
  boost::asio::ip::tcp::socket socket;
  WebSocketRequest request;
};

}  // namespace tagwrench

#include "host/web/server/http_connection.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/web/server/page_upgrade.h"

namespace tagwrench {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::beast::error_code;

constexpr std::size_t kPiece = 64 * 1024;

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

WebRequest request_of(const WebSocketRequest& request) {
  return {.method = view(request.method_string()),
          .target = view(request.target()),
          .host = view(request[http::field::host]),
          .origin = view(request[http::field::origin]),
          .fetch_site = view(request["Sec-Fetch-Site"]),
          .authorization = view(request[http::field::authorization]),
          .protocols = view(request[http::field::sec_websocket_protocol]),
          .if_none_match = view(request[http::field::if_none_match]),
          .upgrade = boost::beast::websocket::is_upgrade(request)};
}

/// What helps to see who it was; never what may hold a token.
std::string_view telling_part(Refusal refusal, const WebRequest& request) {
  if (refusal == Refusal::host) return request.host;
  if (refusal == Refusal::origin) return request.origin;
  return {};
}

class BeastConnection final : public HttpConnection,
                              public std::enable_shared_from_this<BeastConnection> {
 public:
  BeastConnection(asio::ip::tcp::socket socket, ConnectionOwner& daemon, Duration patience);

  void serve() override;
  void turn_away(Refusal refusal) override;
  void check(TimePoint now) override;
  void drop() noexcept override;
  bool is_turned_away() const noexcept override { return turned_away_; }

 private:
  using Parser = http::request_parser<http::empty_body>;

  void handle(const error_code& error);
  void handle_request();
  void failed(const error_code& error);
  void respond(WebAnswer answer, bool with_body);
  void send(std::size_t size);
  void send_file();
  void sent(const error_code& error);
  void linger();
  void discard();
  void end();

  asio::ip::tcp::socket socket_;
  ConnectionOwner& daemon_;
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

BeastConnection::BeastConnection(asio::ip::tcp::socket socket, ConnectionOwner& daemon,
                                 Duration patience)
    : socket_(std::move(socket)),
      daemon_(daemon),
      patience_(patience),
      incoming_(kMaxHeader + 1024) {}

void BeastConnection::serve() {
  deadline_ = std::chrono::steady_clock::now() + patience_;
  parser_.emplace();
  parser_->header_limit(kMaxHeader);
  http::async_read(socket_, incoming_, *parser_,
                   [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
                     self->handle(error);
                   });
}

void BeastConnection::turn_away(Refusal refusal) {
  turned_away_ = true;
  respond(plain_answer(refusal_status(refusal), refusal_text(refusal), refusal), true);
}

void BeastConnection::handle(const error_code& error) {
  if (ended_ || error == http::error::end_of_stream || error == asio::error::operation_aborted)
    return end();
  if (error) return failed(error);
  handle_request();
}

void BeastConnection::failed(const error_code& error) {
  if (error.category() != http::make_error_code(http::error::end_of_stream).category())
    return end();
  const bool long_header =
      error == http::error::header_limit || error == http::error::buffer_overflow;
  const bool body = error == http::error::unexpected_body || error == http::error::body_limit;
  keep_ = false;
  if (long_header)
    respond(plain_answer(431, "At most 8 kB of headers.", Refusal::flood), true);
  else if (body)
    respond(plain_answer(413, "Requests have no body here.", Refusal::flood), true);
  else
    respond(plain_answer(400, refusal_text(Refusal::nonsense), Refusal::nonsense), true);
}

void BeastConnection::handle_request() {
  const WebRequest request = request_of(parser_->get());
  keep_ = parser_->get().keep_alive();
  if (request.target != "/ws") {
    WebAnswer answer = daemon_.answer(request);
    if (answer.refusal != Refusal::none)
      daemon_.refused(answer.refusal, telling_part(answer.refusal, request));
    return respond(std::move(answer), request.method != "HEAD");
  }
  keep_ = false;
  if (const Refusal refusal = daemon_.admits(request); refusal != Refusal::none) {
    daemon_.refused(refusal, telling_part(refusal, request));
    return respond(plain_answer(refusal_status(refusal), refusal_text(refusal)), true);
  }
  if (!request.upgrade) return respond(plain_answer(426, "Only a WebSocket is here."), true);
  daemon_.becomes_page({std::move(socket_), parser_->release()});
  end();
}

void BeastConnection::respond(WebAnswer answer, bool with_body) {
  const bool from_file = static_cast<bool>(answer.file.fd);
  const std::uint64_t length = from_file ? answer.file.size : answer.text.size();
  std::string head =
      fmt::format("HTTP/1.1 {} {}\r\n{}Connection: {}\r\n", answer.status,
                  status_text(answer.status), answer.fields, keep_ ? "keep-alive" : "close");
  if (answer.status != 304) head += fmt::format("Content-Length: {}\r\n", length);
  head += "\r\n";
  outgoing_.assign(head.begin(), head.end());
  if (with_body && !from_file)
    outgoing_.insert(outgoing_.end(), answer.text.begin(), answer.text.end());
  file_ = std::move(answer.file);
  file_left_ = with_body && from_file ? file_.size : 0;
  send(outgoing_.size());
}

void BeastConnection::send(std::size_t size) {
  deadline_ = std::chrono::steady_clock::now() + patience_;
  asio::async_write(socket_, asio::buffer(outgoing_.data(), size),
                    [self = shared_from_this()](const error_code& error, std::size_t /*sent*/) {
                      self->sent(error);
                    });
}

/// A file that has grown shorter meanwhile ends the connection: its length is promised.
void BeastConnection::send_file() {
  outgoing_.resize(kPiece);
  const std::size_t wanted = std::min<std::uint64_t>(file_left_, kPiece);
  const ssize_t got = ::read(file_.fd.get(), outgoing_.data(), wanted);
  if (got <= 0) return end();
  file_left_ -= static_cast<std::uint64_t>(got);
  send(static_cast<std::size_t>(got));
}

void BeastConnection::sent(const error_code& error) {
  if (error || ended_) return end();
  if (file_left_ > 0) return send_file();
  file_ = {};
  outgoing_ = {};
  if (keep_) return serve();
  linger();
}

/// Closed at once, what it is still sending would make the kernel throw away the answer.
void BeastConnection::linger() {
  deadline_ = std::chrono::steady_clock::now() + kLinger;
  error_code ignored;
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
  outgoing_.resize(kPiece);
  discard();
}

void BeastConnection::discard() {
  socket_.async_read_some(
      asio::buffer(outgoing_),
      [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
        error ? self->end() : self->discard();
      });
}

void BeastConnection::check(TimePoint now) {
  if (now > deadline_) drop();
}

void BeastConnection::drop() noexcept {
  error_code ignored;
  socket_.close(ignored);  // whatever waits for it ends with an error
}

void BeastConnection::end() {
  if (std::exchange(ended_, true)) return;
  drop();
  daemon_.closed(*this);
}

}  // namespace

std::shared_ptr<HttpConnection> HttpConnection::make(asio::ip::tcp::socket socket,
                                                     ConnectionOwner& daemon, Duration patience) {
  return std::make_shared<BeastConnection>(std::move(socket), daemon, patience);
}

}  // namespace tagwrench

#include "host/web/server/web_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <csignal>
#include <optional>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/remedy.h"
#include "host/web/server/peer_user.h"

// Not fuzzed: Boost.Beast parses HTTP; fuzz.web_messages has what it means.

namespace tagwrench {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::beast::error_code;

constexpr std::uint32_t kMaxHeader = 8192;
constexpr std::size_t kPiece = 64 * 1024;
constexpr Duration kLinger = std::chrono::seconds(1);
constexpr std::size_t kSubnet_bytes = 8;    // of an IPv6 address: one household's, all of it
constexpr std::size_t kMaxTurnedAway = 16;  // at once; more are closed without a word
constexpr Duration kCheckEvery = std::chrono::milliseconds(250);
constexpr Duration kFarewell = std::chrono::milliseconds(700);
constexpr int kNice = 5;  // frames go before pages

asio::ip::address listen_address(const WebOptions& options) {
  if (options.address == "localhost") return asio::ip::address_v4::loopback();
  const bool brackets = options.address.starts_with('[') && options.address.ends_with(']');
  error_code error;
  const auto address = asio::ip::make_address(
      brackets ? options.address.substr(1, options.address.size() - 2) : options.address, error);
  if (error)
    throw ConfigError(options.option + ":" + options.address +
                      ": not an address; give a number, like 127.0.0.1 or [::1]");
  if (!address.is_loopback() && options.token.empty())
    throw ConfigError(options.option + ":" + options.address +
                      ": others could reach this sensor; give --web-token FILE, or leave the "
                      "address out for this computer alone");
  return address;
}

std::string endpoint_text(const tcp::endpoint& endpoint) {
  const std::string number = endpoint.address().to_string();
  return (endpoint.address().is_v6() ? '[' + number + ']' : number) + ':' +
         std::to_string(endpoint.port());
}

/// Or the port would stay taken as long as a child lives.
void keep_from_children(int socket) noexcept { ::fcntl(socket, F_SETFD, FD_CLOEXEC); }

tcp::acceptor listener(asio::io_context& context, const WebOptions& options) {
  const tcp::endpoint endpoint(listen_address(options), options.port);
  tcp::acceptor acceptor(context);
  error_code error;
  acceptor.open(endpoint.protocol(), error);
  if (!error) keep_from_children(acceptor.native_handle());
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use)
    throw ConfigError(options.option + ": " + endpoint_text(endpoint) +
                      " is taken, perhaps by another bridge; stop it, or give another port: " +
                      options.option + ":ADDRESS:PORT");
  if (error)
    throw ConfigError(options.option + ": cannot listen at " + endpoint_text(endpoint) + ": " +
                      error.message() + "; " +
                      remedy_for(error.value(), "give an address of this computer"));
  return acceptor;
}

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

/// Who counts as one: an IPv6 host may take any address of its subnet.
std::string address_key(const asio::ip::address& address) {
  if (address.is_v4() || address.to_v6().is_v4_mapped()) return address.to_string();
  const auto bytes = address.to_v6().to_bytes();
  return {reinterpret_cast<const char*>(bytes.data()), kSubnet_bytes};
}

/// Whose connection it is, as far as the kernel knows.
struct Peer {
  explicit Peer(tcp::socket& socket) {
    error_code error;
    const tcp::endpoint theirs = socket.remote_endpoint(error);
    if (!error) address = address_key(theirs.address());
    const tcp::endpoint ours = socket.local_endpoint(error);
    if (!error) our_address = numeric(ours.address());
    our_user = is_our_user(peer_user(socket.native_handle()));
  }
  static std::string numeric(const asio::ip::address& at) {
    const bool mapped = at.is_v6() && at.to_v6().is_v4_mapped();
    return mapped ? asio::ip::make_address_v4(asio::ip::v4_mapped, at.to_v6()).to_string()
                  : at.to_string();
  }

  std::string address;
  std::string our_address;
  bool our_user = false;
};

WebRequest request_of(const HttpRequest& request, const Peer& peer) {
  return {.method = view(request.method_string()),
          .target = view(request.target()),
          .host = view(request[http::field::host]),
          .origin = view(request[http::field::origin]),
          .fetch_site = view(request["Sec-Fetch-Site"]),
          .authorization = view(request[http::field::authorization]),
          .protocols = view(request[http::field::sec_websocket_protocol]),
          .if_none_match = view(request[http::field::if_none_match]),
          .upgrade = boost::beast::websocket::is_upgrade(request),
          .our_user = peer.our_user,
          .our_address = peer.our_address};
}

/// What helps to see who it was; never what may hold a token.
std::string_view telling_part(Refusal refusal, const WebRequest& request) {
  if (refusal == Refusal::host) return request.host;
  if (refusal == Refusal::origin) return request.origin;
  return {};
}

}  // namespace

/// One connection that asks for files, or becomes a page. Everything has its time.
class WebServer::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Peer peer, WebServer& server)
      : socket_(std::move(socket)), peer_(std::move(peer)), server_(server) {}

  void serve() { await_request(); }
  /// One answer to whatever it asks, and good-bye.
  void turn_away(Refusal refusal) {
    turned_away_ = true;
    respond(plain_answer(refusal_status(refusal), refusal_text(refusal), refusal), true);
  }
  void check(TimePoint now) {
    if (now > deadline_) drop();
  }
  void drop() noexcept {
    error_code ignored;
    socket_.close(ignored);  // whatever waits for it ends with an error
  }
  /// Closed, and forgotten.
  void end() {
    if (std::exchange(ended_, true)) return;
    drop();
    server_.connections_.erase(this);
  }
  bool is_turned_away() const noexcept { return turned_away_; }
  /// Has not asked for anything, this time, or has its answer.
  bool is_idle() const noexcept { return idle_; }
  TimePoint idle_since() const noexcept { return idle_since_; }
  const Peer& peer() const noexcept { return peer_; }

 private:
  using Parser = http::request_parser<http::empty_body>;

  void await_request() {
    idle_ = true;
    idle_since_ = std::chrono::steady_clock::now();
    deadline_ = idle_since_ + server_.patience_.request;
    if (incoming_.size() > 0) return read_request();
    socket_.async_wait(tcp::socket::wait_read,
                       [self = shared_from_this()](const error_code& error) {
                         if (error || self->ended_) return self->end();
                         self->read_request();
                       });
  }
  void read_request() {
    deadline_ = std::chrono::steady_clock::now() + server_.patience_.header;
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    http::async_read(socket_, incoming_, *parser_,
                     [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
                       self->handle(error);
                     });
  }
  void handle(const error_code& error) {
    idle_ = false;
    const bool cut = error == http::error::partial_message && !parser_->is_header_done();
    const bool gone = cut || error == http::error::end_of_stream;  // nobody is left to be answered
    if (ended_ || gone || error == asio::error::operation_aborted) return end();
    if (error) return failed(error);
    handle_request();
  }
  void handle_request() {
    const WebRequest request = request_of(parser_->get(), peer_);
    keep_ = parser_->get().keep_alive();
    if (request.target != "/ws") {
      WebAnswer answer = server_.site_.answer(request);
      if (answer.refusal != Refusal::none)
        server_.refused(answer.refusal, telling_part(answer.refusal, request));
      return respond(std::move(answer), request.method != "HEAD");
    }
    keep_ = false;
    Refusal refusal = server_.site_.guard().socket(request);
    if (refusal == Refusal::none && server_.hub_.pages() >= PageHub::kMaxPages)
      refusal = Refusal::crowd;
    if (refusal != Refusal::none) {
      server_.refused(refusal, telling_part(refusal, request));
      return respond(plain_answer(refusal_status(refusal), refusal_text(refusal)), true);
    }
    if (!request.upgrade) return respond(plain_answer(426, "Only a WebSocket is here."), true);
    server_.hub_.add(std::move(socket_), parser_->release());
    end();
  }
  void failed(const error_code& error) {
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
  void respond(WebAnswer answer, bool with_body) {
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
  void send(std::size_t size) {
    deadline_ = std::chrono::steady_clock::now() + server_.patience_.request;
    asio::async_write(socket_, asio::buffer(outgoing_.data(), size),
                      [self = shared_from_this()](const error_code& error, std::size_t /*sent*/) {
                        self->sent(error);
                      });
  }
  /// A file that has grown shorter meanwhile ends the connection: its length is promised.
  void send_file() {
    outgoing_.resize(kPiece);
    const std::size_t wanted = std::min<std::uint64_t>(file_left_, kPiece);
    const ssize_t got = ::read(file_.fd.get(), outgoing_.data(), wanted);
    if (got <= 0) return end();
    file_left_ -= static_cast<std::uint64_t>(got);
    send(static_cast<std::size_t>(got));
  }
  void sent(const error_code& error) {
    if (error || ended_) return end();
    if (file_left_ > 0) return send_file();
    file_ = {};
    outgoing_ = {};
    if (keep_) return await_request();
    linger();
  }
  /// Closed at once, what it is still sending would make the kernel throw away the answer.
  void linger() {
    idle_ = true;  // has its answer
    idle_since_ = std::chrono::steady_clock::now();
    deadline_ = idle_since_ + kLinger;
    error_code ignored;
    socket_.shutdown(tcp::socket::shutdown_send, ignored);
    outgoing_.resize(kPiece);
    discard();
  }
  void discard() {
    socket_.async_read_some(
        asio::buffer(outgoing_),
        [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
          error ? self->end() : self->discard();
        });
  }

  tcp::socket socket_;
  Peer peer_;
  WebServer& server_;
  boost::beast::flat_buffer incoming_{kMaxHeader + 1024};
  std::optional<Parser> parser_;
  std::vector<char> outgoing_;
  OpenedFile file_;  ///< of the answer; what is left of it
  std::uint64_t file_left_ = 0;
  bool keep_ = false;  ///< for the next request
  bool turned_away_ = false;
  bool ended_ = false;
  bool idle_ = false;
  TimePoint idle_since_{};
  TimePoint deadline_{};
};

WebServer::WebServer(const WebOptions& options)
    : token_(options.token),
      site_(options.pages, options.token),
      hub_(context_, options.patience),
      acceptor_(listener(context_, options)),
      endpoint_(acceptor_.local_endpoint()),
      retry_(context_),
      checks_(context_),
      patience_(options.patience) {
  hub_.on_misbehaviour = [this](Refusal refusal) { refused(refusal, {}); };
}

void WebServer::stop() {
  if (!thread_.joinable()) return;
  asio::post(context_, [this] {
    error_code ignored;
    acceptor_.close(ignored);
    retry_.cancel();
    for (const auto& [key, connection] : connections_) connection->drop();
    hub_.close_all();
    until_ = std::chrono::steady_clock::now() + kFarewell;  // pages say good-bye, too
    leave();
  });
  thread_.join();
}

void WebServer::start(PageRequestHandler& handler) {
  hub_.start(handler);
  accept();
  check();
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void WebServer::refused(Refusal refusal, std::string_view detail) {
  const std::string line = log_.line(refusal, detail, std::chrono::steady_clock::now());
  if (!line.empty()) log_info(line);
}

void WebServer::run() noexcept {
  pthread_setname_np(pthread_self(), "tagwrench-web");
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  for (bool again = true; again;) {
    again = false;
    try {
      context_.run();
    } catch (const std::exception& error) {  // one page's trouble is not the next one's
      log_info(std::string("web: ") + error.what());
      again = true;
    }
  }
}

void WebServer::accept() {
  acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) return retry_.after(kCheckEvery, [this] { accept(); });  // out of descriptors
    keep_from_children(socket.native_handle());
    take(std::move(socket));
    accept();
  });
}

void WebServer::take(tcp::socket socket) {
  const auto away = std::count_if(connections_.begin(), connections_.end(),
                                  [](const auto& one) { return one.first->is_turned_away(); });
  Peer peer(socket);
  Refusal refusal = Refusal::none;
  if (token_.empty() && !peer.our_user)
    refusal = Refusal::user;  // nothing of his is looked at
  else if (!make_room(peer.address, peer.our_user))
    refusal = Refusal::crowd;
  if (refusal != Refusal::none) refused(refusal, {});
  if (refusal != Refusal::none && static_cast<std::size_t>(away) >= kMaxTurnedAway) return;
  const auto connection = std::make_shared<Connection>(std::move(socket), std::move(peer), *this);
  connections_.emplace(connection.get(), connection);
  if (refusal == Refusal::none)
    connection->serve();
  else
    connection->turn_away(refusal);
}

/// Where there is no room, whoever has been asking for nothing for longest makes it. So those who
/// never finish a request starve nobody who does.
bool WebServer::make_room(const std::string& address, bool our_user) {
  std::size_t all = hub_.pages(), his = 0;
  Connection* longest = nullptr;
  Connection* longest_of_his = nullptr;
  const auto longer = [](const Connection* one, const Connection* than) {
    return than == nullptr || one->idle_since() < than->idle_since();
  };
  for (const auto& [key, connection] : connections_) {
    if (connection->is_turned_away()) continue;
    const bool same = connection->peer().address == address;
    ++all;
    if (same) ++his;
    if (!connection->is_idle()) continue;
    if (longer(connection.get(), longest)) longest = connection.get();
    if (same && longer(connection.get(), longest_of_his)) longest_of_his = connection.get();
  }
  if (!our_user && his >= kMaxPerAddress)
    longest = longest_of_his;
  else if (all < kMaxConnections)
    return true;
  if (longest == nullptr) return false;
  refused(Refusal::crowd, {});
  longest->end();
  return true;
}

void WebServer::check() {
  const TimePoint now = std::chrono::steady_clock::now();
  for (const auto& [key, connection] : connections_) connection->check(now);
  hub_.check(now);
  checks_.after(kCheckEvery, [this] { check(); });
}

void WebServer::leave() {
  if (hub_.pages() == 0 || std::chrono::steady_clock::now() > until_) return context_.stop();
  checks_.after(std::chrono::milliseconds(10), [this] { leave(); });
}

std::string WebServer::local_url() const {
  return endpoint_.address().is_unspecified() ? fmt::format("http://localhost:{}/", port()) : url();
}

std::string WebServer::url() const {
  const bool any = endpoint_.address().is_unspecified();
  return "http://" + (any ? "HOST:" + std::to_string(port()) : endpoint_text(endpoint_)) + '/';
}

}  // namespace tagwrench

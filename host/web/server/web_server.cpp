#include "host/web/server/web_server.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <map>
#include <thread>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/web/server/http_connection.h"
#include "host/web/server/page_hub.h"
#include "host/web/server/refusal_log.h"

namespace tagwrench {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

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
                      error.message() + "; give an address of this computer");
  return acceptor;
}

}  // namespace

class WebServer::Site final : public ConnectionOwner {
 public:
  explicit Site(const WebOptions& options)
      : token(options.token),
        files(options.pages, options.token),
        hub(context, options.patience),
        acceptor_(listener(context, options)),
        retry_(context),
        checks_(context),
        patience_(options.patience.request) {
    endpoint = acceptor_.local_endpoint();
    hub.on_misbehaviour = [this](Refusal refusal) { refused(refusal, {}); };
  }

  ~Site() override { stop(); }

  void stop() {
    if (!thread_.joinable()) return;
    asio::post(context, [this] { farewell(); });
    thread_.join();
  }

  void start(PageRequestHandler& handler) {
    hub.start(handler);
    accept();
    check();
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread_ = std::thread([this] { run(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  WebAnswer answer(const WebRequest& request) override { return files.answer(request); }

  Refusal admits(const WebRequest& request) override {
    const Refusal refusal = files.guard().socket(request);
    if (refusal != Refusal::none) return refusal;
    return hub.has_room() ? Refusal::none : Refusal::crowd;
  }

  void becomes_page(PageUpgrade&& request) override { hub.add(std::move(request)); }

  void refused(Refusal refusal, std::string_view detail) override {
    const std::string line = log_.line(refusal, detail, std::chrono::steady_clock::now());
    if (!line.empty()) log_info(line);
  }

  void closed(HttpConnection& connection) override { connections_.erase(&connection); }

  asio::io_context context{1};
  std::string token;
  StaticSite files;
  PageHub hub;
  tcp::endpoint endpoint;

 private:
  void run() noexcept {
    pthread_setname_np(pthread_self(), "tagwrench-web");
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
    for (bool again = true; again;) {
      again = false;
      try {
        context.run();
      } catch (const std::exception& error) {  // one page's trouble is not the next one's
        log_info(std::string("web: ") + error.what());
        again = true;
      }
    }
  }

  void accept() {
    acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) return accept_later();  // out of descriptors
      keep_from_children(socket.native_handle());
      take(std::move(socket));
      accept();
    });
  }

  void accept_later() {
    retry_.expires_after(kCheckEvery);
    retry_.async_wait([this](const error_code& error) {
      if (!error) accept();
    });
  }

  void take(tcp::socket socket) {
    const auto away = std::count_if(connections_.begin(), connections_.end(),
                                    [](const auto& one) { return one.first->is_turned_away(); });
    const auto turned_away = static_cast<std::size_t>(away);
    const bool room = connections_.size() - turned_away + hub.pages() < kMaxConnections;
    if (!room) refused(Refusal::crowd, {});
    if (!room && turned_away >= kMaxTurnedAway) return;
    const auto connection = HttpConnection::make(std::move(socket), *this, patience_);
    connections_.emplace(connection.get(), connection);
    if (room)
      connection->serve();
    else
      connection->turn_away(Refusal::crowd);
  }

  void check() {
    const TimePoint now = std::chrono::steady_clock::now();
    for (const auto& [key, connection] : connections_) connection->check(now);
    hub.check(now);
    checks_.expires_after(kCheckEvery);
    checks_.async_wait([this](const error_code& error) {
      if (!error) check();
    });
  }

  /// Pages get a moment to say good-bye, too.
  void farewell() {
    error_code ignored;
    acceptor_.close(ignored);
    retry_.cancel();
    for (const auto& [key, connection] : connections_) connection->drop();
    hub.close_all();
    until_ = std::chrono::steady_clock::now() + kFarewell;
    leave();
  }

  void leave() {
    if (hub.pages() == 0 || std::chrono::steady_clock::now() > until_) return context.stop();
    checks_.expires_after(std::chrono::milliseconds(10));
    checks_.async_wait([this](const error_code&) { leave(); });
  }

  tcp::acceptor acceptor_;
  asio::steady_timer retry_;
  asio::steady_timer checks_;
  Duration patience_;
  TimePoint until_{};
  RefusalLog log_;
  std::map<const HttpConnection*, std::shared_ptr<HttpConnection>> connections_;
  std::thread thread_;
};

WebServer::WebServer(const WebOptions& options) : site_(std::make_unique<Site>(options)) {}
WebServer::~WebServer() = default;

void WebServer::start(PageRequestHandler& handler) { site_->start(handler); }
void WebServer::stop() { site_->stop(); }
LiveFeed& WebServer::feed() noexcept { return site_->hub.feed(); }
std::uint16_t WebServer::port() const noexcept { return site_->endpoint.port(); }
asio::io_context& WebServer::context() noexcept { return site_->context; }

std::string WebServer::url() const {
  const bool any = site_->endpoint.address().is_unspecified();
  return "http://" + (any ? "HOST:" + std::to_string(port()) : endpoint_text(site_->endpoint)) +
         '/';
}

std::string WebServer::url_with_token() const {
  return site_->token.empty() ? url() : url() + "#token=" + site_->token;
}

void WebServer::post(std::function<void()> work) { asio::post(site_->context, std::move(work)); }
bool WebServer::pictures_wanted() const noexcept { return site_->hub.pictures_wanted(); }

void WebServer::answer(std::uint64_t page, std::int64_t id, bool ok, std::string text) {
  site_->hub.answer(page, id, ok, std::move(text));
}

void WebServer::answer(std::uint64_t page, std::int64_t id, bool ok, std::string text,
                       const nlohmann::json& data) {
  site_->hub.answer(page, id, ok, std::move(text), data);
}

void WebServer::send_all(const nlohmann::json& message) { site_->hub.send_all(message); }

void WebServer::send(std::uint64_t page, const nlohmann::json& message) {
  site_->hub.send(page, message);
}

void WebServer::send_picture(std::shared_ptr<const std::vector<std::uint8_t>> message) {
  site_->hub.send_picture(std::move(message));
}

void WebServer::set_hello(const nlohmann::json& hello) { site_->hub.set_hello(hello); }
std::size_t WebServer::pages() const noexcept { return site_->hub.pages(); }
LiveFigures WebServer::figures() const { return site_->hub.figures(); }

void WebServer::watch_pictures(std::function<void(const ImageView& picture)> watcher) {
  site_->hub.watch_pictures(std::move(watcher));
}

void WebServer::serve_folder(std::string url_prefix, std::filesystem::path folder) {
  site_->files.serve_folder(std::move(url_prefix), std::move(folder));
}

void WebServer::serve_file(std::string url, std::filesystem::path file) {
  site_->files.serve_file(std::move(url), std::move(file));
}

}  // namespace tagwrench

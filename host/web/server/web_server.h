// Room web/server: HTTP and WebSocket, one thread beside the loop.
// In:  requests of browsers, all of it untrusted and bounded; messages of web/bridge to pages.
// Out: built pages, files, samples (SI) and pictures; requests to a PageRequestHandler.
// Then: page_hub.h (pages), static_site.h (files); the protocol in host/web/README.md.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "host/core/types.h"
#include "host/web/server/page_hub.h"
#include "host/web/server/server_timer.h"
#include "host/web/server/static_site.h"
#include "host/web/server/web_options.h"

namespace tagwrench {

class WebServer {
 public:
  static constexpr std::size_t kMaxConnections = 64;
  static constexpr std::size_t kMaxPerAddress = 24;  ///< of another computer

  /// Binds and listens, in no thread yet. Throws ConfigError: a bad address, or one without token.
  explicit WebServer(const WebOptions& options);
  /// As stop().
  ~WebServer() { stop(); }
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// Starts the thread. No signal is ever delivered to it. Without this, nothing is served. The
  /// handler is borrowed until stop().
  void start(PageRequestHandler& handler);
  /// Says good-bye to all pages (1001), waits for the thread; no call of the handler after that.
  void stop();

  /// What the frame loop writes and this server reads; lives as long as the server.
  LiveFeed& feed() noexcept { return hub_.feed(); }
  std::uint16_t port() const noexcept { return endpoint_.port(); }
  /// Without the token: fit for logs.
  std::string url() const;
  /// For a browser of this computer and this user, who needs no token.
  std::string local_url() const;
  /// For descriptors and timers of those who answer. Its handlers run in the server's thread.
  boost::asio::io_context& context() noexcept { return context_; }

  /// Any thread. Runs in the server's.
  void post(std::function<void()> work) { boost::asio::post(context_, std::move(work)); }
  /// Any thread: a page shows pictures at the moment.
  bool pictures_wanted() const noexcept { return hub_.pictures_wanted(); }

  // From here on: before start(), or in the server's thread.

  /// To the page, if it is still there.
  void answer(std::uint64_t page, std::int64_t id, bool ok, std::string text,
              const nlohmann::json& data = nullptr) {
    hub_.answer(page, id, ok, std::move(text), data);
  }
  /// An object with a "type". Where a page is slow, the latest of a type replaces the one before;
  /// but "say" is kept, up to 64 of them and answers, beyond which the page is closed.
  void send_all(const nlohmann::json& message) { hub_.send_all(message); }
  /// To one page, as above.
  void send(std::uint64_t page, const nlohmann::json& message) { hub_.send(page, message); }
  /// A picture that the feed did not bring (picture_message()), to pages that asked for pictures.
  void send_picture(const Picture& message) { hub_.send_picture(message); }
  /// What every page gets first; sent to all now, too. Before it a page hears answers alone.
  void set_hello(const nlohmann::json& hello) { hub_.set_hello(hello); }
  std::size_t pages() const noexcept { return hub_.pages(); }

  /// Of the last second, as read from the feed; zeros while no page is open.
  LiveFigures figures() const { return hub_.figures(); }

  /// Is shown each picture that is taken from the feed, whole, at least twice a second while a page
  /// is open. Valid during the call only.
  void watch_pictures(std::function<void(const ImageView& picture)> watcher) {
    hub_.watch_pictures(std::move(watcher));
  }

  /// GET `url_prefix` NAME gives that file of the folder. NAME has letters, digits, '.', '-' and
  /// '_', does not begin with '.', and is no symbolic link.
  void serve_folder(std::string url_prefix, std::filesystem::path folder) {
    site_.serve_folder(std::move(url_prefix), std::move(folder));
  }
  /// GET `url` gives this file, or 404 while it is not there.
  void serve_file(std::string url, std::filesystem::path file) {
    site_.serve_file(std::move(url), std::move(file));
  }

 private:
  class Connection;

  void run() noexcept;
  void accept();
  void take(boost::asio::ip::tcp::socket socket);
  bool make_room(const std::string& address, bool our_user);
  void refused(Refusal refusal, std::string_view detail);
  void check();
  void leave();

  boost::asio::io_context context_{1};
  std::string token_;
  StaticSite site_;
  PageHub hub_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::ip::tcp::endpoint endpoint_;
  ServerTimer retry_;
  ServerTimer checks_;
  WebPatience patience_;
  TimePoint until_{};
  RefusalLog log_;
  std::map<const Connection*, std::shared_ptr<Connection>> connections_;
  std::thread thread_;
};

}  // namespace tagwrench

// Room web/server: HTTP and WebSocket, one thread beside the loop.
// In:  requests of browsers, all of it untrusted and bounded; messages of web/bridge to pages.
// Out: built pages, files, samples (SI) and pictures; requests to a PageRequestHandler.
// Then: the protocol in host/web/README.md.
//
// The bridge's pages: a small HTTP and WebSocket server with a thread of its own. It hands out the
// built pages, what the live feed reads, and the bridge's messages; and it takes the pages'
// requests.
//
// Everything that comes in is untrusted and bounded: see host/web/README.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/web/server/live_feed.h"
#include "host/web/server/web_options.h"

namespace boost::asio {
class io_context;
}

namespace tagwrench {

class LiveFeed;
struct PageRequest;

/// Called by the server's thread. Whoever is asked owes exactly one WebServer::answer(), now or
/// later; an exception is answered with its text.
class PageRequestHandler {
 public:
  PageRequestHandler() = default;
  PageRequestHandler(const PageRequestHandler&) = delete;
  PageRequestHandler& operator=(const PageRequestHandler&) = delete;
  virtual ~PageRequestHandler() = default;

  virtual void handle(PageRequest request) = 0;
  /// Has got its hello and will hear send_all().
  virtual void page_came(std::uint64_t /*page*/) {}
  virtual void page_gone(std::uint64_t /*page*/) {}
};

class WebServer {
 public:
  static constexpr std::size_t kMaxPages = 16;
  static constexpr std::size_t kMaxConnections = 64;
  static constexpr std::size_t kMaxPageRequest = 20'000;
  static constexpr std::size_t kMaxPageRequestsPerSecond = 40;

  /// Binds and listens, in no thread yet. Throws ConfigError: the address cannot be used, or needs
  /// a token.
  explicit WebServer(const WebOptions& options);
  /// As stop().
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// Starts the thread. No signal is ever delivered to it. Without this, nothing is served. The
  /// handler is borrowed until stop().
  void start(PageRequestHandler& handler);
  /// Says good-bye to all pages (1001), and waits for the thread: the handler is not called any
  /// more.
  void stop();

  /// What the frame loop writes and this server reads; lives as long as the server.
  LiveFeed& feed() noexcept;
  std::uint16_t port() const noexcept;
  /// Without the token: fit for logs.
  std::string url() const;
  /// To be opened in a browser: the token, if there is one, in the fragment, which no browser
  /// sends.
  std::string url_with_token() const;
  /// For descriptors and timers of those who answer. Its handlers run in the server's thread.
  boost::asio::io_context& context() noexcept;

  /// Any thread. Runs in the server's.
  void post(std::function<void()> work);
  /// Any thread: a page shows pictures at the moment.
  bool pictures_wanted() const noexcept;

  // From here on: before start(), or in the server's thread.

  /// To the page, if it is still there.
  void answer(std::uint64_t page, std::int64_t id, bool ok, std::string text);
  void answer(std::uint64_t page, std::int64_t id, bool ok, std::string text,
              const nlohmann::json& data);
  /// An object with a "type". Where a page is slow, the latest of a type replaces the one before;
  /// but "say" is kept, up to 64 of them and answers, beyond which the page is closed.
  void send_all(const nlohmann::json& message);
  /// To one page, as above.
  void send(std::uint64_t page, const nlohmann::json& message);
  /// A picture that the feed did not bring (picture_message.h), to those pages that asked for
  /// pictures.
  void send_picture(std::shared_ptr<const std::vector<std::uint8_t>> message);
  /// What every page gets first. Sent to all at once, too. Before there is one, a page hears
  /// nothing but answers.
  void set_hello(const nlohmann::json& hello);
  std::size_t pages() const noexcept;

  /// Rate, latency and so on of the last second, as read from the feed; zeros while no page is
  /// open.
  LiveFigures figures() const;

  /// Is shown each picture that is taken from the feed, whole, at least twice a second while a page
  /// is open. Valid during the call only.
  void watch_pictures(std::function<void(const ImageView& picture)> watcher);

  /// GET `url_prefix` NAME gives that file of the folder. NAME has letters, digits, '.', '-' and
  /// '_', does not begin with '.', and is no symbolic link.
  void serve_folder(std::string url_prefix, std::filesystem::path folder);
  /// GET `url` gives this file, or 404 while it is not there.
  void serve_file(std::string url, std::filesystem::path file);

 private:
  class Site;
  std::unique_ptr<Site> site_;
};

}  // namespace tagwrench

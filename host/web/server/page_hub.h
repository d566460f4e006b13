// All open pages: their WebSockets, what they hear, how often, and who answers them.
#pragma once

#include <array>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "host/core/types.h"
#include "host/web/server/live_feed.h"
#include "host/web/server/request_guard.h"
#include "host/web/server/server_timer.h"
#include "host/web/server/web_options.h"

namespace tagwrench {

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

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;
/// What a page is still to be sent while it is busy with earlier things: bounded, whatever it does.
class Outbox {
 public:
  static constexpr std::size_t kMaxKept = 64;
  static constexpr std::size_t kMaxTypes = 16;

  /// Goes out, in its turn. False: 64 wait already.
  bool keep(Text text);
  /// Takes the place of the one of its type that waits.
  void replace(std::string_view type, Text text);
  void replace_picture(Picture picture) { picture_ = std::move(picture); }

  /// Those that are kept in their order, then the latest of each type; null: there is none.
  Text next_text();
  Picture next_picture() { return std::exchange(picture_, nullptr); }

 private:
  std::deque<Text> kept_;
  std::deque<std::pair<std::string, Text>> latest_;
  Picture picture_;
};

/// Counts what comes in a second. Pure.
template <std::size_t kMax>
class MessageRate {
 public:
  /// False: it is more than kMax in the last second.
  bool count(TimePoint now) noexcept {
    TimePoint& oldest = times_[next_];
    const bool too_many = full_ && now - oldest < std::chrono::seconds(1);
    oldest = now;
    next_ = (next_ + 1) % kMax;
    full_ = full_ || next_ == 0;
    return !too_many;
  }

 private:
  std::array<TimePoint, kMax> times_{};
  std::size_t next_ = 0;
  bool full_ = false;
};

class PageHub {
 public:
  static constexpr std::size_t kMaxPages = 16;
  static constexpr std::size_t kMaxRequest = 20'000;
  static constexpr std::size_t kMaxRequestsPerSecond = 40;
  /// A little more than a thirtieth of a second: not more than 30 messages in one.
  static constexpr Duration kTick = std::chrono::milliseconds(34);
  static constexpr Duration kPictureEvery = std::chrono::milliseconds(100);
  static constexpr Duration kWatchEvery = std::chrono::milliseconds(500);
  static constexpr Duration kLongestRest = std::chrono::seconds(1);  ///< from pictures
  static constexpr Duration kGoodBye = std::chrono::milliseconds(500);

  PageHub(boost::asio::io_context& context, const WebPatience& patience);
  ~PageHub();

  void start(PageRequestHandler& handler) noexcept { handler_ = &handler; }
  LiveFeed& feed() noexcept { return feed_; }
  std::size_t pages() const noexcept { return pages_.size(); }
  /// A connection that becomes a page.
  void add(boost::asio::ip::tcp::socket socket, HttpRequest request);
  /// Once or more a second: pings, and lets go pages that do not answer or read.
  void check(TimePoint now);
  void close_all();

  void answer(std::uint64_t page, std::int64_t id, bool ok, std::string text,
              const nlohmann::json& data = nullptr);
  void send_all(const nlohmann::json& message);
  void send(std::uint64_t page, const nlohmann::json& message);
  void send_picture(const Picture& message);
  void set_hello(const nlohmann::json& hello);
  void watch_pictures(std::function<void(const ImageView&)> watcher);
  LiveFigures figures() const { return stream_.figures(std::chrono::steady_clock::now()); }
  bool pictures_wanted() const noexcept { return pictures_wanted_; }

  /// Is told of what pages do that they must not.
  std::function<void(Refusal)> on_misbehaviour;

 private:
  class Page;

  void opened(Page& page);
  void said(Page& page, std::string_view text);
  void gone(std::uint64_t page);
  void tick();
  void want_pictures();
  static void deliver(Page& page, std::string_view type, const Text& text);
  template <typename Work>
  void each(Work work);

  LiveFeed feed_;
  SampleStream stream_{feed_};
  PictureMaker maker_;
  ServerTimer timer_;
  WebPatience patience_;
  bool ticking_ = false;
  PageRequestHandler* handler_ = nullptr;
  Text hello_;
  std::function<void(const ImageView&)> watcher_;
  std::atomic<bool> pictures_wanted_{false};
  Duration picture_took_{};  ///< the last one, by the clock on the wall
  std::map<std::uint64_t, std::shared_ptr<Page>> pages_;
  std::uint64_t next_page_ = 1;
};

}  // namespace tagwrench

// All open pages: what they hear, how often, and who answers them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/web/server/live_feed.h"
#include "host/web/server/page_socket.h"
#include "host/web/server/picture_message.h"
#include "host/web/server/sample_stream.h"
#include "host/web/server/server_timer.h"
#include "host/web/server/web_server.h"

namespace tagwrench {

struct PageMessage;

class PageHub final : public PageOwner {
 public:
  /// A little more than a thirtieth of a second: not more than 30 messages in one.
  static constexpr Duration kTick = std::chrono::milliseconds(34);
  static constexpr Duration kPictureEvery = std::chrono::milliseconds(100);
  static constexpr Duration kWatchEvery = std::chrono::milliseconds(500);

  PageHub(boost::asio::io_context& context, const WebPatience& patience);

  void start(PageRequestHandler& handler) noexcept { handler_ = &handler; }
  LiveFeed& feed() noexcept { return feed_; }
  bool has_room() const noexcept { return pages_.size() < WebServer::kMaxPages; }
  std::size_t pages() const noexcept { return pages_.size(); }
  /// What `request` holds is moved from.
  void add(PageUpgrade&& request);
  void check(TimePoint now);
  void close_all();

  void answer(std::uint64_t page, std::int64_t id, bool ok, std::string text);
  void answer(std::uint64_t page, std::int64_t id, bool ok, std::string text,
              const nlohmann::json& data);
  void send_all(const nlohmann::json& message);
  void send(std::uint64_t page, const nlohmann::json& message);
  void send_picture(std::shared_ptr<const std::vector<std::uint8_t>> message);
  void set_hello(const nlohmann::json& hello);
  void watch_pictures(std::function<void(const ImageView&)> watcher);
  LiveFigures figures() const { return stream_.figures(std::chrono::steady_clock::now()); }
  bool pictures_wanted() const noexcept { return pictures_wanted_; }

  /// Is told of what pages do that they must not.
  std::function<void(Refusal)> on_misbehaviour;

  void opened(PageSocket& page) override;
  void said(PageSocket& page, std::string_view text) override;
  std::shared_ptr<const std::string> samples(PageSocket& page) override;
  void misbehaved(Refusal refusal) override;
  void gone(std::uint64_t page) override;

 private:
  using Text = std::shared_ptr<const std::string>;

  void tick();
  void take_picture();
  void want_pictures();
  void pass_on(PageSocket& page, PageMessage message);
  static void deliver(PageSocket& page, std::string_view type, const Text& text);
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
  std::map<std::uint64_t, std::shared_ptr<PageSocket>> pages_;
  std::uint64_t next_page_ = 1;
};

}  // namespace tagwrench

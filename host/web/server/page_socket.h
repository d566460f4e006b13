// One page: its WebSocket, what it is still to be sent, and what it may send.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/web/server/request_guard.h"
#include "host/web/server/web_options.h"

namespace tagwrench {

struct PageUpgrade;
class PageSocket;

/// Whom a page tells.
class PageOwner {
 public:
  virtual ~PageOwner() = default;
  virtual void opened(PageSocket& page) = 0;
  virtual void said(PageSocket& page, std::string_view text) = 0;
  /// What the page has not seen yet; null: nothing.
  virtual std::shared_ptr<const std::string> samples(PageSocket& page) = 0;
  virtual void misbehaved(Refusal refusal) = 0;
  /// The last call.
  virtual void gone(std::uint64_t page) = 0;
};

class PageSocket {
 public:
  static constexpr Duration kGoodBye = std::chrono::milliseconds(500);

  /// What `request` holds is moved from.
  static std::shared_ptr<PageSocket> make(PageUpgrade&& request, std::uint64_t id,
                                          PageOwner& daemon, const WebPatience& patience);
  PageSocket(const PageSocket&) = delete;
  PageSocket& operator=(const PageSocket&) = delete;
  virtual ~PageSocket() = default;

  virtual void open() = 0;
  /// Goes out in its turn, or the page is closed: it has not read for long.
  virtual void keep(std::shared_ptr<const std::string> text) = 0;
  virtual void replace(std::string_view type, std::shared_ptr<const std::string> text) = 0;
  virtual void show(std::shared_ptr<const std::vector<std::uint8_t>> picture) = 0;
  /// There may be new ones.
  virtual void samples_due() = 0;
  /// Once or more a second: pings, and lets go a page that does not answer or read.
  virtual void check(TimePoint now) = 0;
  virtual void close(std::uint16_t code, std::string_view reason) = 0;

  virtual std::uint64_t id() const noexcept = 0;
  virtual bool was_open() const noexcept = 0;

  std::uint64_t next_sample = 0;  ///< position of the first that it has not seen
  bool wants_pictures = false;

 protected:
  PageSocket() = default;
};

}  // namespace tagwrench

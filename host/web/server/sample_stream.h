// The last samples as text, for pages that are at different places of the stream.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "host/web/server/live_feed.h"

namespace tagwrench {

/// As the contract has it, and what pages show beside it. One object.
std::string sample_text(const LiveSample& live);

class SampleStream {
 public:
  static constexpr std::size_t kMax = 64;  ///< in a message

  explicit SampleStream(const LiveFeed& feed) : feed_(feed) {}

  /// Takes what is new.
  void pull();
  /// Forgets what has come: nobody has looked.
  void skip();

  std::uint64_t end() const noexcept { return next_; }
  /// All from this position on, but at most the last kMax; the others count as lost. Null: there
  /// is nothing new.
  std::shared_ptr<const std::string> message(std::uint64_t from);
  LiveFigures figures(TimePoint now) const;

 private:
  const LiveFeed& feed_;
  std::uint64_t next_ = 0;  ///< position in the feed
  struct Entry {
    std::uint64_t position;
    std::string text;
  };
  std::deque<Entry> entries_;
  LiveWindow window_;
  std::uint64_t frames_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t made_from_ = 0;  ///< of `made_`, which pages at the same place share
  std::shared_ptr<const std::string> made_;
};

}  // namespace tagwrench

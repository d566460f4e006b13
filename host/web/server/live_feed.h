// From the frame loop to the pages' thread: the last samples, and a picture now and then. The frame
// loop's calls wait for nobody, use no heap and make no system call; a reader that is late loses
// samples, and can count them.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/core/frame_log.h"
#include "host/core/types.h"
#include "host/source/decode.h"

namespace tagwrench {

/// Messages, shared by the pages that get them.
using Text = std::shared_ptr<const std::string>;
using Picture = std::shared_ptr<const std::vector<std::uint8_t>>;

/// A sample, and what the tracker said beside it. Copied word by word.
struct LiveSample {
  Sample sample;
  double residual_px = 0;
  std::uint64_t frames = 0;   ///< with this one, since the feed began
  std::uint64_t dropped = 0;  ///< likewise
  std::uint8_t tags_held = 0;
};

/// A picture as the source delivered it, and what was seen in it.
struct LivePicture {
  static constexpr std::size_t kMaxBytes = std::size_t{4} << 20;

  std::uint64_t sequence = 0;
  TimePoint capture_time{};
  Status status = Status::acquiring;
  int width = 0;  ///< of the whole picture
  int height = 0;
  std::uint32_t fourcc = 0;  ///< of `bytes`; GREY of `part` alone where the source keeps no raw
                             ///< picture
  int stride = 0;            ///< of `bytes`
  Region part;               ///< what `bytes` show; empty: all
  std::uint8_t tag_count = 0;
  std::array<TagCorners, 8> tags{};
  std::size_t size = 0;
  std::unique_ptr<std::uint8_t[]> bytes;
};

class LiveFeed {
 public:
  static constexpr std::size_t kKept = 256;

  LiveFeed();
  LiveFeed(const LiveFeed&) = delete;
  LiveFeed& operator=(const LiveFeed&) = delete;
  ~LiveFeed();

  // The frame loop's side: one thread at a time.

  /// Without a track: no frame came.
  void sample(const Sample& sample, const Track* track) noexcept;
  /// Somebody looks, and the last picture is long enough ago.
  bool wants_picture(TimePoint now) const noexcept;
  /// Copies it, unless the reader still has both buffers. Never more than kMaxBytes.
  void picture(const LoggedFrame& logged) noexcept;

  // The reader's side: one thread.

  /// How many samples were ever written: the next one's position.
  std::uint64_t written() const noexcept { return written_.load(std::memory_order_acquire); }
  /// Nothing: not written yet, or overwritten already.
  std::optional<LiveSample> read(std::uint64_t position) const noexcept;

  /// None while the interval is Duration::max(). The first request makes the buffers.
  void want_pictures(Duration interval);
  /// The newest that has not been taken yet; null: none. Is given back with release().
  const LivePicture* take_picture() noexcept;
  void release(const LivePicture* picture) noexcept;

 private:
  struct Slot;
  struct Buffer;

  std::unique_ptr<Slot[]> slots_;
  std::atomic<std::uint64_t> written_{0};
  std::uint64_t frames_ = 0;
  std::uint64_t dropped_ = 0;

  std::unique_ptr<Buffer[]> buffers_;
  std::atomic<Duration::rep> interval_;
  TimePoint last_picture_{};  ///< the frame loop's
};

// How the frame loop runs, from the samples of the last second.

struct LiveFigures {
  double rate_hz = 0;  ///< samples handed to outputs
  std::int64_t latency_median_us = 0;
  std::int64_t latency_p99_us = 0;
  std::int64_t jitter_us = 0;  ///< standard deviation of the time between two hand-overs
  std::uint64_t frames = 0;    ///< since the feed began
  std::uint64_t dropped = 0;   ///< frames that the source lost, since then
};

class LiveWindow {
 public:
  void add(TimePoint output_time, std::int64_t latency_us) {
    entries_.push_back({output_time, latency_us});
    while (entries_.size() > kMax || output_time - entries_.front().output_time > kSpan)
      entries_.pop_front();
  }
  LiveFigures figures(TimePoint now) const;
  void clear() { entries_.clear(); }

 private:
  static constexpr Duration kSpan = std::chrono::seconds(1);
  static constexpr std::size_t kMax = 2000;
  struct Entry {
    TimePoint output_time;
    std::int64_t latency_us;
  };
  std::deque<Entry> entries_;
};

// The last samples as text, for pages that are at different places of the stream.

/// As the contract has it, and what pages show beside it. One object.
std::string sample_text(const LiveSample& live);

class SampleStream {
 public:
  static constexpr std::size_t kMax = 64;  ///< in a message

  explicit SampleStream(const LiveFeed& feed) : feed_(feed) {}

  /// Takes what is new.
  void pull();
  /// Forgets what has come: nobody has looked.
  void skip() {
    next_ = feed_.written();
    entries_.clear();
    window_.clear();
    made_ = nullptr;
  }

  std::uint64_t end() const noexcept { return next_; }
  /// From this position on, the last kMax at most; the others count as lost. Null: nothing new.
  Text message(std::uint64_t from);
  LiveFigures figures(TimePoint now) const {
    LiveFigures out = window_.figures(now);
    out.frames = frames_;
    out.dropped = dropped_;
    return out;
  }

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
  Text made_;
};

// A picture for pages: a header in JSON, and a small JPEG.

/// The header's length (4 bytes, little-endian), the header, the JPEG.
Picture picture_message(const nlohmann::json& header, std::span<const std::uint8_t> jpeg);

/// Makes pictures of the feed what pages show. Keeps its buffers.
class PictureMaker {
 public:
  static constexpr int kWidest = 640;
  static constexpr int kQuality = 70;

  PictureMaker();

  /// The whole picture, grey where not known, until the next call. Nothing: the bytes are damaged.
  std::optional<ImageView> decode(const LivePicture& picture);
  /// Of the whole picture, made smaller if it is wider than kWidest; its coordinates in the header
  /// are the whole picture's. Null: it cannot be compressed.
  Picture message(const LivePicture& picture, const ImageView& whole);

 private:
  struct CompressorEnd {
    void operator()(void* handle) const noexcept;
  };
  std::unique_ptr<void, CompressorEnd> compressor_;
  std::unique_ptr<RawDecoder> decoder_;
  int width_ = 0;  ///< of what the decoder decodes
  int height_ = 0;
  std::vector<std::uint8_t> whole_;
  std::vector<std::uint8_t> small_;
};

}  // namespace tagwrench

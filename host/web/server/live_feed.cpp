#include "host/web/server/live_feed.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace tagwrench {
namespace {

constexpr std::size_t kWords = sizeof(LiveSample) / sizeof(std::uint64_t);
static_assert(sizeof(LiveSample) % sizeof(std::uint64_t) == 0);

constexpr int kFree = 0;     // the writer's
constexpr int kFull = 1;     // the reader's, if it likes
constexpr int kReading = 2;  // the reader's
constexpr int kBuffers = 2;

void copy_raw(const LoggedFrame& logged, LivePicture& picture) noexcept {
  picture.fourcc = logged.raw.fourcc;
  picture.stride = logged.raw.stride;
  picture.part = {};
  picture.size = logged.raw.bytes.size();
  std::memcpy(picture.bytes.get(), logged.raw.bytes.data(), picture.size);
}

void copy_part(const LoggedFrame& logged, LivePicture& picture) noexcept {
  const ImageView& image = logged.frame.image;
  const Region part = logged.frame.readable();
  const auto width = static_cast<std::size_t>(part.width);
  picture.fourcc = fourcc("GREY");
  picture.stride = part.width;
  picture.part = part;
  picture.size = 0;
  if (width * static_cast<std::size_t>(part.height) > LivePicture::kMaxBytes) return;
  for (int row = 0; row < part.height; ++row) {
    const auto offset = static_cast<std::ptrdiff_t>(part.y + row) * image.stride + part.x;
    std::memcpy(picture.bytes.get() + picture.size, image.pixels + offset, width);
    picture.size += width;
  }
}

}  // namespace

/// Read while it may be written: `version` is odd then, and twice the position plus two when the
/// words are that position's. All words are atomic, so that a torn read is a discarded one and not
/// a race.
struct LiveFeed::Slot {
  std::atomic<std::uint64_t> version{0};
  std::array<std::atomic<std::uint64_t>, kWords> words{};
};

struct LiveFeed::Buffer {
  std::atomic<int> state{kFree};
  LivePicture picture;
};

LiveFeed::LiveFeed()
    : slots_(std::make_unique<Slot[]>(kKept)), interval_(Duration::max().count()) {}

LiveFeed::~LiveFeed() = default;

void LiveFeed::sample(const Sample& sample, const Track* track) noexcept {
  if (track != nullptr) ++frames_;
  dropped_ += sample.dropped;
  LiveSample live{.sample = sample, .frames = frames_, .dropped = dropped_};
  if (track != nullptr) {
    live.residual_px = track->residual_px;
    live.tags_held = track->tags_held;
  }
  std::array<std::uint64_t, kWords> words;
  std::memcpy(words.data(), static_cast<const void*>(&live), sizeof live);
  const std::uint64_t position = written_.load(std::memory_order_relaxed);
  Slot& slot = slots_[position % kKept];
  slot.version.store(2 * position + 1, std::memory_order_relaxed);
  // A reader that sees one of these words sees the odd version, too.
  for (std::size_t i = 0; i < kWords; ++i) slot.words[i].store(words[i], std::memory_order_release);
  slot.version.store(2 * position + 2, std::memory_order_release);
  written_.store(position + 1, std::memory_order_release);
}

std::optional<LiveSample> LiveFeed::read(std::uint64_t position) const noexcept {
  const Slot& slot = slots_[position % kKept];
  const std::uint64_t wanted = 2 * position + 2;
  if (slot.version.load(std::memory_order_acquire) != wanted) return {};
  std::array<std::uint64_t, kWords> words;
  for (std::size_t i = 0; i < kWords; ++i) words[i] = slot.words[i].load(std::memory_order_acquire);
  if (slot.version.load(std::memory_order_relaxed) != wanted) return {};
  LiveSample live;
  std::memcpy(static_cast<void*>(&live), words.data(), sizeof live);
  return live;
}

bool LiveFeed::wants_picture(TimePoint now) const noexcept {
  const Duration::rep interval = interval_.load(std::memory_order_acquire);
  return interval != Duration::max().count() && (now - last_picture_).count() >= interval;
}

void LiveFeed::picture(const LoggedFrame& logged) noexcept {
  if (interval_.load(std::memory_order_acquire) == Duration::max().count()) return;
  Buffer* const end = buffers_.get() + kBuffers;
  Buffer* const buffer = std::find_if(buffers_.get(), end, [](const Buffer& one) {
    return one.state.load(std::memory_order_acquire) == kFree;
  });
  if (buffer == end) return;
  LivePicture& picture = buffer->picture;
  const Track& track = logged.track;
  picture.sequence = logged.frame.sequence;
  picture.capture_time = logged.frame.capture_time;
  picture.status = logged.sample.status;
  picture.width = logged.frame.image.width;
  picture.height = logged.frame.image.height;
  picture.tag_count = std::min<std::uint8_t>(track.corner_count, picture.tags.size());
  picture.tags = track.corners;
  const std::size_t raw_bytes = logged.raw.bytes.size();
  if (raw_bytes > 0 && raw_bytes <= LivePicture::kMaxBytes)
    copy_raw(logged, picture);
  else
    copy_part(logged, picture);
  last_picture_ = logged.sample.output_time;
  if (picture.size > 0) buffer->state.store(kFull, std::memory_order_release);
}

void LiveFeed::want_pictures(Duration interval) {
  if (!buffers_ && interval != Duration::max()) {
    buffers_ = std::make_unique<Buffer[]>(kBuffers);
    for (int i = 0; i < kBuffers; ++i)
      buffers_[i].picture.bytes = std::make_unique<std::uint8_t[]>(LivePicture::kMaxBytes);
  }
  interval_.store(interval.count(), std::memory_order_release);
}

const LivePicture* LiveFeed::take_picture() noexcept {
  Buffer* newest = nullptr;
  for (int i = 0; buffers_ && i < kBuffers; ++i) {
    Buffer& one = buffers_[i];
    if (one.state.load(std::memory_order_acquire) != kFull) continue;
    if (newest != nullptr && newest->picture.sequence > one.picture.sequence) {
      one.state.store(kFree, std::memory_order_release);
      continue;
    }
    if (newest != nullptr) newest->state.store(kFree, std::memory_order_release);
    newest = &one;
  }
  if (newest == nullptr) return nullptr;
  newest->state.store(kReading, std::memory_order_relaxed);
  return &newest->picture;
}

void LiveFeed::release(const LivePicture* picture) noexcept {
  for (int i = 0; buffers_ && i < kBuffers; ++i)
    if (&buffers_[i].picture == picture) buffers_[i].state.store(kFree, std::memory_order_release);
}

void LiveWindow::add(TimePoint output_time, std::int64_t latency_us) {
  entries_.push_back({output_time, latency_us});
  while (entries_.size() > kMax || output_time - entries_.front().output_time > kSpan)
    entries_.pop_front();
}

LiveFigures LiveWindow::figures(TimePoint now) const {
  std::vector<std::int64_t> latencies;
  std::vector<double> intervals_us;
  const Entry* before = nullptr;
  for (const Entry& entry : entries_) {
    if (now - entry.output_time > kSpan) continue;
    latencies.push_back(entry.latency_us);
    if (before != nullptr) {
      const std::chrono::duration<double, std::micro> step =
          entry.output_time - before->output_time;
      intervals_us.push_back(step.count());
    }
    before = &entry;
  }
  LiveFigures out;
  if (latencies.empty()) return out;
  std::sort(latencies.begin(), latencies.end());
  const auto quantile = [&](double part) {
    return latencies[static_cast<std::size_t>(part * static_cast<double>(latencies.size() - 1) +
                                              0.5)];
  };
  out.latency_median_us = quantile(0.5);
  out.latency_p99_us = quantile(0.99);
  double sum = 0;
  double squares = 0;
  for (const double step : intervals_us) sum += step;
  if (sum <= 0) return out;
  const auto steps = static_cast<double>(intervals_us.size());
  const double mean = sum / steps;
  for (const double step : intervals_us) squares += (step - mean) * (step - mean);
  out.rate_hz = 1e6 / mean;
  out.jitter_us = std::llround(std::sqrt(squares / steps));
  return out;
}

}  // namespace tagwrench

#include "host/web/server/live_feed.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/core/json/json_text.h"
#include "host/output/line_outputs.h"
#include "host/output/output.h"

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

/// JSON has no other numbers.
double finite(double value) { return std::isfinite(value) ? value : 0; }

void append_six(std::string& text, std::string_view key, const Vector6& six) {
  fmt::format_to(std::back_inserter(text), R"(,"{}":[{},{},{},{},{},{}])", key, finite(six[0]),
                 finite(six[1]), finite(six[2]), finite(six[3]), finite(six[4]), finite(six[5]));
}

using nlohmann::json;

constexpr std::uint8_t kUnknownGrey = 128;

struct JpegEnd {
  void operator()(unsigned char* bytes) const noexcept { tjFree(bytes); }
};

/// One pixel is the mean of `factor` by `factor`.
void shrink(const ImageView& image, int factor, std::vector<std::uint8_t>& out, int width,
            int height) {
  out.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<unsigned> sums(static_cast<std::size_t>(width));
  const auto area = static_cast<unsigned>(factor * factor);
  for (int row = 0; row < height; ++row) {
    std::fill(sums.begin(), sums.end(), area / 2);
    for (int part = 0; part < factor; ++part) {
      const std::uint8_t* pixel =
          image.pixels + static_cast<std::ptrdiff_t>(row * factor + part) * image.stride;
      for (unsigned& sum : sums)
        for (int column = 0; column < factor; ++column) sum += *pixel++;
    }
    std::uint8_t* target = out.data() + static_cast<std::ptrdiff_t>(row) * width;
    for (const unsigned sum : sums) *target++ = static_cast<std::uint8_t>(sum / area);
  }
}

json header_of(const LivePicture& picture) {
  json tags = json::array();
  for (std::size_t i = 0; i < picture.tag_count; ++i) {
    json corners = json::array();
    for (const double px : picture.tags[i].px) corners.push_back(std::round(px * 10) / 10);
    tags.push_back({{"id", picture.tags[i].id}, {"px", std::move(corners)}});
  }
  return {{"seq", picture.sequence},
          {"t_ns", Duration(picture.capture_time.time_since_epoch()).count()},
          {"width", picture.width},
          {"height", picture.height},
          {"tags", std::move(tags)},
          {"status", name(picture.status)}};
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
  const Eigen::Map<const Eigen::ArrayXd> steps(intervals_us.data(),
                                               static_cast<Eigen::Index>(intervals_us.size()));
  if (steps.sum() <= 0) return out;
  out.rate_hz = 1e6 / steps.mean();
  out.jitter_us = std::llround(std::sqrt((steps - steps.mean()).square().mean()));
  return out;
}

std::string sample_text(const LiveSample& live) {
  LineBuffer buffer;
  const std::string_view line = json_line(buffer, live.sample);
  std::string text(line.substr(0, line.rfind('}')));
  const bool numbers = carries_numbers(shown_status(live.sample));
  append_six(text, "zero", live.sample.zero);
  append_six(text, "motion", numbers ? live.sample.deflection : Vector6::Zero());
  fmt::format_to(std::back_inserter(text),
                 R"(,"zero_state":"{}","buttons":{},"residual_px":{:.4g},"tags_held":{}}})",
                 name(live.sample.zero_state), live.sample.buttons, finite(live.residual_px),
                 live.tags_held);
  return text;
}

void SampleStream::pull() {
  const std::uint64_t written = feed_.written();
  if (written - next_ > LiveFeed::kKept) next_ = written - LiveFeed::kKept;
  for (; next_ < written; ++next_) {
    const std::optional<LiveSample> live = feed_.read(next_);
    if (!live) continue;  // overwritten meanwhile
    window_.add(live->sample.output_time, latency_us(live->sample));
    frames_ = live->frames;
    dropped_ = live->dropped;
    entries_.push_back({next_, sample_text(*live)});
    if (entries_.size() > kMax) entries_.pop_front();
    made_ = nullptr;
  }
}

Text SampleStream::message(std::uint64_t from) {
  if (from >= next_ || entries_.empty()) return nullptr;
  if (made_ != nullptr && made_from_ == from) return made_;
  const auto first = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.position >= from; });
  if (first == entries_.end()) return nullptr;
  std::string text = R"({"type":"samples","samples":[)";
  for (auto entry = first; entry != entries_.end(); ++entry) {
    if (entry != first) text += ',';
    text += entry->text;
  }
  const auto sent = static_cast<std::uint64_t>(std::distance(first, entries_.end()));
  fmt::format_to(std::back_inserter(text), R"(],"lost":{}}})", next_ - from - sent);
  made_ = std::make_shared<const std::string>(std::move(text));
  made_from_ = from;
  return made_;
}

PictureMaker::PictureMaker() : compressor_(tjInitCompress()) {}

void PictureMaker::CompressorEnd::operator()(void* handle) const noexcept { tjDestroy(handle); }

std::optional<ImageView> PictureMaker::decode(const LivePicture& picture) {
  const int width = picture.width;
  const int height = picture.height;
  if (picture.part.empty()) {
    if (!decoder_ || width_ != width || height_ != height)
      decoder_ = std::make_unique<RawDecoder>(width, height);
    width_ = width;
    height_ = height;
    Frame frame;
    const RawFrame raw{picture.fourcc, {picture.bytes.get(), picture.size}, picture.stride};
    if (!decoder_->decode(raw, {}, frame)) return {};
    return frame.image;
  }
  const Region& part = picture.part;
  whole_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kUnknownGrey);
  for (int row = 0; row < part.height; ++row) {
    const auto* from = picture.bytes.get() + static_cast<std::ptrdiff_t>(row) * picture.stride;
    std::copy_n(from, part.width,
                whole_.data() + static_cast<std::ptrdiff_t>(part.y + row) * width + part.x);
  }
  return ImageView{whole_.data(), width, height, width};
}

Picture PictureMaker::message(const LivePicture& picture, const ImageView& whole) {
  const int factor = (whole.width + kWidest - 1) / kWidest;
  ImageView shown = whole;
  if (factor > 1) {
    const int width = whole.width / factor;
    const int height = whole.height / factor;
    shrink(whole, factor, small_, width, height);
    shown = {small_.data(), width, height, width};
  }
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed =
      tjCompress2(compressor_.get(), shown.pixels, shown.width, shown.stride, shown.height,
                  TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, kQuality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, JpegEnd> jpeg(bytes);
  if (failed != 0) return nullptr;
  return picture_message(header_of(picture), {jpeg.get(), size});
}

Picture picture_message(const json& header, std::span<const std::uint8_t> jpeg) {
  const std::string text = dump_json(header);
  std::vector<std::uint8_t> message;
  message.reserve(4 + text.size() + jpeg.size());
  for (int shift = 0; shift < 32; shift += 8)
    message.push_back(static_cast<std::uint8_t>(text.size() >> shift & 0xffU));
  message.insert(message.end(), text.begin(), text.end());
  message.insert(message.end(), jpeg.begin(), jpeg.end());
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(message));
}

}  // namespace tagwrench

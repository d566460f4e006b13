#include "host/recording/writer.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sqlite3.h>

#include <algorithm>
#include <csignal>
#include <new>
#include <system_error>
#include <utility>

#include "host/core/config_error.h"
#include "host/recording/database.h"

namespace tagwrench::record {

ByteRing::ByteRing(std::size_t capacity)
    : storage_(std::max(capacity, 2 * kAlignment) / kAlignment * kAlignment + kAlignment) {
  const auto address = reinterpret_cast<std::uintptr_t>(storage_.data());
  memory_ = storage_.data() + (kAlignment - address % kAlignment) % kAlignment;
  capacity_ = storage_.size() - kAlignment;
}

std::byte* ByteRing::reserve(std::size_t bytes, std::size_t spare) noexcept {
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  const std::uint64_t used = written - read_.load(std::memory_order_acquire);
  const std::size_t need = room_for(bytes);
  const std::size_t to_end = capacity_ - written % capacity_;
  const std::size_t skipped = need > to_end ? to_end : 0;
  if (bytes > capacity_ || used + skipped + need + spare > capacity_) return nullptr;
  if (skipped > 0) new (&header(written)) Header{kSkip, skipped};
  new (&header(written + skipped)) Header{bytes, need};
  reserved_ = written + skipped + need;
  return memory_ + (written + skipped) % capacity_ + kAlignment;
}

void ByteRing::wait_for_room() const noexcept {
  const std::uint64_t read = read_.load(std::memory_order_acquire);
  if (read != written_.load(std::memory_order_relaxed)) read_.wait(read);
}

bool ByteRing::could_hold(std::size_t bytes, std::size_t spare) const noexcept {
  return bytes < capacity_ / 2 && spare < capacity_ / 2 && 2 * room_for(bytes) + spare <= capacity_;
}

std::span<std::byte> ByteRing::front() noexcept {
  std::uint64_t read = read_.load(std::memory_order_relaxed);
  if (read == written_.load(std::memory_order_acquire)) return {};
  if (header(read).bytes == kSkip) {
    read += header(read).room;
    read_.store(read, std::memory_order_release);
  }
  return {memory_ + read % capacity_ + kAlignment, header(read).bytes};
}

void ByteRing::pop() noexcept {
  const std::uint64_t read = read_.load(std::memory_order_relaxed);
  read_.store(read + header(read).room, std::memory_order_release);
  read_.notify_one();
}

double ByteRing::fill() const noexcept {
  const std::uint64_t used =
      written_.load(std::memory_order_acquire) - read_.load(std::memory_order_acquire);
  return static_cast<double>(used) / static_cast<double>(capacity_);
}

namespace {

using std::chrono::milliseconds;

constexpr Duration kNap = milliseconds(50);  ///< between looks at the buffer
constexpr std::size_t kMinBuffer = 8UL << 20;
constexpr std::size_t kMaxBuffer = 512UL << 20;
/// Of the buffer, kept for what is small, so that a disk that cannot follow costs pixels first.
constexpr std::size_t kSpare = 2UL << 20;
constexpr std::size_t kMaxText = 4000;
/// Bytes, after which a commit does not wait for its time.
constexpr std::size_t kMaxUncommitted = 8UL << 20;
/// What must be left on the disk so that the log can be moved into the file.
constexpr std::uint64_t kDiskReserve = 4ULL << 20;

std::size_t buffer_bytes(const WriterOptions& options, const Head& head) {
  if (options.buffer_bytes > 0) return options.buffer_bytes;
  // Two bytes a pixel is the most that raw frames have.
  const double frame = 2.0 * std::max(head.width, 1) * std::max(head.height, 1) + 8192;
  const double seconds = std::max(1e-3, std::chrono::duration<double>(head.period).count());
  const double two_seconds = head.keep == Keep::none ? 0 : 2 * frame / seconds;
  return kSpare +
         static_cast<std::size_t>(std::clamp(two_seconds, double{kMinBuffer}, double{kMaxBuffer}));
}

/// The memory is taken before there is a file.
ByteRing taken_ring(const WriterOptions& options, const Head& head) try {
  return ByteRing(buffer_bytes(options, head));
} catch (const std::bad_alloc&) {
  throw ConfigError(
      "{}: no memory for a buffer of {} MB; close other programs, or ask the camera for a smaller "
      "picture",
      options.path.string(), buffer_bytes(options, head) >> 20);
}

/// From here on a limit on the size of files is an error, not a signal that kills.
std::unique_ptr<Sink> new_sink(const WriterOptions& options, const Head& head) {
  std::signal(SIGXFSZ, SIG_IGN);
  return std::make_unique<Sink>(options.path, head);
}

}  // namespace

/// What waits in the ring; further bytes follow it.
struct RecordingWriter::Item {
  ItemKind kind = ItemKind::frame;
  std::int64_t id = 0;
  std::size_t extra = 0;  ///< bytes that follow
};

namespace {

struct EventRow {
  EventKind kind = EventKind::note;
  TimePoint time{};
  int step = -1;
  std::int64_t value = 0;
};

}  // namespace

/// An item, and its row of any type right behind it.
template <class Row>
struct RecordingWriter::Filled : Item {
  Row row{};

  std::span<const std::uint8_t> bytes() const {
    return {reinterpret_cast<const std::uint8_t*>(this + 1), extra};
  }
  std::uint8_t* bytes() { return reinterpret_cast<std::uint8_t*>(this + 1); }
};

RecordingWriter::RecordingWriter(const WriterOptions& options, const Head& head)
    : options_(options),
      keep_(head.keep),
      ring_(taken_ring(options, head)),
      sink_(new_sink(options, head)) {
  // Signals are for the loop's thread.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    thread_ = std::thread([this] { write(); });
  } catch (const std::system_error& e) {
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    throw ConfigError("{}: no thread to write with: {}; close other programs",
                      options.path.string(), e.what());
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

RecordingWriter::~RecordingWriter() { finish(); }

/// Room for a row and bytes behind it, not published yet; nullptr if there is none.
template <class Row>
auto RecordingWriter::put(std::size_t extra, std::size_t spare) noexcept -> Filled<Row>* {
  static_assert(alignof(Filled<Row>) <= ByteRing::kAlignment);
  const std::size_t bytes = sizeof(Filled<Row>) + extra;
  std::byte* room = ring_.reserve(bytes, spare);
  while (room == nullptr && options_.lossless && ring_.could_hold(bytes, spare)) {
    ring_.wait_for_room();
    room = ring_.reserve(bytes, spare);
  }
  if (room == nullptr) return nullptr;
  auto* item = new (room) Filled<Row>;
  item->extra = extra;
  return item;
}

template <class Row>
void RecordingWriter::put_row(ItemKind kind, std::int64_t id, const Row& row,
                              std::string_view text) noexcept {
  Filled<Row>* item = put<Row>(text.size(), 0);
  if (item == nullptr) {
    lost_others_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  item->kind = kind;
  item->id = id;
  item->row = row;
  std::ranges::copy(text, item->bytes());
  ring_.publish();
}

void RecordingWriter::frame(const Frame& frame, const Region& decoded,
                            const RawFrame& raw) noexcept {
  frames_.fetch_add(1, std::memory_order_relaxed);
  tell_losses(frame.capture_time);
  frame_id_ = ++id_;
  FrameRow row{.sequence = frame.sequence,
               .capture_time = frame.capture_time,
               .latency_origin = frame.latency_origin,
               .dropped = frame.dropped,
               .first = decoded,
               .all = frame.readable()};
  const bool crop = keep_ == Keep::region || (keep_ == Keep::raw && raw.bytes.empty());
  const Region& part = row.all;
  const auto width = static_cast<std::size_t>(part.width);
  const std::size_t bytes = crop                 ? width * static_cast<std::size_t>(part.height)
                            : keep_ == Keep::raw ? raw.bytes.size()
                                                 : 0;
  row.fourcc = crop ? kCrop : raw.fourcc;
  row.stride = crop ? part.width : raw.stride;
  Filled<FrameRow>* item = put<FrameRow>(bytes, kSpare);
  if (item == nullptr) {
    lost_frames_.fetch_add(1, std::memory_order_relaxed);
    put_row(ItemKind::frame, frame_id_, row);
    return;
  }
  item->kind = ItemKind::frame;
  item->id = frame_id_;
  item->row = row;
  if (!crop) {
    std::copy_n(raw.bytes.data(), bytes, item->bytes());
  } else {
    const std::uint8_t* from =
        frame.image.pixels + part.x + static_cast<std::ptrdiff_t>(part.y) * frame.image.stride;
    for (int y = 0; y < part.height; ++y, from += frame.image.stride)
      std::copy_n(from, width, item->bytes() + static_cast<std::size_t>(y) * width);
  }
  ring_.publish();
}

void RecordingWriter::track(const Track& track) noexcept {
  put_row(ItemKind::track, frame_id_, track);
}

void RecordingWriter::sample(const Sample& sample) noexcept {
  put_row(ItemKind::sample, frame_id_, sample);
}

void RecordingWriter::missing(const Sample& sample) noexcept {
  const std::int64_t id = ++id_;
  put_row(ItemKind::sample, id, sample);
  const TimePoint time = sample.capture_time + (sample.output_time - sample.latency_origin);
  put_row(ItemKind::event, id, EventRow{EventKind::missing, time});
}

void RecordingWriter::reference(const ReferenceRecord& reading) noexcept {
  put_row(ItemKind::reference, ++id_, reading);
}

void RecordingWriter::event(EventKind kind, TimePoint time, std::string_view text,
                            std::int64_t value, int step) noexcept {
  put_row(ItemKind::event, ++id_, EventRow{kind, time, step, value}, text.substr(0, kMaxText));
}

/// A loss is itself recorded, as soon as there is room.
void RecordingWriter::tell_losses(TimePoint time) noexcept {
  const std::uint64_t lost = lost_frames_ + lost_others_;
  if (lost == lost_told_ || ring_.fill() > 0.5) return;
  event(EventKind::lost, time, {}, static_cast<std::int64_t>(lost - lost_told_));
  lost_told_ = lost;
}

WriterState RecordingWriter::state() const noexcept {
  return {.frames = frames_,
          .lost_frames = lost_frames_,
          .lost_others = lost_others_,
          .bytes = bytes_,
          .disk_free = disk_free_,
          .fill = ring_.fill(),
          .failed = failed_.load(std::memory_order_acquire)};
}

std::string RecordingWriter::failure() const {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

/// The thread.
void RecordingWriter::write() noexcept {
  Transaction transaction;
  for (bool stop = false; !stop;) {
    {
      std::unique_lock lock(mutex_);
      stop = wake_.wait_for(lock, kNap, [this] { return stop_; });
    }
    try {
      drain(transaction, stop);
    } catch (const std::exception& e) {
      transaction = {};
      sink_->roll_back();
      fail(e);
    }
  }
  close();
}

/// Takes what is in the ring. A commit comes between frames, not within what belongs to one, unless
/// that is all there is.
void RecordingWriter::drain(Transaction& transaction, bool all) {
  for (std::span<std::byte> record; !(record = ring_.front()).empty(); ring_.pop()) {
    if (failed_) continue;  // emptied all the same: somebody may wait for room
    const Item& item = *reinterpret_cast<const Item*>(record.data());
    if (item.kind == ItemKind::frame && transaction.open &&
        (transaction.age() >= options_.commit_period || transaction.bytes >= kMaxUncommitted))
      commit(transaction);
    if (!transaction.open) {
      sink_->begin();
      transaction = {.open = true, .began = std::chrono::steady_clock::now()};
    }
    transaction.bytes += record.size();
    transaction.within_frame = item.kind == ItemKind::frame || item.kind == ItemKind::track;
    take(item);
    if (item.kind == ItemKind::frame) {
      transaction.last = static_cast<const Filled<FrameRow>&>(item).row.capture_time;
      if (kept_frames_ + transaction.frames++ == 0) first_kept_ = transaction.last;
    }
  }
  const Duration patience =
      transaction.within_frame ? 2 * options_.commit_period : options_.commit_period;
  if (transaction.open && (all || transaction.age() >= patience)) commit(transaction);
}

void RecordingWriter::take(const Item& item) {
  switch (item.kind) {
    case ItemKind::frame: {
      const auto& frame = static_cast<const Filled<FrameRow>&>(item);
      sink_->frame(item.id, frame.row, frame.bytes());
      break;
    }
    case ItemKind::track: sink_->track(item.id, static_cast<const Filled<Track>&>(item).row); break;
    case ItemKind::sample:
      sink_->sample(item.id, static_cast<const Filled<Sample>&>(item).row);
      break;
    case ItemKind::reference:
      sink_->reference(item.id, static_cast<const Filled<ReferenceRecord>&>(item).row);
      break;
    case ItemKind::event: {
      const auto& event = static_cast<const Filled<EventRow>&>(item);
      const auto text = event.bytes();
      sink_->event(item.id, event.row.kind, event.row.time, event.row.step, event.row.value,
                   {reinterpret_cast<const char*>(text.data()), text.size()});
      break;
    }
  }
}

void RecordingWriter::commit(Transaction& transaction) {
  const Transaction ended = std::exchange(transaction, {});
  sink_->commit();
  kept_frames_ += ended.frames;
  if (ended.frames > 0) last_kept_ = ended.last;
  const std::uint64_t log = size_of(options_.path.string() + "-wal");
  bytes_ = size_of(options_.path) + log;
  std::error_code error;
  const auto space = std::filesystem::space(options_.path, error);
  if (error) return;
  disk_free_ = space.available;
  // Ended while the log can still be moved into the file.
  if (space.available < log + kDiskReserve) throw DatabaseError("disk full", SQLITE_FULL);
}

/// What of the recording is on the disk.
std::string RecordingWriter::kept() const {
  if (kept_frames_ == 0) return "none of its frames is kept";
  if (kept_frames_ == 1) return "its first frame is kept";
  return fmt::format("its first {} frames, {:.3g} s, are kept", kept_frames_,
                     std::chrono::duration<double>(last_kept_ - first_kept_).count());
}

void RecordingWriter::fail(const std::exception& error) noexcept {
  const auto* database = dynamic_cast<const DatabaseError*>(&error);
  std::string line = write_trouble(
      options_.path, database != nullptr ? *database : DatabaseError(error.what(), 0), kept());
  {
    const std::scoped_lock lock(mutex_);
    if (failure_.empty()) failure_ = std::move(line);
  }
  failed_.store(true, std::memory_order_release);
}

/// What failed on the way is not marked as closed: its end is missing.
void RecordingWriter::close() noexcept {
  if (!failed_) {
    try {
      sink_->begin();
      sink_->meta("closed", "1");
      sink_->commit();
    } catch (const DatabaseError& e) {
      sink_->roll_back();
      fail(e);
    }
  }
  sink_->close();
}

std::string RecordingWriter::finish() noexcept {
  if (thread_.joinable()) {
    {
      const std::scoped_lock lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
    sink_.reset();
    bytes_ = size_of(options_.path);
  }
  return failure();
}

void FrameRecorder::frame(const LoggedFrame& all) noexcept {
  clock_ = all.frame.capture_time - all.frame.latency_origin;
  writer_.frame(all.frame, all.decoded, all.raw);
  writer_.track(all.track);
  writer_.sample(all.sample);
}

}  // namespace tagwrench::record

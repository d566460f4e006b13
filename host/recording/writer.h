// The writing side of a recording. Whoever runs the loop hands things over and never waits for the
// disk: a thread of its own writes them.
//
// Why a thread in a program of one: what is written must be on the disk within a second, and a disk
// that somebody else keeps busy takes half a second for that (host/recording/README.md), more than
// ten frames.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "host/core/frame_log.h"
#include "host/recording/schema.h"

namespace tagwrench::record {

// Records of any size from one thread to another, through memory that was taken beforehand.

/// One thread writes, another reads. Neither waits unless it asks to.
class ByteRing {
 public:
  static constexpr std::size_t kAlignment = 64;

  explicit ByteRing(std::size_t capacity);

  // ---- The writing thread ----

  /// Room for a record of so many bytes, aligned, in one piece; nullptr if there is none now. At
  /// least `spare` bytes stay free. Nothing is in the ring until publish().
  std::byte* reserve(std::size_t bytes, std::size_t spare = 0) noexcept;
  void publish() noexcept { written_.store(reserved_, std::memory_order_release); }
  /// Sleeps until the reader has taken something, unless the ring is empty.
  void wait_for_room() const noexcept;
  /// Whether a record of so many bytes fits into an empty ring.
  bool could_hold(std::size_t bytes, std::size_t spare = 0) const noexcept;

  // ---- The reading thread ----

  /// The oldest record; empty if there is none.
  std::span<std::byte> front() noexcept;
  void pop() noexcept;

  /// Either thread: part of the room that is taken, 0..1.
  double fill() const noexcept;

 private:
  struct Header {
    std::size_t bytes;  ///< of the record; kSkip: nothing more up to the end of the memory
    std::size_t room;   ///< taken by all of it
  };
  static constexpr std::size_t kSkip = ~std::size_t{0};
  static std::size_t room_for(std::size_t bytes) noexcept {
    return kAlignment + (bytes + kAlignment - 1) / kAlignment * kAlignment;
  }
  Header& header(std::uint64_t position) noexcept {
    return *reinterpret_cast<Header*>(memory_ + position % capacity_);
  }

  std::vector<std::byte> storage_;
  std::byte* memory_;
  std::size_t capacity_;
  std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> read_{0};
  std::uint64_t reserved_ = 0;  ///< `written_` after the next publish()
};

struct WriterOptions {
  std::filesystem::path path;
  bool lossless = false;  ///< wait for the disk when the buffer is full, as sources that wait for
                          ///< their reader may; else frames, and at last all, are lost and counted
  std::size_t buffer_bytes = 0;  ///< 0: two seconds of frames
  Duration commit_period = std::chrono::milliseconds(250);
};

struct WriterState {
  std::uint64_t frames = 0;       ///< handed over, lost ones included
  std::uint64_t lost_frames = 0;  ///< whose pixels found the buffer full
  std::uint64_t lost_others = 0;  ///< other records that did
  std::uint64_t bytes = 0;        ///< on the disk
  std::uint64_t disk_free = 0;    ///< bytes
  double fill = 0;                ///< of the buffer, 0..1
  bool failed = false;            ///< nothing more is written
};

class Sink;

class RecordingWriter {
 public:
  /// Makes the file, with its head, and starts the thread. Throws ConfigError, one line: it exists,
  /// cannot be made, or there is no memory.
  RecordingWriter(const WriterOptions& options, const Head& head);
  /// As finish().
  ~RecordingWriter();
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  // ---- The loop's thread. No heap, no waiting unless lossless. ----

  /// `decoded` is what was decoded first, `frame.decoded` what was in the end. What is kept of it
  /// is the head's affair.
  void frame(const Frame& frame, const Region& decoded, const RawFrame& raw) noexcept;
  /// Of the frame last handed over.
  void track(const Track& track) noexcept;
  void sample(const Sample& sample) noexcept;
  /// A sample that has no frame: none came in time.
  void missing(const Sample& sample) noexcept;
  void reference(const ReferenceRecord& reading) noexcept;
  /// A text longer than 4000 bytes is cut.
  void event(EventKind kind, TimePoint time, std::string_view text = {}, std::int64_t value = 0,
             int step = -1) noexcept;
  /// A step of a plan, counted from 0, begins or ends. Steps whose beginnings bear one `zero` count
  /// from one rest. A stretch may be marked after it has passed.
  void mark(int step, bool begin, TimePoint time, int zero = 0) noexcept {
    event(EventKind::mark, time, {}, begin ? kMarkBegins + zero : kMarkEnds, step);
  }
  /// The stretch of this step that was marked last, and began at `time`, no longer counts.
  void withdraw(int step, TimePoint time) noexcept {
    event(EventKind::mark, time, {}, kMarkWithdrawn, step);
  }

  WriterState state() const noexcept;
  /// One line, once state().failed.
  std::string failure() const;

  /// Writes what is left and closes the file. One line about what went wrong since the start; empty
  /// if nothing did. Further calls say the same.
  std::string finish() noexcept;

 private:
  enum class ItemKind : std::uint8_t { frame, track, sample, reference, event };
  struct Transaction {
    bool open = false;
    TimePoint began{};
    std::size_t bytes = 0;
    std::uint64_t frames = 0;
    TimePoint last{};           ///< of those
    bool within_frame = false;  ///< its track or sample may still come

    Duration age() const noexcept {
      return open ? std::chrono::steady_clock::now() - began : Duration(0);
    }
  };
  struct Item;
  template <class Row>
  struct Filled;
  template <class Row>
  Filled<Row>* put(std::size_t extra, std::size_t spare) noexcept;
  template <class Row>
  void put_row(ItemKind kind, std::int64_t id, const Row& row, std::string_view text = {}) noexcept;
  void tell_losses(TimePoint time) noexcept;
  void write() noexcept;
  void take(const Item& item);
  void drain(Transaction& transaction, bool all);
  void commit(Transaction& transaction);
  void fail(const std::exception& error) noexcept;
  std::string kept() const;
  void close() noexcept;

  WriterOptions options_;
  Keep keep_;
  ByteRing ring_;
  std::unique_ptr<Sink> sink_;
  std::int64_t id_ = 0;        ///< of what was handed over last
  std::int64_t frame_id_ = 0;  ///< of the last frame
  std::uint64_t lost_told_ = 0;
  // Of the writing thread: what has been committed.
  std::uint64_t kept_frames_ = 0;
  TimePoint first_kept_{};
  TimePoint last_kept_{};

  std::atomic<std::uint64_t> frames_{0};
  std::atomic<std::uint64_t> lost_frames_{0};
  std::atomic<std::uint64_t> lost_others_{0};
  std::atomic<std::uint64_t> bytes_{0};
  std::atomic<std::uint64_t> disk_free_{0};
  std::atomic<bool> failed_{false};
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::string failure_;  ///< guarded by mutex_
  std::thread thread_;
};

// What a pipeline tells of each frame, into a recording.

class FrameRecorder : public FrameLog {
 public:
  /// Makes the file. Throws ConfigError.
  FrameRecorder(const WriterOptions& options, const Head& head) : writer_(options, head) {}

  // The loop's thread.
  void frame(const LoggedFrame& all) noexcept override;
  void missing(const Sample& sample) noexcept override { writer_.missing(sample); }
  void disconnected(std::string_view detail) noexcept override {
    event_now(EventKind::disconnected, detail);
  }
  void reconnected(std::string_view detail) noexcept override {
    event_now(EventKind::reconnected, detail);
  }
  /// What people were told; an empty line is nothing.
  void note(std::string_view line) noexcept {
    if (!line.empty()) event_now(EventKind::note, line);
  }

  RecordingWriter& writer() noexcept { return writer_; }
  const RecordingWriter& writer() const noexcept { return writer_; }

 private:
  void event_now(EventKind kind, std::string_view text) noexcept {
    writer_.event(kind, std::chrono::steady_clock::now() + clock_, text);
  }

  RecordingWriter writer_;
  Duration clock_{};  ///< of the frames less CLOCK_MONOTONIC
};

}  // namespace tagwrench::record

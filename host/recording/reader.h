// Room recording: all of a run in one SQLite file.
// In:  frames as they came, tracks, samples, references, events (schema.h); SI, ns.
// Out: the same again, for replay and export. Tables, units and order: schema.h.
// Then: schema.h, writer.h.
//
// The reading side of a recording. The file may be damaged, or anything else: every number is
// checked before it is used.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/recording/schema.h"

namespace tagwrench::record {

/// A step of a plan begins or ends.
struct Mark {
  int step = 0;  ///< counted from 0
  bool begin = false;
  TimePoint time{};     ///< on the frames' clock
  std::int64_t id = 0;  ///< place in the order of events
  int zero = 0;         ///< of a beginning: steps with one number count from one rest
};

/// What happened to the source, in order.
struct Entry {
  enum class Kind : std::uint8_t { frame, missing, disconnected, reconnected };
  Kind kind = Kind::frame;
  std::int64_t id = 0;
  /// Of a frame: what was kept, with its place; `bytes` until the next call.
  std::uint64_t sequence = 0;
  std::uint32_t dropped = 0;
  RawFrame raw;
  bool crop = false;  ///< raw is the luminance of `all` alone
  Region first;       ///< that was decoded at first, within the picture
  Region all;         ///< and in the end
  bool touched = false;
  /// Of all kinds.
  TimePoint time{};
  std::optional<Duration> latency;  ///< of the sample that came of it
  std::string text;
};

/// A track or sample with its number.
struct TrackRecord {
  std::int64_t id = 0;
  TimePoint time{};
  Track track;
};

/// What becomes of a recording whose head and times can be read, and something else cannot.
enum class IfDamaged : std::uint8_t {
  refuse,
  take,  ///< what can be read, as far as it goes
};

class RecordingReader {
 public:
  /// A recording that was left open, by a crash say, is closed first where that can be. All pages
  /// of the file are looked at. Throws ConfigError, one line: no such file, not a recording, of
  /// another version; DamagedFile: damaged, with how much of it can be read, or with times that run
  /// backwards.
  explicit RecordingReader(const std::filesystem::path& path,
                           IfDamaged damaged = IfDamaged::refuse);
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }
  const Head& head() const noexcept { return head_; }
  /// For people, without the file's name: what may be missing because the writer did not come to
  /// its end. Empty: it did.
  std::string_view unclosed() const noexcept {
    return head_.closed ? "" : "was not closed: its last seconds may be missing";
  }
  /// Of all frames; they grow.
  const std::vector<TimePoint>& frame_times() const noexcept { return times_; }

  // Each walks through its rows in the order of events, from the first; false after the last.
  // They throw DamagedFile where the file is damaged.

  bool next(Entry& entry);
  bool next(TrackRecord& track);
  bool next(Sample& sample);
  bool next(ReferenceRecord& reading);
  bool next(EventRecord& event);

  /// Of all stretches but those that were withdrawn; a reader of its own walks on undisturbed.
  std::vector<Mark> marks() const;

 private:
  struct Cursors;
  void open();
  void check_size();
  void read_head();
  void check_times();
  void check_pages();
  std::string readable_part() const;
  /// What `read` gives of the cursors. Throws ConfigError where the file is damaged.
  template <class Read>
  auto whole(Read read) const;
  [[noreturn]] void damaged(const std::string& what) const;

  std::filesystem::path path_;
  Head head_;
  std::vector<TimePoint> times_;
  std::unique_ptr<Cursors> cursors_;
};

}  // namespace tagwrench::record

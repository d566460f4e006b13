// The tables of a recording that is being written: rows in, one transaction after the other.
#pragma once

#include <filesystem>

#include "host/recording/database.h"
#include "host/recording/records.h"

namespace tagwrench::record {

/// A frame and what is kept of it.
struct FrameRow {
  std::uint64_t sequence = 0;
  TimePoint capture_time{};
  TimePoint latency_origin{};
  std::uint32_t dropped = 0;
  std::uint32_t fourcc = 0;
  int stride = 0;
  Region first;  ///< decoded at first
  Region all;    ///< decoded in the end
};

inline constexpr std::uint32_t kCrop = fourcc("CROP");  ///< luminance of FrameRow::all, packed rows

class Sink {
 public:
  /// Makes the file and writes its head. Throws ConfigError.
  Sink(const std::filesystem::path& path, const Head& head);

  // Throw DatabaseError; nothing of the transaction is kept then.
  void frame(std::int64_t id, const FrameRow& row, std::span<const std::uint8_t> bytes);
  void track(std::int64_t id, const Track& track);
  void sample(std::int64_t id, const Sample& sample);
  void reference(std::int64_t id, const ReferenceRecord& reading);
  void event(std::int64_t id, EventKind kind, TimePoint time, int step, std::int64_t value,
             std::string_view text);
  void meta(std::string_view key, std::string_view value);

  void begin();
  void commit();
  void roll_back() noexcept;
  /// After the last commit: makes one plain file of it. False: it did not, and FILE-wal stays
  /// beside it, with nothing lost.
  bool close() noexcept;

 private:
  void write_head(const Head& head);

  Database database_;
  Statement frame_;
  Statement track_;
  Statement sample_;
  Statement reference_;
  Statement event_;
  Statement meta_;
};

}  // namespace tagwrench::record

// SQLite with an owner: connections and statements that close themselves. What a file holds is not
// trusted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "host/recording/schema.h"

struct sqlite3;
struct sqlite3_stmt;

namespace tagwrench::record {

/// What SQLite or the disk said, or what a row holds that cannot be.
struct DatabaseError : std::runtime_error {
  DatabaseError(const std::string& what, int sqlite_code, int its_errno = 0)
      : std::runtime_error(what), code(sqlite_code), system_errno(its_errno) {}

  int code;          ///< SQLite's extended result code
  int system_errno;  ///< the system's where it was the disk; 0: not known
};

class Database {
 public:
  enum class Mode : std::uint8_t { read, write };

  /// Opens a file that exists. Throws DatabaseError.
  Database(const std::filesystem::path& path, Mode mode);

  /// Throw DatabaseError.
  void run(const char* sql);
  std::int64_t number(const char* sql);
  /// Whether it went well.
  bool try_run(const char* sql) noexcept;

  sqlite3* get() const noexcept { return handle_.get(); }
  [[noreturn]] void fail(int code) const;

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept;
  };
  std::unique_ptr<sqlite3, Close> handle_;
};

/// Columns count from 0, parameters from 1. A text or blob that is bound must live until step() has
/// returned; what a column gives, until the next step().
class Statement {
 public:
  /// Throws DatabaseError if it is not SQL for this database.
  Statement(Database& database, const std::string& sql);

  void bind(int at, std::int64_t value) noexcept;
  void bind(int at, double value) noexcept;  ///< NaN becomes NULL
  void bind(int at, std::string_view text) noexcept;
  void bind(int at, std::span<const std::uint8_t> blob) noexcept;
  void bind_null(int at) noexcept;

  /// Runs a statement that gives no rows, and makes it ready for the next time. Throws
  /// DatabaseError.
  void execute();
  /// The next row; false after the last. Throws DatabaseError.
  bool step();

  bool is_null(int column) const noexcept;
  std::int64_t integer(int column) const noexcept;
  double real(int column) const noexcept;  ///< NULL is NaN
  std::string_view text(int column) const noexcept;
  std::span<const std::uint8_t> blob(int column) const noexcept;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };
  Database& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// Bytes; 0 if it is not there.
std::uint64_t size_of(const std::filesystem::path& path);

// Why a recording cannot be written any more, in words for people.

/// One line: what happened to the file, `kept` (what of it is there), and what to do. Where it
/// could not grow it says what kept it from that: the disk, a quota, or a limit on file sizes.
std::string write_trouble(const std::filesystem::path& path, const DatabaseError& error,
                          std::string_view kept);

// The tables of a recording that is being written: rows in, one transaction after the other.

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

  void begin() { database_.run("BEGIN"); }
  void commit() { database_.run("COMMIT"); }
  void roll_back() noexcept { database_.try_run("ROLLBACK"); }
  /// After the last commit: makes one plain file of it. False: it did not, and FILE-wal stays
  /// beside it, with nothing lost.
  bool close() noexcept;

 private:
  Database database_;
  Statement frame_;
  Statement track_;
  Statement sample_;
  Statement reference_;
  Statement event_;
  Statement meta_;
};

}  // namespace tagwrench::record

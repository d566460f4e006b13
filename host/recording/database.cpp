#include "host/recording/database.h"

#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <system_error>

namespace tagwrench::record {
namespace {

constexpr int kMaxValue = 256 << 20;  ///< bytes; a damaged file may claim any length
constexpr int kPatience_ms = 2000;    ///< with somebody else's lock

}  // namespace

void Database::Close::operator()(sqlite3* handle) const noexcept { sqlite3_close_v2(handle); }

void Statement::Finalize::operator()(sqlite3_stmt* statement) const noexcept {
  sqlite3_finalize(statement);
}

Database::Database(const std::filesystem::path& path, Mode mode) {
  sqlite3* handle = nullptr;
  const int flags = (mode == Mode::write ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) |
                    SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) fail(code);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kMaxValue);
  sqlite3_busy_timeout(handle, kPatience_ms);
  // A file from elsewhere may hold views and triggers that do what nobody expects.
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  try_run("PRAGMA cell_size_check = ON");
}

void Database::fail(int code) const {
  std::string what = handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(code);
  const int error = handle_ ? sqlite3_system_errno(handle_.get()) : 0;
  const bool of_the_system = (code & 0xff) == SQLITE_IOERR || (code & 0xff) == SQLITE_CANTOPEN;
  if (error != 0 && of_the_system) what += std::string(", ") + std::strerror(error);
  if (error == 0 && of_the_system) what += " (SQLite " + std::to_string(code) + ")";
  // It may quote what a damaged file holds.
  constexpr std::size_t kMax = 200;
  what = what.substr(0, kMax);
  for (char& c : what) {
    if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~') c = ' ';
  }
  throw DatabaseError(what, code, of_the_system ? error : 0);
}

void Database::run(const char* sql) {
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

bool Database::try_run(const char* sql) noexcept {
  return sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK;
}

std::int64_t Database::number(const char* sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

Statement::Statement(Database& database, const std::string& sql) : database_(database) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(database.get(), sql.c_str(), static_cast<int>(sql.size()) + 1,
                                      SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  statement_.reset(statement);
  if (code != SQLITE_OK) database.fail(code);
}

void Statement::bind(int at, std::int64_t value) noexcept {
  sqlite3_bind_int64(statement_.get(), at, value);
}

void Statement::bind(int at, double value) noexcept {
  sqlite3_bind_double(statement_.get(), at, value);
}

void Statement::bind(int at, std::string_view text) noexcept {
  sqlite3_bind_text(statement_.get(), at, text.data(), static_cast<int>(text.size()),
                    SQLITE_STATIC);
}

void Statement::bind(int at, std::span<const std::uint8_t> blob) noexcept {
  sqlite3_bind_blob64(statement_.get(), at, blob.data(), blob.size(), SQLITE_STATIC);
}

void Statement::bind_null(int at) noexcept { sqlite3_bind_null(statement_.get(), at); }

void Statement::execute() {
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_DONE && code != SQLITE_ROW) {
    sqlite3_reset(statement_.get());
    database_.fail(code);
  }
  sqlite3_reset(statement_.get());
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_DONE && code != SQLITE_ROW) database_.fail(code);
  return code == SQLITE_ROW;
}

bool Statement::is_null(int column) const noexcept {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

std::int64_t Statement::integer(int column) const noexcept {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const noexcept {
  if (is_null(column)) return std::numeric_limits<double>::quiet_NaN();
  return sqlite3_column_double(statement_.get(), column);
}

std::string_view Statement::text(int column) const noexcept {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (text == nullptr) return {};
  return {text, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::span<const std::uint8_t> Statement::blob(int column) const noexcept {
  const auto* bytes =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  if (bytes == nullptr) return {};
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

namespace {

struct Cause {
  std::string what;
  std::string remedy;
};

constexpr const char* kLess = "keep less of each frame (--keep region)";

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

/// Bytes, where the file or its log is about as large as this process may make one.
std::optional<std::uint64_t> limit_reached(const std::filesystem::path& path) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  constexpr std::uint64_t kNextWrite = 64UL << 10;  // that did not fit any more
  const std::uint64_t size = std::max(size_of(path), size_of(path.string() + "-wal"));
  if (size + kNextWrite < limit.rlim_cur) return {};
  return limit.rlim_cur;
}

/// Of a file that cannot grow; empty: something else.
std::optional<Cause> cannot_grow(const std::filesystem::path& path, const DatabaseError& error) {
  const int kind = error.code() & 0xff;
  const int system = error.system_errno();
  if (kind != SQLITE_FULL && kind != SQLITE_IOERR) return {};
  // First, because a write that ended in the middle passes for a full disk, or has no errno.
  if (const auto limit = limit_reached(path)) {
    return Cause{
        fmt::format("files may have {:.3g} MB here (ulimit -f)", static_cast<double>(*limit) / 1e6),
        fmt::format("raise that limit, or {}", kLess)};
  }
  if (system == EFBIG)
    return Cause{"this disk takes no larger files (FAT: 4 GB)",
                 fmt::format("choose another disk, or {}", kLess)};
  if (system == EDQUOT)
    return Cause{"your quota on this disk is used up",
                 fmt::format("free some space, choose another disk, or {}", kLess)};
  if (kind != SQLITE_FULL && system != ENOSPC) return {};
  return Cause{"the disk is full",
               fmt::format("free some space, choose another disk, or {}", kLess)};
}

}  // namespace

std::string write_trouble(const std::filesystem::path& path, const DatabaseError& error,
                          std::string_view kept) {
  if (const auto cause = cannot_grow(path, error)) {
    return fmt::format("{}: the file could not grow: {}; {}; {}", path.string(), cause->what, kept,
                       cause->remedy);
  }
  return fmt::format("{}: cannot be written: {}; {}; look at the disk, and choose another file",
                     path.string(), error.what(), kept);
}

}  // namespace tagwrench::record

#include "host/recording/database.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "host/recording/schema.h"

namespace tagwrench::record {
namespace {

constexpr int kMaxValue = 256 << 20;  ///< bytes; a damaged file may claim any length
constexpr int kPatience_ms = 2000;    ///< with somebody else's lock

struct Cause {
  std::string what;
  std::string remedy;  ///< or kLess
};

constexpr const char* kLess = "keep less of each frame (--keep region)";

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
  const int kind = error.code & 0xff;
  const int system = error.system_errno;
  if (kind != SQLITE_FULL && kind != SQLITE_IOERR) return {};
  // First, because a write that ended in the middle passes for a full disk, or has no errno.
  if (const auto limit = limit_reached(path)) {
    return Cause{
        fmt::format("files may have {:.3g} MB here (ulimit -f)", static_cast<double>(*limit) / 1e6),
        "raise that limit"};
  }
  if (system == EFBIG)
    return Cause{"this disk takes no larger files (FAT: 4 GB)", "choose another disk"};
  constexpr const char* kSpace = "free some space, choose another disk";
  if (system == EDQUOT) return Cause{"your quota on this disk is used up", kSpace};
  if (kind != SQLITE_FULL && system != ENOSPC) return {};
  return Cause{"the disk is full", kSpace};
}

/// For pictures: overflow chains of 4 KiB pages would be long.
constexpr int kPageBytes = 16384;
/// What the write-ahead log grows to before it is moved into the file itself.
constexpr int kLogBytes = 16 << 20;

std::string insert(const char* table, int columns) {
  std::string sql = fmt::format("INSERT INTO {} VALUES (?", table);
  for (int i = 1; i < columns; ++i) sql += ",?";
  return sql + ")";
}

std::span<const std::uint8_t> bytes_of(const double* numbers, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(numbers), count * sizeof(double)};
}

// put() binds values to the parameters, one after the other, and runs the statement.

template <class Value>
requires std::is_arithmetic_v<Value>
void put_one(Statement& statement, int& at, Value value) {
  using Wide = std::conditional_t<std::is_integral_v<Value>, std::int64_t, double>;
  statement.bind(at++, static_cast<Wide>(value));
}
void put_one(Statement& statement, int& at, std::string_view text) { statement.bind(at++, text); }
void put_one(Statement& statement, int& at, std::span<const std::uint8_t> blob) {
  statement.bind(at++, blob);
}
void put_one(Statement& statement, int& at, TimePoint time) {
  statement.bind(
      at++, std::int64_t{std::chrono::duration_cast<Duration>(time.time_since_epoch()).count()});
}
void put_one(Statement& statement, int& at, const Region& r) {
  for (const int number : {r.x, r.y, r.width, r.height}) statement.bind(at++, std::int64_t{number});
}
template <class Six>
requires requires(const Six& six) {
  six[5] + 0.0;
  six.begin();
}
void put_one(Statement& statement, int& at, const Six& numbers) {
  for (const double number : numbers) statement.bind(at++, number);
}
template <class Value>
void put_one(Statement& statement, int& at, const std::optional<Value>& value) {
  value ? put_one(statement, at, *value) : statement.bind_null(at++);
}
void put(Statement& statement, const auto&... values) {
  int at = 1;
  (put_one(statement, at, values), ...);
  statement.execute();
}

constexpr std::array<const char*, 3> kParts = {"-wal", "-shm", "-journal"};

void make_for_owner(const std::filesystem::path& path) {
  const UniqueFd file(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (file) return;
  if (errno == EEXIST) {
    throw ConfigError("{}: exists, and a recording replaces nothing; choose another name",
                      path.string());
  }
  throw ConfigError("{}: cannot be made: {}; choose a folder that can be written", path.string(),
                    std::strerror(errno));
}

/// The file must be new: nobody's data is overwritten, and of two writers one is refused. What a
/// camera saw is for its owner alone, so nothing of another user's may lie at the names of the
/// parts that SQLite puts beside it, either.
std::filesystem::path created(const std::filesystem::path& path) {
  make_for_owner(path);
  for (const char* part : kParts) {
    struct stat facts {};
    const std::string beside = path.string() + part;
    if (::lstat(beside.c_str(), &facts) != 0) continue;
    ::unlink(path.c_str());
    throw ConfigError("{}: was left over beside a recording; remove it, or choose another name",
                      beside);
  }
  return path;
}

/// Again when SQLite has opened them, for somebody may have been quick. Throws ConfigError.
void check_parts(const std::filesystem::path& path) {
  for (const char* part : kParts) {
    struct stat facts {};
    const std::string beside = path.string() + part;
    if (::lstat(beside.c_str(), &facts) != 0) continue;
    if (facts.st_uid == ::geteuid() && S_ISREG(facts.st_mode) && (facts.st_mode & 0077) == 0)
      continue;
    ::unlink(path.c_str());
    throw ConfigError("{}: is another user's; record into a folder of yours", beside);
  }
}

Database prepared(const std::filesystem::path& path) {
  Database database(created(path), Database::Mode::write);
  database.run(fmt::format("PRAGMA page_size = {}", kPageBytes).c_str());
  database.run("PRAGMA journal_mode = WAL");
  database.run("PRAGMA synchronous = FULL");  // on the disk with the commit, not some time later
  database.run(fmt::format("PRAGMA wal_autocheckpoint = {}", kLogBytes / kPageBytes).c_str());
  database.run(fmt::format("PRAGMA journal_size_limit = {}", kLogBytes).c_str());
  database.run("BEGIN");
  database.run(fmt::format("PRAGMA application_id = {}", kApplicationId).c_str());
  database.run(fmt::format("PRAGMA user_version = {}", kSchemaVersion).c_str());
  database.run(kSchema);
  check_parts(path);
  return database;
}

/// What was made of a file that cannot be written goes, so that its name is free again.
ConfigError not_begun(const std::filesystem::path& path, const DatabaseError& error) {
  const std::string line = write_trouble(path, error, "nothing was recorded");
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  for (const char* part : kParts) std::filesystem::remove(path.string() + part, ignored);
  return ConfigError(line);
}

Database open_new(const std::filesystem::path& path) {
  try {
    return prepared(path);
  } catch (const DatabaseError& e) {
    throw not_begun(path, e);
  }
}

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
  for (char& c : what)
    if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~') c = ' ';
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

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

std::string write_trouble(const std::filesystem::path& path, const DatabaseError& error,
                          std::string_view kept) {
  if (const auto cause = cannot_grow(path, error)) {
    return fmt::format("{}: the file could not grow: {}; {}; {}, or {}", path.string(), cause->what,
                       kept, cause->remedy, kLess);
  }
  return fmt::format("{}: cannot be written: {}; {}; look at the disk, and choose another file",
                     path.string(), error.what(), kept);
}

Sink::Sink(const std::filesystem::path& path, const Head& head)
    : database_(open_new(path)),
      frame_(database_, insert("frames", 16)),
      track_(database_, insert("tracks", 15)),
      sample_(database_, insert("samples", 45)),
      reference_(database_, insert("reference", 25)),
      event_(database_, insert("events", 6)),
      meta_(database_, "INSERT OR REPLACE INTO meta VALUES (?,?)") {
  try {
    meta("created", head.created);
    meta("software", head.software);
    meta("source", head.source);
    meta("width", std::to_string(head.width));
    meta("height", std::to_string(head.height));
    meta("period_ns", std::to_string(head.period.count()));
    meta("keep", name(head.keep));
    meta("closed", "0");
    for (const auto& [key, value] : head.more) meta(key, value);
    Statement file(database_, "INSERT INTO files VALUES (?,?,?)");
    const auto keep = [&file](std::string_view role, std::string_view called,
                              const std::string& content) {
      put(file, role, called,
          std::span(reinterpret_cast<const std::uint8_t*>(content.data()), content.size()));
    };
    keep("sensor.yaml", head.sensor_name, head.sensor_yaml);
    if (!head.appearance.empty()) keep("appearance", "", head.appearance);
    if (!head.calibration.empty()) keep("calibration", "", head.calibration);
    for (const auto& [called, content] : head.measured)
      keep(kMeasuredRole + called, called, content);
    commit();
  } catch (const DatabaseError& e) {
    throw not_begun(path, e);
  }
}

void Sink::meta(std::string_view key, std::string_view value) { put(meta_, key, value); }

void Sink::frame(std::int64_t id, const FrameRow& row, std::span<const std::uint8_t> bytes) {
  char code[4];
  for (int i = 0; i < 4; ++i) code[i] = static_cast<char>(row.fourcc >> (8 * i) & 0xff);
  const auto if_kept = [&](auto value) {
    return bytes.empty() ? std::nullopt : std::optional(value);
  };
  put(frame_, id, row.sequence, row.capture_time, row.latency_origin, row.dropped,
      if_kept(std::string_view(code, 4)), if_kept(row.stride), row.first, row.all, if_kept(bytes));
}

void Sink::track(std::int64_t id, const Track& track) {
  std::array<double, 21> covariance{};
  std::size_t n = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) covariance[n++] = track.covariance(row, column);
  std::array<double, 9 * std::tuple_size_v<decltype(Track::corners)>> corners{};
  const std::size_t tags = std::min<std::size_t>(track.corner_count, track.corners.size());
  for (std::size_t t = 0; t < tags; ++t) {
    corners[9 * t] = track.corners[t].id;
    std::copy(track.corners[t].px.begin(), track.corners[t].px.end(), &corners[9 * t + 1]);
  }
  put(track_, id, name(track.status), static_cast<int>(track.diagnostic), track.displacement,
      bytes_of(covariance.data(), covariance.size()), track.residual_px, track.residual_fraction,
      track.blur_px2, track.tags_held, bytes_of(corners.data(), 9 * tags));
}

void Sink::sample(std::int64_t id, const Sample& sample) {
  put(sample_, id, sample.sequence, sample.capture_time, sample.latency_origin, sample.output_time,
      sample.dropped, name(sample.status), sample.displacement, sample.displacement_sigma,
      sample.wrench, sample.wrench_sigma, sample.zero, sample.deflection,
      static_cast<int>(sample.zero_state), sample.touched);
}

void Sink::reference(std::int64_t id, const ReferenceRecord& reading) {
  put(reference_, id, reading.time, reading.time_sigma.count(), reading.channel, reading.axes,
      reading.saturated, reading.lost_before, reading.counts, reading.value, reading.sigma);
}

void Sink::event(std::int64_t id, EventKind kind, TimePoint time, int step, std::int64_t value,
                 std::string_view text) {
  put(event_, id, time, name(kind), step, value, text);
}

bool Sink::close() noexcept {
  // One file that is read where nothing can be written, too.
  return database_.try_run("PRAGMA wal_checkpoint(TRUNCATE)") &&
         database_.try_run("PRAGMA journal_mode = DELETE");
}

}  // namespace tagwrench::record

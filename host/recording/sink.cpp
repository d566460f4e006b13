#include "host/recording/sink.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "host/recording/database.h"
#include "host/recording/schema.h"

namespace tagwrench::record {
namespace {

/// For pictures: overflow chains of 4 KiB pages would be long.
constexpr int kPageBytes = 16384;
/// What the write-ahead log grows to before it is moved into the file itself.
constexpr int kLogBytes = 16 << 20;

std::int64_t ns(TimePoint time) {
  return std::chrono::duration_cast<Duration>(time.time_since_epoch()).count();
}

std::string insert(const char* table, int columns) {
  std::string sql = fmt::format("INSERT INTO {} VALUES (?", table);
  for (int i = 1; i < columns; ++i) sql += ",?";
  return sql + ")";
}

std::span<const std::uint8_t> bytes_of(const double* numbers, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(numbers), count * sizeof(double)};
}

/// The file must be new: nobody's data is overwritten, and of two writers one is refused.
std::filesystem::path created(const std::filesystem::path& path) {
  const UniqueFd file(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (file) return path;
  if (errno == EEXIST) {
    throw ConfigError(fmt::format(
        "{}: exists, and a recording replaces nothing; choose another name", path.string()));
  }
  throw ConfigError(fmt::format("{}: cannot be made: {}; choose a folder that can be written",
                                path.string(), std::strerror(errno)));
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
  return database;
}

/// What was made of a file that cannot be written goes, so that its name is free again.
ConfigError not_begun(const std::filesystem::path& path, const DatabaseError& error) {
  const std::string line = write_trouble(path, error, "nothing was recorded");
  for (const char* part : {"", "-wal", "-shm", "-journal"}) {
    std::error_code ignored;
    std::filesystem::remove(path.string() + part, ignored);
  }
  return ConfigError(line);
}

Database open_new(const std::filesystem::path& path) {
  try {
    return prepared(path);
  } catch (const DatabaseError& e) {
    throw not_begun(path, e);
  }
}

/// Six at `at` and following.
void bind6(Statement& statement, int at, const Vector6& v) {
  for (int i = 0; i < 6; ++i) statement.bind(at + i, v[i]);
}

void bind_region(Statement& statement, int at, const Region& r) {
  const int numbers[4] = {r.x, r.y, r.width, r.height};
  for (int i = 0; i < 4; ++i) statement.bind(at + i, std::int64_t{numbers[i]});
}

}  // namespace

Sink::Sink(const std::filesystem::path& path, const Head& head)
    : database_(open_new(path)),
      frame_(database_, insert("frames", 16)),
      track_(database_, insert("tracks", 15)),
      sample_(database_, insert("samples", 45)),
      reference_(database_, insert("reference", 25)),
      event_(database_, insert("events", 6)),
      meta_(database_, "INSERT OR REPLACE INTO meta VALUES (?,?)") {
  try {
    write_head(head);
    commit();
  } catch (const DatabaseError& e) {
    throw not_begun(path, e);
  }
}

void Sink::write_head(const Head& head) {
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
  const auto put = [&file](std::string_view role, const std::string& called,
                           const std::string& content) {
    file.bind(1, role);
    file.bind(2, std::string_view(called));
    file.bind(3, std::span(reinterpret_cast<const std::uint8_t*>(content.data()), content.size()));
    file.execute();
  };
  put("sensor.yaml", head.sensor_name, head.sensor_yaml);
  if (!head.appearance.empty()) put("appearance", "", head.appearance);
  if (!head.calibration.empty()) put("calibration", "", head.calibration);
  for (const auto& [called, content] : head.measured) put(kMeasuredRole + called, called, content);
}

void Sink::meta(std::string_view key, std::string_view value) {
  meta_.bind(1, key);
  meta_.bind(2, value);
  meta_.execute();
}

void Sink::frame(std::int64_t id, const FrameRow& row, std::span<const std::uint8_t> bytes) {
  char code[4];
  for (int i = 0; i < 4; ++i) code[i] = static_cast<char>(row.fourcc >> (8 * i) & 0xff);
  frame_.bind(1, id);
  frame_.bind(2, static_cast<std::int64_t>(row.sequence));
  frame_.bind(3, ns(row.capture_time));
  frame_.bind(4, ns(row.latency_origin));
  frame_.bind(5, std::int64_t{row.dropped});
  if (bytes.empty()) {
    for (const int at : {6, 7, 16}) frame_.bind_null(at);
  } else {
    frame_.bind(6, std::string_view(code, 4));
    frame_.bind(7, std::int64_t{row.stride});
    frame_.bind(16, bytes);
  }
  bind_region(frame_, 8, row.first);
  bind_region(frame_, 12, row.all);
  frame_.execute();
}

void Sink::track(std::int64_t id, const Track& track) {
  std::array<double, 21> covariance{};
  std::size_t n = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) covariance[n++] = track.covariance(row, column);
  }
  std::array<double, 9 * std::tuple_size_v<decltype(Track::corners)>> corners{};
  const std::size_t tags = std::min<std::size_t>(track.corner_count, track.corners.size());
  for (std::size_t t = 0; t < tags; ++t) {
    corners[9 * t] = track.corners[t].id;
    std::copy(track.corners[t].px.begin(), track.corners[t].px.end(), &corners[9 * t + 1]);
  }
  track_.bind(1, id);
  track_.bind(2, std::string_view(name(track.status)));
  track_.bind(3, static_cast<std::int64_t>(track.diagnostic));
  bind6(track_, 4, track.displacement);
  track_.bind(10, bytes_of(covariance.data(), covariance.size()));
  track_.bind(11, track.residual_px);
  track_.bind(12, track.residual_fraction);
  track_.bind(13, track.blur_px2);
  track_.bind(14, std::int64_t{track.tags_held});
  track_.bind(15, bytes_of(corners.data(), 9 * tags));
  track_.execute();
}

void Sink::sample(std::int64_t id, const Sample& sample) {
  sample_.bind(1, id);
  sample_.bind(2, static_cast<std::int64_t>(sample.sequence));
  sample_.bind(3, ns(sample.capture_time));
  sample_.bind(4, ns(sample.latency_origin));
  sample_.bind(5, ns(sample.output_time));
  sample_.bind(6, std::int64_t{sample.dropped});
  sample_.bind(7, std::string_view(name(sample.status)));
  bind6(sample_, 8, sample.displacement);
  bind6(sample_, 14, sample.displacement_sigma);
  bind6(sample_, 20, sample.wrench);
  bind6(sample_, 26, sample.wrench_sigma);
  bind6(sample_, 32, sample.zero);
  bind6(sample_, 38, sample.deflection);
  sample_.bind(44, static_cast<std::int64_t>(sample.zero_state));
  sample_.bind(45, std::int64_t{sample.touched});
  sample_.execute();
}

void Sink::reference(std::int64_t id, const ReferenceRecord& reading) {
  reference_.bind(1, id);
  reference_.bind(2, ns(reading.time));
  reference_.bind(3, std::int64_t{reading.time_sigma.count()});
  reference_.bind(4, std::int64_t{reading.channel});
  reference_.bind(5, std::int64_t{reading.axes});
  reference_.bind(6, std::int64_t{reading.saturated});
  reference_.bind(7, std::int64_t{reading.lost_before});
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    reference_.bind(8 + i, reading.counts[at]);
    reference_.bind(14 + i, reading.value[at]);
    reference_.bind(20 + i, reading.sigma[at]);
  }
  reference_.execute();
}

void Sink::event(std::int64_t id, EventKind kind, TimePoint time, int step, std::int64_t value,
                 std::string_view text) {
  event_.bind(1, id);
  event_.bind(2, ns(time));
  event_.bind(3, name(kind));
  event_.bind(4, std::int64_t{step});
  event_.bind(5, value);
  event_.bind(6, text);
  event_.execute();
}

void Sink::begin() { database_.run("BEGIN"); }

void Sink::commit() { database_.run("COMMIT"); }

void Sink::roll_back() noexcept { database_.try_run("ROLLBACK"); }

bool Sink::close() noexcept {
  // One file that is read where nothing can be written, too.
  return database_.try_run("PRAGMA wal_checkpoint(TRUNCATE)") &&
         database_.try_run("PRAGMA journal_mode = DELETE");
}

}  // namespace tagwrench::record

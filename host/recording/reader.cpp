#include "host/recording/reader.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <map>
#include <system_error>

#include "host/core/config_error.h"
#include "host/recording/database.h"
#include "host/recording/schema.h"

namespace tagwrench::record {
namespace {

constexpr int kMaxKeys = 1000;
constexpr std::int64_t kMax_px = 16384;       ///< side of a picture
constexpr std::size_t kMaxText = 1 << 20;     ///< bytes
constexpr std::int64_t kMaxStep = 1'000'000;  ///< of a plan

// What is read below, in the order of events.

constexpr const char* kFrames =
    "SELECT f.id, f.seq, f.t_ns, f.dropped, f.fourcc, f.stride, f.first_x, f.first_y, "
    "f.first_width, f.first_height, f.all_x, f.all_y, f.all_width, f.all_height, s.output_ns - "
    "s.origin_ns, s.touched, f.bytes FROM frames f LEFT JOIN samples s ON s.id = f.id ORDER BY "
    "f.id";
constexpr const char* kTroubles =
    "SELECT e.id, e.kind, e.t_ns, e.text, s.output_ns - s.origin_ns FROM events e LEFT JOIN "
    "samples s ON s.id = e.id WHERE e.kind IN ('missing', 'disconnected', 'reconnected') ORDER BY "
    "e.id";
constexpr const char* kTracks =
    "SELECT t.id, f.t_ns, t.status, t.hint, t.x, t.y, t.z, t.rx, t.ry, t.rz, t.covariance, "
    "t.residual_px, t.residual_part, t.blur_px2, t.tags_held, t.corners FROM tracks t JOIN frames "
    "f ON f.id = t.id ORDER BY t.id";
constexpr const char* kSamples = "SELECT * FROM samples ORDER BY id";
constexpr const char* kReferences = "SELECT * FROM reference ORDER BY id";
constexpr const char* kEvents = "SELECT id, t_ns, kind, step, value, text FROM events ORDER BY id";
constexpr const char* kMarks =
    "SELECT id, t_ns, step, value FROM events WHERE kind = 'mark' ORDER BY id";

static_assert(std::endian::native == std::endian::little, "blobs are copied as they are");

constexpr std::int64_t kMax_ns = 3'000'000'000'000'000'000;

Duration duration(std::int64_t ns) { return Duration(std::clamp(ns, -kMax_ns, kMax_ns)); }

std::optional<Status> status_of(std::string_view text) {
  for (const Status s :
       {Status::ok, Status::acquiring, Status::lost, Status::doubtful, Status::saturated})
    if (text == name(s)) return s;
  return std::nullopt;
}

/// The value of this name; nothing: none has it.
template <class Value>
std::optional<Value> of_name(const auto& names, std::string_view text) {
  const auto found = std::ranges::find(names, text);
  if (found == names.end()) return {};
  return static_cast<Value>(found - names.begin());
}

/// A part of the picture; empty if the numbers are none.
Region region(const Statement& row, int at, int width, int height) {
  std::int64_t n[4];
  for (int i = 0; i < 4; ++i) n[i] = row.integer(at + i);
  if (n[0] < 0 || n[1] < 0 || n[2] <= 0 || n[3] <= 0 || n[0] > width || n[1] > height ||
      n[2] > width - n[0] || n[3] > height - n[1])
    return {};
  return {static_cast<int>(n[0]), static_cast<int>(n[1]), static_cast<int>(n[2]),
          static_cast<int>(n[3])};
}

/// On the frames' clock; what is further than 95 years off is brought nearer, so that times can be
/// added and subtracted.
TimePoint time_point(std::int64_t ns) { return TimePoint(duration(ns)); }

std::vector<double> doubles(std::span<const std::uint8_t> blob) {
  std::vector<double> numbers(blob.size() / sizeof(double));
  if (!numbers.empty()) std::memcpy(numbers.data(), blob.data(), numbers.size() * sizeof(double));
  return numbers;
}

void read_covariance(const std::vector<double>& numbers, Matrix6& covariance) {
  if (numbers.size() != 21) return;
  std::size_t n = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      covariance(row, column) = covariance(column, row) = numbers[n++];
}

void read_corners(const std::vector<double>& numbers, Track& track) {
  const std::size_t tags = std::min(numbers.size() / 9, track.corners.size());
  for (std::size_t t = 0; t < tags; ++t) {
    const double id = numbers[9 * t];
    if (!(id >= 0 && id < 1e6)) return;
    track.corners[t].id = static_cast<int>(id);
    std::copy_n(&numbers[9 * t + 1], 8, track.corners[t].px.begin());
    track.corner_count = static_cast<std::uint8_t>(t + 1);
  }
}

// take() reads the columns from `at` on into values, one after the other.

void take_one(const Statement& row, int& at, std::uint64_t& value) {
  value = static_cast<std::uint64_t>(row.integer(at++));
}
void take_one(const Statement& row, int& at, std::uint32_t& value) {  // it counts something
  value = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(row.integer(at++), 0, std::numeric_limits<std::uint32_t>::max()));
}
void take_one(const Statement& row, int& at, bool& value) { value = row.integer(at++) != 0; }
void take_one(const Statement& row, int& at, double& value) { value = row.real(at++); }
void take_one(const Statement& row, int& at, TimePoint& value) {
  value = time_point(row.integer(at++));
}
void take_one(const Statement& row, int& at, std::string& value) {
  value = row.text(at++).substr(0, kMaxText);
}
template <class Six>
requires requires(Six& six) {
  six[5] = 0.0;
  six.begin();
}
void take_one(const Statement& row, int& at, Six& value) {
  for (double& number : value) number = row.real(at++);
}
void take(const Statement& row, int at, auto&... values) { (take_one(row, at, values), ...); }

DatabaseError impossible(const std::string& what) { return {what, SQLITE_CORRUPT}; }

// Of the row that a statement of the SQL above stands on. Every number is checked before it is
// used; throw DatabaseError where it holds what cannot be.

void read(const Statement& row, const Head& head, Entry& entry) {
  entry = {};
  entry.id = row.integer(0);
  take(row, 1, entry.sequence, entry.time, entry.dropped);
  const std::string_view code = row.text(4);
  for (std::size_t i = std::min<std::size_t>(code.size(), 4); i-- > 0;)
    entry.raw.fourcc = entry.raw.fourcc << 8 | static_cast<std::uint8_t>(code[i]);
  entry.crop = code == "CROP";
  const std::int64_t stride = row.integer(5);
  entry.raw.stride = stride < 0 || stride > 8 * kMax_px ? 0 : static_cast<int>(stride);
  entry.first = region(row, 6, head.width, head.height);
  entry.all = region(row, 10, head.width, head.height);
  if (!row.is_null(14)) entry.latency = duration(row.integer(14));
  take(row, 15, entry.touched);
  entry.raw.bytes = row.blob(16);
  const auto area =
      static_cast<std::size_t>(entry.all.width) * static_cast<std::size_t>(entry.all.height);
  if (entry.crop &&
      (entry.first.empty() || !entry.all.contains(entry.first) || entry.raw.bytes.size() != area))
    entry.raw.bytes = {};
}

void read_trouble(const Statement& row, Entry& entry) {
  entry = {};
  entry.id = row.integer(0);
  const auto kind = of_name<EventKind>(kEventNames, row.text(1));
  entry.kind = kind == EventKind::missing        ? Entry::Kind::missing
               : kind == EventKind::disconnected ? Entry::Kind::disconnected
                                                 : Entry::Kind::reconnected;
  take(row, 2, entry.time, entry.text);
  if (!row.is_null(4)) entry.latency = duration(row.integer(4));
}

Status read_status(const Statement& row, int at, const char* what) {
  const auto status = status_of(row.text(at));
  if (!status) throw impossible(fmt::format("{} {} has an unknown status", what, row.integer(0)));
  return *status;
}

void read(const Statement& row, TrackRecord& record) {
  record = {.id = row.integer(0), .time = time_point(row.integer(1)), .track = {}};
  Track& track = record.track;
  track.status = read_status(row, 2, "track");
  const std::int64_t diagnostic = row.integer(3);
  if (diagnostic >= 0 && diagnostic <= static_cast<std::int64_t>(Diagnostic::rest_elsewhere))
    track.diagnostic = static_cast<Diagnostic>(diagnostic);
  take(row, 4, track.displacement);
  read_covariance(doubles(row.blob(10)), track.covariance);
  take(row, 11, track.residual_px, track.residual_fraction, track.blur_px2);
  track.tags_held = static_cast<std::uint8_t>(std::clamp<std::int64_t>(row.integer(14), 0, 255));
  read_corners(doubles(row.blob(15)), track);
}

void read(const Statement& row, Sample& sample) {
  sample = {};
  take(row, 1, sample.sequence, sample.capture_time, sample.latency_origin, sample.output_time,
       sample.dropped);
  sample.status = read_status(row, 6, "sample");
  take(row, 7, sample.displacement, sample.displacement_sigma, sample.wrench, sample.wrench_sigma,
       sample.zero, sample.deflection);
  sample.zero_state = static_cast<ZeroState>(
      std::clamp<std::int64_t>(row.integer(43), 0, static_cast<int>(ZeroState::following)));
  take(row, 44, sample.touched);
}

void read(const Statement& row, ReferenceRecord& reading) {
  reading = {};
  reading.id = row.integer(0);
  reading.time = time_point(row.integer(1));
  reading.time_sigma = duration(row.integer(2));
  reading.channel = static_cast<int>(std::clamp<std::int64_t>(row.integer(3), 0, 255));
  reading.axes = row.integer(4) == 6 ? 6 : 1;
  take(row, 5, reading.saturated, reading.lost_before, reading.counts, reading.value,
       reading.sigma);
}

void read(const Statement& row, EventRecord& event) {
  event = {};
  event.id = row.integer(0);
  event.time = time_point(row.integer(1));
  const auto kind = of_name<EventKind>(kEventNames, row.text(2));
  if (!kind) throw impossible(fmt::format("event {} is of an unknown kind", event.id));
  event.kind = *kind;
  event.step = static_cast<int>(std::clamp<std::int64_t>(row.integer(3), -1, kMaxStep));
  event.value = row.integer(4);
  take(row, 5, event.text);
}

/// `marks` after one more, or after the latest stretch of its step no longer counts.
void add_mark(const Statement& row, std::vector<Mark>& marks) {
  const std::int64_t step = row.integer(2);
  if (step < 0 || step > kMaxStep) throw impossible(fmt::format("a mark is of step {}", step));
  const std::int64_t value = row.integer(3);
  if (value < kMarkWithdrawn || value > kMaxStep)
    throw impossible(fmt::format("a mark has the value {}", value));
  if (value == kMarkWithdrawn) {
    for (const bool begin : {false, true}) {
      const auto last = std::find_if(marks.rbegin(), marks.rend(), [&](const Mark& mark) {
        return mark.step == step && mark.begin == begin;
      });
      if (last != marks.rend()) marks.erase(std::next(last).base());
    }
    return;
  }
  const auto zero = static_cast<int>(std::max<std::int64_t>(value - kMarkBegins, 0));
  marks.push_back({static_cast<int>(step), value >= kMarkBegins, time_point(row.integer(1)),
                   row.integer(0), zero});
}

/// Walks through rows whose first column is their id.
class Walk {
 public:
  explicit Walk(const char* sql) : sql_(sql) {}

  /// The next row; false after the last. Throws DatabaseError. In a damaged tree of pages one may
  /// lead to itself: that ends here, because ids must grow.
  bool step(Database& database) {
    if (!rows_) rows_.emplace(database, sql_);
    if (ended_ || !rows_->step()) {
      ended_ = true;
      return false;
    }
    const std::int64_t id = rows_->integer(0);
    if (last_ && id <= *last_) throw DatabaseError("its rows are not in order", SQLITE_CORRUPT);
    last_ = id;
    return true;
  }
  const Statement& row() const { return *rows_; }

  template <class Record>
  bool next(Database& database, Record& record) {
    if (!step(database)) return false;
    read(row(), record);
    return true;
  }

 private:
  const char* sql_;
  std::optional<Statement> rows_;
  std::optional<std::int64_t> last_;
  bool ended_ = false;
};

/// A crash leaves FILE-wal beside the file. Where nobody else has it open and the folder can be
/// written, it becomes one file again.
void close_left_open(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path.string() + "-wal", error)) return;
  try {
    Database database(path, Database::Mode::write);
    database.try_run("PRAGMA busy_timeout = 0");
    database.try_run("PRAGMA journal_mode = DELETE");
  } catch (const DatabaseError&) {
    return;  // then it is read as it is, if it can be
  }
}

}  // namespace

struct RecordingReader::Cursors {
  explicit Cursors(const std::filesystem::path& path) : database(path, Database::Mode::read) {}

  Database database;
  Walk frames{kFrames};
  Walk troubles{kTroubles};
  Walk tracks{kTracks};
  Walk samples{kSamples};
  Walk references{kReferences};
  Walk events{kEvents};
  bool frame_waits = false;    ///< `frames` stands on a row that was not handed out
  bool trouble_waits = false;  ///< likewise `troubles`
};

RecordingReader::RecordingReader(const std::filesystem::path& path, IfDamaged if_damaged)
    : path_(path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    throw ConfigError("{}: no such file; give one that `tagwrench record --out` made",
                      path.string());
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    throw ConfigError("{}: is not a file; give one that `tagwrench record --out` made",
                      path.string());
  }
  try {
    open();
    check_size();
    read_head();
    check_times();
    if (if_damaged == IfDamaged::refuse) check_pages();
  } catch (const DatabaseError& e) {
    if (e.code == SQLITE_NOTADB) {
      throw ConfigError("{}: is not a recording; give a file that `tagwrench record --out` made",
                        path.string());
    }
    if ((e.code & 0xff) == SQLITE_CANTOPEN || (e.code & 0xff) == SQLITE_READONLY) {
      throw ConfigError(
          "{}: cannot be opened: {}; if {}-wal is beside it, copy both to a folder of yours",
          path.string(), e.what(), path.filename().string());
    }
    damaged(e.what());
  }
}

RecordingReader::~RecordingReader() = default;

void RecordingReader::damaged(const std::string& what) const {
  throw DamagedFile(
      "{0}: is damaged: {1}; take a copy that is whole, or `sqlite3 {0} .recover` for what is left",
      path_.string(), what);
}

void RecordingReader::open() {
  close_left_open(path_);
  cursors_ = std::make_unique<Cursors>(path_);
  Database& database = cursors_->database;
  if (database.number("PRAGMA application_id") != kApplicationId) {
    throw ConfigError("{}: is not a recording; give a file that `tagwrench record --out` made",
                      path_.string());
  }
  const std::int64_t version = database.number("PRAGMA user_version");
  if (version != kSchemaVersion) {
    throw ConfigError(
        "{}: is a recording of format {}, and this version reads format {}; use the tagwrench that "
        "made it",
        path_.string(), version, kSchemaVersion);
  }
  // A generated column, a constraint or an index may hold an expression that runs for ever. All of
  // them need parentheses of their own.
  constexpr const char* kOthers =
      "SELECT count(*) FROM sqlite_schema WHERE sql IS NOT NULL AND (type <> 'table' OR sql NOT "
      "LIKE "
      "'CREATE TABLE %' OR length(sql) - length(replace(sql, '(', '')) <> 1)";
  if (database.number(kOthers) != 0) {
    throw ConfigError(
        "{}: holds more than the tables of a recording; give a file as `tagwrench record --out` "
        "made it",
        path_.string());
  }
}

/// SQLite notices missing pages only when it comes to them. Those in a log are not in the file yet.
void RecordingReader::check_size() {
  Database& database = cursors_->database;
  std::error_code error;
  if (std::filesystem::exists(path_.string() + "-wal", error)) return;
  const std::int64_t told =
      database.number("PRAGMA page_count") * database.number("PRAGMA page_size");
  const auto size = static_cast<std::int64_t>(std::filesystem::file_size(path_, error));
  if (!error && size < told) damaged(fmt::format("it is cut off: {} of {} bytes", size, told));
}

void RecordingReader::read_head() {
  Database& database = cursors_->database;
  std::map<std::string, std::string> texts;
  Statement meta(database, "SELECT key, CAST(value AS TEXT) FROM meta");
  for (int keys = 0; meta.step(); ++keys) {
    if (keys == kMaxKeys) damaged("its head does not end");
    texts.emplace(meta.text(0).substr(0, kMaxText), meta.text(1).substr(0, kMaxText));
  }
  const auto text = [&texts](const char* key) {
    auto found = texts.extract(key);
    return found ? std::move(found.mapped()) : std::string();
  };
  const auto number = [&text](const char* key) {
    const std::string value = text(key);
    std::int64_t read = 0;
    std::from_chars(value.data(), value.data() + value.size(), read);
    return read;
  };
  head_.created = text("created");
  head_.software = text("software");
  head_.source = text("source");
  head_.closed = number("closed") == 1;
  const std::int64_t width = number("width"), height = number("height");
  const std::int64_t period = number("period_ns");
  const std::string keep = text("keep");
  head_.more.assign(texts.begin(), texts.end());
  if (width < 1 || width > kMax_px || height < 1 || height > kMax_px)
    damaged(fmt::format("its frames have the size {}x{}", width, height));
  if (period < 1 || period > 1'000'000'000'000) damaged(fmt::format("period_ns is {}", period));
  const auto kept = of_name<Keep>(kKeepNames, keep);
  if (!kept) damaged(fmt::format("keep is '{}'", keep.substr(0, 40)));
  head_.width = static_cast<int>(width);
  head_.height = static_cast<int>(height);
  head_.period = Duration(period);
  head_.keep = *kept;

  Statement files(database, "SELECT role, name, content FROM files");
  for (int roles = 0; files.step(); ++roles) {
    if (roles == kMaxKeys) damaged("its files do not end");
    const std::string role(files.text(0));
    const auto bytes = files.blob(2);
    std::string content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (role == "sensor.yaml") {
      head_.sensor_name = std::string(files.text(1).substr(0, kMaxText));
      head_.sensor_yaml = std::move(content);
    } else if (role == "appearance") {
      head_.appearance = std::move(content);
    } else if (role == "calibration") {
      head_.calibration = std::move(content);
    } else if (role.starts_with(kMeasuredRole)) {
      head_.measured.emplace_back(role.substr(std::string_view(kMeasuredRole).size()),
                                  std::move(content));
    }
  }
}

void RecordingReader::check_times() {
  Statement rows(cursors_->database, "SELECT id, t_ns FROM frames ORDER BY id");
  while (rows.step()) {
    const TimePoint time = time_point(rows.integer(1));
    if (!times_.empty() && time <= times_.back()) {
      throw DamagedFile(
          "{}: is damaged: time runs backwards: frame {} has t_ns {}, and the one before it {}; "
          "take a copy that is whole",
          path_.string(), rows.integer(0), time.time_since_epoch().count(),
          times_.back().time_since_epoch().count());
    }
    times_.push_back(time);
  }
}

/// SQLite notices a page that is wrong only when it comes to it, which may be in the middle of what
/// is made of the recording.
void RecordingReader::check_pages() {
  std::string found;
  try {
    Statement check(cursors_->database, "PRAGMA quick_check(1)");
    if (check.step() && check.text(0) == "ok") return;
    found = "its pages do not fit together";
  } catch (const DatabaseError& e) {
    found = e.what();
  }
  throw DamagedFile(
      "{}: is damaged: {}; {}; take a copy that is whole, or `tagwrench export --despite-damage` "
      "for "
      "what there is",
      path_.string(), found, readable_part());
}

/// "312 of 3000 frames, 12.4 of 120 s, can be read".
std::string RecordingReader::readable_part() const {
  std::size_t frames = 0;
  try {
    RecordingReader again(path_, IfDamaged::take);
    for (Entry entry; again.next(entry);)
      if (entry.kind == Entry::Kind::frame) ++frames;
  } catch (const ConfigError&) {  // as far as it goes
  }
  const auto seconds = [this](std::size_t count) {
    const TimePoint first = times_.empty() ? TimePoint{} : times_.front();
    const TimePoint last = count == 0 ? first : times_[std::min(count, times_.size()) - 1];
    return std::chrono::duration<double>(last - first).count();
  };
  return fmt::format("{} of {} frames, {:.4g} of {:.4g} s, can be read", frames, times_.size(),
                     seconds(frames), seconds(times_.size()));
}

template <class Read>
auto RecordingReader::whole(Read read) const try {
  return read(*cursors_);
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(Entry& entry) {
  return whole([&](Cursors& c) {
    // The rows that were handed out are left only now: their bytes were still in use.
    if (!c.frame_waits) c.frame_waits = c.frames.step(c.database);
    if (!c.trouble_waits) c.trouble_waits = c.troubles.step(c.database);
    if (!c.frame_waits && !c.trouble_waits) return false;
    if (c.frame_waits &&
        (!c.trouble_waits || c.frames.row().integer(0) <= c.troubles.row().integer(0))) {
      c.frame_waits = false;
      read(c.frames.row(), head_, entry);
    } else {
      c.trouble_waits = false;
      read_trouble(c.troubles.row(), entry);
    }
    return true;
  });
}

bool RecordingReader::next(TrackRecord& track) {
  return whole([&](Cursors& c) { return c.tracks.next(c.database, track); });
}

bool RecordingReader::next(Sample& sample) {
  return whole([&](Cursors& c) { return c.samples.next(c.database, sample); });
}

bool RecordingReader::next(ReferenceRecord& reading) {
  return whole([&](Cursors& c) { return c.references.next(c.database, reading); });
}

bool RecordingReader::next(EventRecord& event) {
  return whole([&](Cursors& c) { return c.events.next(c.database, event); });
}

std::vector<Mark> RecordingReader::marks() const {
  return whole([&](Cursors& c) {
    std::vector<Mark> marks;
    for (Walk walk(kMarks); walk.step(c.database);) add_mark(walk.row(), marks);
    return marks;
  });
}

}  // namespace tagwrench::record

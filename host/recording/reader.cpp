#include "host/recording/reader.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "host/core/config_error.h"
#include "host/recording/database.h"
#include "host/recording/schema.h"

namespace tagwrench::record {
namespace {

constexpr int kMaxKeys = 1000;

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

/// Takes out the latest beginning and end of a step that no longer counts.
void withdraw(const Mark& lost, std::vector<Mark>& marks) {
  for (const bool begin : {false, true}) {
    const auto last = std::find_if(marks.rbegin(), marks.rend(), [&](const Mark& mark) {
      return mark.step == lost.step && mark.begin == begin;
    });
    if (last != marks.rend()) marks.erase(std::next(last).base());
  }
}

}  // namespace

namespace {

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

 private:
  const char* sql_;
  std::optional<Statement> rows_;
  std::optional<std::int64_t> last_;
  bool ended_ = false;
};

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

RecordingReader::RecordingReader(const std::filesystem::path& path) : path_(path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    throw ConfigError(fmt::format("{}: no such file; give one that `tagwrench record --out` made",
                                  path.string()));
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    throw ConfigError(fmt::format("{}: is not a file; give one that `tagwrench record --out` made",
                                  path.string()));
  }
  try {
    open();
    check_size();
    read_head();
    check_times();
  } catch (const DatabaseError& e) {
    if (e.code() == SQLITE_NOTADB) {
      throw ConfigError(fmt::format(
          "{}: is not a recording; give a file that `tagwrench record --out` made", path.string()));
    }
    if ((e.code() & 0xff) == SQLITE_CANTOPEN || (e.code() & 0xff) == SQLITE_READONLY) {
      throw ConfigError(fmt::format(
          "{}: cannot be opened: {}; if {}-wal is beside it, copy both to a folder of yours",
          path.string(), e.what(), path.filename().string()));
    }
    damaged(e.what());
  }
}

RecordingReader::~RecordingReader() = default;

std::string_view RecordingReader::unclosed() const noexcept {
  return head_.closed ? "" : "was not closed: its last seconds may be missing";
}

void RecordingReader::damaged(const std::string& what) const {
  throw ConfigError(fmt::format(
      "{0}: is damaged: {1}; take a copy that is whole, or `sqlite3 {0} .recover` for what is left",
      path_.string(), what));
}

void RecordingReader::open() {
  close_left_open(path_);
  cursors_ = std::make_unique<Cursors>(path_);
  Database& database = cursors_->database;
  if (database.number("PRAGMA application_id") != kApplicationId) {
    throw ConfigError(fmt::format(
        "{}: is not a recording; give a file that `tagwrench record --out` made", path_.string()));
  }
  const std::int64_t version = database.number("PRAGMA user_version");
  if (version != kSchemaVersion) {
    throw ConfigError(fmt::format(
        "{}: is a recording of format {}, and this version reads format {}; use the tagwrench that "
        "made it",
        path_.string(), version, kSchemaVersion));
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
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::int64_t period = 0;
  std::string keep;
  Statement meta(database, "SELECT key, CAST(value AS TEXT) FROM meta");
  for (int keys = 0; meta.step(); ++keys) {
    if (keys == kMaxKeys) damaged("its head does not end");
    const std::string key(meta.text(0).substr(0, kMaxText));
    const std::string value(meta.text(1).substr(0, kMaxText));
    std::int64_t number = 0;
    std::from_chars(value.data(), value.data() + value.size(), number);
    if (key == "created")
      head_.created = value;
    else if (key == "software")
      head_.software = value;
    else if (key == "source")
      head_.source = value;
    else if (key == "width")
      width = number;
    else if (key == "height")
      height = number;
    else if (key == "period_ns")
      period = number;
    else if (key == "keep")
      keep = value;
    else if (key == "closed")
      head_.closed = number == 1;
    else
      head_.more.emplace_back(key, value);
  }
  if (width < 1 || width > kMax_px || height < 1 || height > kMax_px)
    damaged(fmt::format("its frames have the size {}x{}", width, height));
  if (period < 1 || period > 1'000'000'000'000) damaged(fmt::format("period_ns is {}", period));
  if (!keep_of(keep)) damaged(fmt::format("keep is '{}'", keep.substr(0, 40)));
  head_.width = static_cast<int>(width);
  head_.height = static_cast<int>(height);
  head_.period = Duration(period);
  head_.keep = *keep_of(keep);

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
      throw ConfigError(
          fmt::format("{}: is damaged: time runs backwards: frame {} has t_ns {}, and the one "
                      "before it {}; take a "
                      "copy that is whole",
                      path_.string(), rows.integer(0), time.time_since_epoch().count(),
                      times_.back().time_since_epoch().count()));
    }
    times_.push_back(time);
  }
}

bool RecordingReader::next(Entry& entry) try {
  Cursors& c = *cursors_;
  // The rows that were handed out are left only now: their bytes were still in use.
  if (!c.frame_waits) c.frame_waits = c.frames.step(c.database);
  if (!c.trouble_waits) c.trouble_waits = c.troubles.step(c.database);
  if (!c.frame_waits && !c.trouble_waits) return false;
  if (c.frame_waits &&
      (!c.trouble_waits || c.frames.row().integer(0) <= c.troubles.row().integer(0))) {
    c.frame_waits = false;
    entry = frame_entry(c.frames.row(), head_);
  } else {
    c.trouble_waits = false;
    entry = trouble_entry(c.troubles.row());
  }
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(TrackRecord& track) try {
  if (!cursors_->tracks.step(cursors_->database)) return false;
  track = track_record(cursors_->tracks.row());
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(Sample& sample) try {
  if (!cursors_->samples.step(cursors_->database)) return false;
  sample = sample_record(cursors_->samples.row());
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(ReferenceRecord& reading) try {
  if (!cursors_->references.step(cursors_->database)) return false;
  reading = reference_record(cursors_->references.row());
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(EventRecord& event) try {
  if (!cursors_->events.step(cursors_->database)) return false;
  event = event_record(cursors_->events.row());
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

std::vector<Mark> RecordingReader::marks() const try {
  std::vector<Mark> marks;
  Walk walk(kMarks);
  while (walk.step(cursors_->database)) {
    const MarkRecord record = mark_record(walk.row());
    if (record.withdrawn)
      withdraw(record.mark, marks);
    else
      marks.push_back(record.mark);
  }
  return marks;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

}  // namespace tagwrench::record

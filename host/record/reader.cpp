#include "host/record/reader.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <system_error>

#include "host/config_error.h"
#include "host/record/database.h"
#include "host/record/schema.h"

namespace tagwrench::record {
namespace {

static_assert(std::endian::native == std::endian::little, "blobs are copied as they are");

constexpr int kLargest_px = 16384;
constexpr std::size_t kLongestText = 1 << 20;

/// ns, so that a damaged file's times can be subtracted and added; 95 years.
constexpr std::int64_t kLongest_ns = 3'000'000'000'000'000'000;

Duration duration(std::int64_t ns) { return Duration(std::clamp(ns, -kLongest_ns, kLongest_ns)); }

TimePoint time_point(std::int64_t ns) { return TimePoint(duration(ns)); }

std::optional<Status> status_of(std::string_view text) {
  for (const Status s :
       {Status::ok, Status::acquiring, Status::lost, Status::doubtful, Status::saturated}) {
    if (text == name(s)) return s;
  }
  return std::nullopt;
}

std::optional<EventKind> kind_of(std::string_view text) {
  for (int k = 0; k <= static_cast<int>(EventKind::lost); ++k) {
    if (text == name(static_cast<EventKind>(k))) return static_cast<EventKind>(k);
  }
  return std::nullopt;
}

std::optional<Keep> keep_of(std::string_view text) {
  for (const Keep keep : {Keep::raw, Keep::region, Keep::none}) {
    if (text == name(keep)) return keep;
  }
  return std::nullopt;
}

Vector6 vector6(const Statement& row, int at) {
  Vector6 v;
  for (int i = 0; i < 6; ++i) v[i] = row.real(at + i);
  return v;
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

std::vector<double> doubles(std::span<const std::uint8_t> blob) {
  std::vector<double> numbers(blob.size() / sizeof(double));
  if (!numbers.empty()) std::memcpy(numbers.data(), blob.data(), numbers.size() * sizeof(double));
  return numbers;
}

void read_covariance(const std::vector<double>& numbers, Matrix6& covariance) {
  if (numbers.size() != 21) return;
  std::size_t n = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      covariance(row, column) = covariance(column, row) = numbers[n++];
  }
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

constexpr const char* kFrames =
    "SELECT f.id, f.seq, f.t_ns, f.dropped, f.fourcc, f.stride,"
    " f.first_x, f.first_y, f.first_width, f.first_height,"
    " f.all_x, f.all_y, f.all_width, f.all_height,"
    " s.output_ns - s.origin_ns, s.touched, f.bytes"
    " FROM frames f LEFT JOIN samples s ON s.id = f.id ORDER BY f.id";
constexpr const char* kTroubles =
    "SELECT e.id, e.kind, e.t_ns, e.text, s.output_ns - s.origin_ns"
    " FROM events e LEFT JOIN samples s ON s.id = e.id"
    " WHERE e.kind IN ('missing', 'disconnected', 'reconnected') ORDER BY e.id";
constexpr const char* kTracks =
    "SELECT t.id, f.t_ns, t.status, t.hint, t.x, t.y, t.z, t.rx, t.ry, t.rz, t.covariance,"
    " t.residual_px, t.residual_part, t.blur_px2, t.tags_held, t.corners"
    " FROM tracks t JOIN frames f ON f.id = t.id ORDER BY t.id";
constexpr const char* kSamples = "SELECT * FROM samples ORDER BY id";
constexpr const char* kReferences = "SELECT * FROM reference ORDER BY id";
constexpr const char* kEvents = "SELECT id, t_ns, kind, step, value, text FROM events ORDER BY id";

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

struct RecordingReader::Cursors {
  explicit Cursors(const std::filesystem::path& path) : database(path, Database::Mode::read) {}

  Statement& cursor(std::optional<Statement>& which, const char* sql) {
    if (!which) which.emplace(database, sql);
    return *which;
  }

  Database database;
  std::optional<Statement> frames;
  std::optional<Statement> troubles;
  std::optional<Statement> tracks;
  std::optional<Statement> samples;
  std::optional<Statement> references;
  std::optional<Statement> events;
  bool frame_waits = false;    ///< `frames` stands on a row that was not handed out
  bool trouble_waits = false;  ///< likewise `troubles`
  bool frames_ended = false;
  bool troubles_ended = false;
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
  while (meta.step()) {
    const std::string key(meta.text(0).substr(0, kLongestText));
    const std::string value(meta.text(1).substr(0, kLongestText));
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
  if (width < 1 || width > kLargest_px || height < 1 || height > kLargest_px)
    damaged(fmt::format("its frames have the size {}x{}", width, height));
  if (period < 1 || period > 1'000'000'000'000) damaged(fmt::format("period_ns is {}", period));
  if (!keep_of(keep)) damaged(fmt::format("keep is '{}'", keep.substr(0, 40)));
  head_.width = static_cast<int>(width);
  head_.height = static_cast<int>(height);
  head_.period = Duration(period);
  head_.keep = *keep_of(keep);

  Statement files(database, "SELECT role, name, content FROM files");
  while (files.step()) {
    const std::string role(files.text(0));
    const auto bytes = files.blob(2);
    std::string content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (role == "sensor.yaml") {
      head_.sensor_name = std::string(files.text(1).substr(0, kLongestText));
      head_.sensor_yaml = std::move(content);
    } else if (role == "appearance") {
      head_.appearance = std::move(content);
    } else if (role == "calibration") {
      head_.calibration = std::move(content);
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
  Statement& frames = c.cursor(c.frames, kFrames);
  Statement& troubles = c.cursor(c.troubles, kTroubles);
  // The rows that were handed out are left only now: their bytes were still in use.
  if (!c.frame_waits && !c.frames_ended) {
    c.frame_waits = frames.step();
    c.frames_ended = !c.frame_waits;
  }
  if (!c.trouble_waits && !c.troubles_ended) {
    c.trouble_waits = troubles.step();
    c.troubles_ended = !c.trouble_waits;
  }
  if (!c.frame_waits && !c.trouble_waits) return false;
  entry = {};
  if (c.frame_waits && (!c.trouble_waits || frames.integer(0) <= troubles.integer(0))) {
    c.frame_waits = false;
    entry.id = frames.integer(0);
    entry.sequence = static_cast<std::uint64_t>(frames.integer(1));
    entry.time = time_point(frames.integer(2));
    entry.dropped = static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(frames.integer(3), 0, std::numeric_limits<std::uint32_t>::max()));
    const std::string_view code = frames.text(4);
    for (std::size_t i = std::min<std::size_t>(code.size(), 4); i-- > 0;)
      entry.raw.fourcc = entry.raw.fourcc << 8 | static_cast<std::uint8_t>(code[i]);
    const std::int64_t stride = frames.integer(5);
    entry.raw.stride = stride < 0 || stride > 8 * kLargest_px ? 0 : static_cast<int>(stride);
    entry.first = region(frames, 6, head_.width, head_.height);
    entry.all = region(frames, 10, head_.width, head_.height);
    if (!frames.is_null(14)) entry.latency = duration(frames.integer(14));
    entry.touched = frames.integer(15) != 0;
    entry.raw.bytes = frames.blob(16);
    entry.crop = code == "CROP";
    const auto area =
        static_cast<std::size_t>(entry.all.width) * static_cast<std::size_t>(entry.all.height);
    if (entry.crop && (entry.first.empty() || !entry.all.contains(entry.first) ||
                       entry.raw.bytes.size() != area)) {
      entry.raw.bytes = {};
    }
    return true;
  }
  c.trouble_waits = false;
  entry.id = troubles.integer(0);
  const auto kind = kind_of(troubles.text(1));
  entry.kind = kind == EventKind::missing        ? Entry::Kind::missing
               : kind == EventKind::disconnected ? Entry::Kind::disconnected
                                                 : Entry::Kind::reconnected;
  entry.time = time_point(troubles.integer(2));
  entry.text = std::string(troubles.text(3).substr(0, kLongestText));
  if (!troubles.is_null(4)) entry.latency = duration(troubles.integer(4));
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(TrackRecord& record) try {
  Statement& row = cursors_->cursor(cursors_->tracks, kTracks);
  if (!row.step()) return false;
  record = {};
  record.id = row.integer(0);
  record.time = time_point(row.integer(1));
  const auto status = status_of(row.text(2));
  if (!status) damaged(fmt::format("track {} has an unknown status", record.id));
  Track& track = record.track;
  track.status = *status;
  const std::int64_t hint = row.integer(3);
  if (hint >= 0 && hint <= static_cast<std::int64_t>(Hint::rest_elsewhere))
    track.hint = static_cast<Hint>(hint);
  track.displacement = vector6(row, 4);
  read_covariance(doubles(row.blob(10)), track.covariance);
  track.residual_px = row.real(11);
  track.residual_part = row.real(12);
  track.blur_px2 = row.real(13);
  track.tags_held = static_cast<std::uint8_t>(std::clamp<std::int64_t>(row.integer(14), 0, 255));
  read_corners(doubles(row.blob(15)), track);
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(Sample& sample) try {
  Statement& row = cursors_->cursor(cursors_->samples, kSamples);
  if (!row.step()) return false;
  sample = {};
  sample.sequence = static_cast<std::uint64_t>(row.integer(1));
  sample.capture_time = time_point(row.integer(2));
  sample.latency_origin = time_point(row.integer(3));
  sample.output_time = time_point(row.integer(4));
  sample.dropped = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(row.integer(5), 0, std::numeric_limits<std::uint32_t>::max()));
  const auto status = status_of(row.text(6));
  if (!status) damaged(fmt::format("sample {} has an unknown status", row.integer(0)));
  sample.status = *status;
  sample.displacement = vector6(row, 7);
  sample.displacement_sigma = vector6(row, 13);
  sample.wrench = vector6(row, 19);
  sample.wrench_sigma = vector6(row, 25);
  sample.zero = vector6(row, 31);
  sample.motion = vector6(row, 37);
  sample.zero_state = static_cast<ZeroState>(
      std::clamp<std::int64_t>(row.integer(43), 0, static_cast<int>(ZeroState::following)));
  sample.touched = row.integer(44) != 0;
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(ReferenceRecord& reading) try {
  Statement& row = cursors_->cursor(cursors_->references, kReferences);
  if (!row.step()) return false;
  reading = {};
  reading.id = row.integer(0);
  reading.time = time_point(row.integer(1));
  reading.time_sigma = duration(row.integer(2));
  reading.channel = static_cast<int>(std::clamp<std::int64_t>(row.integer(3), 0, 255));
  reading.axes = row.integer(4) == 6 ? 6 : 1;
  reading.saturated = row.integer(5) != 0;
  reading.lost_before = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(row.integer(6), 0, std::numeric_limits<std::uint32_t>::max()));
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    reading.counts[at] = row.real(7 + i);
    reading.value[at] = row.real(13 + i);
    reading.sigma[at] = row.real(19 + i);
  }
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

bool RecordingReader::next(EventRecord& event) try {
  Statement& row = cursors_->cursor(cursors_->events, kEvents);
  if (!row.step()) return false;
  event = {};
  event.id = row.integer(0);
  event.time = time_point(row.integer(1));
  const auto kind = kind_of(row.text(2));
  if (!kind) damaged(fmt::format("event {} is of an unknown kind", event.id));
  event.kind = *kind;
  event.step = static_cast<int>(std::clamp<std::int64_t>(row.integer(3), -1, 1'000'000));
  event.value = row.integer(4);
  event.text = std::string(row.text(5).substr(0, kLongestText));
  return true;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

std::vector<Mark> RecordingReader::marks() const try {
  std::vector<Mark> marks;
  Statement row(cursors_->database,
                "SELECT t_ns, step, value, id FROM events WHERE kind = 'mark' ORDER BY id");
  while (row.step()) {
    const std::int64_t step = row.integer(1);
    if (step < 0 || step > 1'000'000) damaged(fmt::format("a mark is of step {}", step));
    const std::int64_t value = row.integer(2);
    if (value < kMarkWithdrawn || value > 1'000'000)
      damaged(fmt::format("a mark has the value {}", value));
    const Mark mark{static_cast<int>(step), value >= kMarkBegins, time_point(row.integer(0)),
                    row.integer(3),
                    static_cast<int>(std::max<std::int64_t>(value - kMarkBegins, 0))};
    if (value == kMarkWithdrawn)
      withdraw(mark, marks);
    else
      marks.push_back(mark);
  }
  return marks;
} catch (const DatabaseError& e) {
  damaged(e.what());
}

}  // namespace tagwrench::record

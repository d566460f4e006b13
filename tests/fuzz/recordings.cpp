// Recordings: any rows in any tables, and any bytes of the file overwritten, through the reader. It
// may refuse them, in one line; what it gives holds.
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "host/core/config_error.h"
#include "host/recording/database.h"
#include "host/recording/reader.h"
#include "host/recording/schema.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/recording_rows.h"

namespace {

using namespace tagwrench;
using namespace tagwrench::record;
namespace fs = std::filesystem;

constexpr int kWidth = 8;
constexpr int kHeight = 6;

/// A file of this process, in memory where that is possible; gone in the end with all beside it.
class Place {
 public:
  Place()
      : path_((::access("/dev/shm", W_OK) == 0 ? fs::path("/dev/shm") : fs::temp_directory_path()) /
              ("tagwrench-fuzz-" + std::to_string(::getpid()))) {}
  ~Place() {
    std::error_code ignored;
    for (const char* part : {"", "-wal", "-shm", "-journal"})
      fs::remove(path_.string() + part, ignored);
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A recording without rows but its head; pages as small as can be, so that trees have branches.
std::string empty_recording() {
  const Place place;
  write(place.path(), "");
  {
    Database database(place.path(), Database::Mode::write);
    database.run("PRAGMA page_size = 512");
    database.run("PRAGMA journal_mode = MEMORY");
    database.run(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
    database.run(("PRAGMA user_version = " + std::to_string(kSchemaVersion)).c_str());
    database.run(kSchema);
    database.run(("INSERT INTO meta VALUES ('width', " + std::to_string(kWidth) + "), ('height', " +
                  std::to_string(kHeight) +
                  "), ('period_ns', 40000000), ('keep', 'raw'), ('closed', 1)")
                     .c_str());
  }
  return read(place.path());
}

/// The fuzzer's bytes; zeros after the last.
class Bytes {
 public:
  Bytes(const std::uint8_t* bytes, std::size_t count) : left_(bytes, count) {}
  bool empty() const { return left_.empty(); }
  std::uint8_t byte() {
    if (left_.empty()) return 0;
    const std::uint8_t first = left_[0];
    left_ = left_.subspan(1);
    return first;
  }
  template <class Number>
  Number number() {
    std::uint8_t bytes[sizeof(Number)];
    for (std::uint8_t& one : bytes) one = byte();
    Number value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }
  std::span<const std::uint8_t> some() {
    const std::size_t count = std::min<std::size_t>(byte(), left_.size());
    const auto first = left_.first(count);
    left_ = left_.subspan(count);
    return first;
  }

 private:
  std::span<const std::uint8_t> left_;
};

using Value = std::variant<std::monostate, std::int64_t, double, std::string,
                           std::vector<std::uint8_t>>;  ///< as SQLite has them

struct Row {
  std::size_t table = 0;
  std::vector<Value> values;
};

Value value(Bytes& bytes, std::int64_t& last) {
  using Given = fuzz::Value;
  switch (static_cast<Given>(bytes.byte() % fuzz::kValues)) {
    case Given::null: break;
    case Given::next: return ++last;
    case Given::same: return last;
    case Given::small: return std::int64_t{static_cast<std::int8_t>(bytes.byte())};
    case Given::whole: return bytes.number<std::int64_t>();
    case Given::real: return bytes.number<double>();
    case Given::word: return std::string(fuzz::kWords[bytes.byte() % fuzz::kWords.size()]);
    case Given::text: {
      const auto text = bytes.some();
      return std::string(text.begin(), text.end());
    }
    case Given::blob: {
      const auto blob = bytes.some();
      return std::vector<std::uint8_t>(blob.begin(), blob.end());
    }
    case Given::reals: {
      const std::vector<double> reals(bytes.byte(), bytes.number<double>());
      std::vector<std::uint8_t> blob(reals.size() * sizeof(double));
      if (!blob.empty()) std::memcpy(blob.data(), reals.data(), blob.size());
      return blob;
    }
    case Given::edge: return fuzz::kEdges[bytes.byte() % fuzz::kEdges.size()];
  }
  return std::monostate{};
}

struct Overwritten {
  std::uint32_t place;
  std::uint8_t value;
};

/// What the fuzzer's bytes ask for.
struct Asked {
  explicit Asked(Bytes bytes) {
    std::int64_t last = 0;
    while (!bytes.empty()) {
      const std::size_t step = bytes.byte() % fuzz::kSteps;
      if (step == fuzz::kDamage) {
        const auto place = bytes.number<std::uint32_t>();
        overwritten.push_back({place, bytes.byte()});
      } else if (step == fuzz::kChange) {
        const std::size_t back = bytes.byte();
        const std::size_t column = bytes.byte();
        Value changed = value(bytes, last);
        if (rows.empty()) continue;
        std::vector<Value>& values = rows[rows.size() - 1 - back % rows.size()].values;
        values[column % values.size()] = std::move(changed);
      } else {
        Row& row = rows.emplace_back(Row{step, {}});
        for (int i = 0; i < fuzz::kColumns[step]; ++i) row.values.push_back(value(bytes, last));
      }
    }
  }

  std::vector<Row> rows;
  std::vector<Overwritten> overwritten;
};

void bind(Statement& statement, int at, const Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return statement.bind(at, *whole);
  if (const auto* real = std::get_if<double>(&value)) return statement.bind(at, *real);
  if (const auto* text = std::get_if<std::string>(&value))
    return statement.bind(at, std::string_view(*text));
  if (const auto* blob = std::get_if<std::vector<std::uint8_t>>(&value))
    return statement.bind(at, std::span<const std::uint8_t>(*blob));
  statement.bind_null(at);
}

void add_rows(const fs::path& path, const std::vector<Row>& rows) {
  Database database(path, Database::Mode::write);
  database.run("PRAGMA synchronous = OFF");
  database.run("PRAGMA journal_mode = MEMORY");
  database.run("BEGIN");
  for (const Row& row : rows) {
    std::string sql =
        std::string("INSERT OR REPLACE INTO ") + fuzz::kTables[row.table] + " VALUES (?";
    for (std::size_t i = 1; i < row.values.size(); ++i) sql += ",?";
    Statement statement(database, sql + ")");
    for (std::size_t i = 0; i < row.values.size(); ++i)
      bind(statement, static_cast<int>(i) + 1, row.values[i]);
    try {
      statement.execute();
    } catch (const DatabaseError&) {
      // SQLite does not take it, as a text for an id.
    }
  }
  database.run("COMMIT");
}

void check(const Entry& entry) {
  expect(entry.raw.stride >= 0, "a stride is not negative");
  if (!entry.crop || entry.raw.bytes.empty()) return;
  expect(entry.all.contains(entry.first), "what was decoded first is part of the rest");
  expect(entry.raw.bytes.size() ==
             static_cast<std::size_t>(entry.all.width) * static_cast<std::size_t>(entry.all.height),
         "a cropped part has as many bytes as pixels");
}

void check(const Sample& sample) {
  expect(std::strcmp(name(sample.status), "?") != 0, "a sample has a status");
  // Neither overflows.
  static_cast<void>(sample.output_time - sample.latency_origin);
  static_cast<void>(sample.capture_time + (sample.output_time - sample.latency_origin));
}

/// Walks through all there is.
void walk(const fs::path& path) {
  RecordingReader reader(path);
  const Head& head = reader.head();
  expect(head.width > 0 && head.height > 0 && head.period > Duration(0), "a head has sizes");
  const auto& times = reader.frame_times();
  for (std::size_t i = 1; i < times.size(); ++i) expect(times[i] > times[i - 1], "times grow");
  std::size_t frames = 0;
  for (Entry entry; reader.next(entry);) {
    frames += entry.kind == Entry::Kind::frame ? 1 : 0;
    check(entry);
  }
  expect(frames == times.size(), "each frame has its time");
  for (TrackRecord r; reader.next(r);)
    expect(r.track.corner_count <= r.track.corners.size(), "corners that there are");
  for (Sample sample; reader.next(sample);) check(sample);
  for (ReferenceRecord r; reader.next(r);)
    expect((r.axes == 1 || r.axes == 6) && r.channel >= 0, "a reading is of one axis or six");
  for (EventRecord event; reader.next(event);) expect(name(event.kind) != "?", "a kind");
  std::int64_t before = std::numeric_limits<std::int64_t>::min();
  for (const Mark& mark : reader.marks()) {
    expect(mark.step >= 0 && mark.zero >= 0, "a step counts from 0");
    expect(std::exchange(before, mark.id) < mark.id, "marks are in order");
  }
  Entry entry;
  expect(!reader.next(entry), "the end stays the end");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  static const std::string empty = empty_recording();
  const Place place;
  write(place.path(), empty);
  const Asked asked(Bytes(bytes, count));
  add_rows(place.path(), asked.rows);
  if (!asked.overwritten.empty()) {
    std::string file = read(place.path());
    for (const Overwritten& one : asked.overwritten)
      file[one.place % file.size()] = static_cast<char>(one.value);
    write(place.path(), file);
  }
  try {
    walk(place.path());
  } catch (const ConfigError& e) {
    expect(std::strchr(e.what(), '\n') == nullptr, "a refusal is one line");
  }
  return 0;
}

// A file that is damaged, in whatever way, is refused or read as far as it goes: nothing crashes,
// and no number is believed.
#include <fstream>
#include <iterator>
#include <random>

#include "host/recording/database.h"
#include "host/source/replay.h"
#include "tests/unit/recording/recorded.h"

namespace tagwrench::record::test {
namespace {

class Damage : public Folder {
 protected:
  std::string bytes_of(const std::filesystem::path& file) const {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& bytes) const {
    std::ofstream(path("copy"), std::ios::binary) << bytes;
  }
  /// Everything that can be read, and every frame decoded and completed. False: refused.
  bool read_all() const {
    try {
      RecordingReader reader(path("copy"));
      for (TrackRecord r; reader.next(r);) EXPECT_LE(r.track.corner_count, 8);
      for (Sample s; reader.next(s);) EXPECT_STRNE(name(s.status), "?");
      for (ReferenceRecord r; reader.next(r);) EXPECT_TRUE(r.axes == 1 || r.axes == 6);
      for (EventRecord e; reader.next(e);) EXPECT_NE(name(e.kind), "?");
      reader.marks();
      RecordingSource source(std::make_unique<RecordingReader>(path("copy")), true);
      Frame frame;
      for (ReadStatus s; (s = source.read(frame)) != ReadStatus::end;) {
        if (s != ReadStatus::frame) continue;
        source.want({4, 4, 8, 8});
        source.complete(frame);
        const Region part = frame.readable();
        EXPECT_TRUE((Region{0, 0, frame.image.width, frame.image.height}).contains(part));
        // What is called readable is: the address sanitizer sees to it.
        unsigned sum = 0;
        for (int y = part.y; y < part.y + part.height; ++y) {
          for (int x = part.x; x < part.x + part.width; ++x)
            sum += frame.image.pixels[y * frame.image.stride + x];
        }
        sum_ += sum;
      }
      return true;
    } catch (const ConfigError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
      return false;
    }
  }
  mutable unsigned sum_ = 0;
};

TEST_F(Damage, FlippedBytesNeverCrash) {
  for (const Keep keep : {Keep::raw, Keep::region}) {
    const auto whole = path(std::string(name(keep)));
    write_recording(whole, 8, keep);
    const std::string good = bytes_of(whole);
    std::minstd_rand random(keep == Keep::raw ? 1 : 2);
    int refused = 0;
    for (int copy = 0; copy < 250; ++copy) {
      std::string bytes = good;
      for (int flips = 1 + copy % 20; flips > 0; --flips)
        bytes[random() % bytes.size()] = static_cast<char>(random());
      write(bytes);
      if (!read_all()) ++refused;
    }
    EXPECT_GT(refused, 10) << "some of these hit what matters";
    EXPECT_LT(refused, 245) << "and some do not";
  }
}

TEST_F(Damage, ATruncatedFileIsRefused) {
  write_recording(path(), 60);
  const std::string good = bytes_of(path());
  for (std::size_t part = 0; part < 20; ++part) {
    write(good.substr(0, good.size() * part / 20));
    EXPECT_FALSE(read_all()) << part << " twentieths";
  }
}

/// SQL that makes a recording lie, and whether a frame is still delivered.
TEST_F(Damage, NumbersThatCannotBeAreNotBelieved) {
  const std::vector<std::pair<const char*, bool>> lies = {
      {"UPDATE frames SET stride = 1000000", true},  // not believed: packed rows
      {"UPDATE frames SET stride = 4000", false},    // more than the bytes there are
      {"UPDATE frames SET stride = -5", true},
      {"UPDATE frames SET fourcc = 'MJPG'", false},
      {"UPDATE frames SET fourcc = 'PNG '", false},
      {"UPDATE frames SET fourcc = 'NOPE'", false},
      {"UPDATE frames SET fourcc = NULL", false},
      {"UPDATE frames SET fourcc = 'CROP', all_width = 4000", false},
      {"UPDATE frames SET fourcc = 'CROP', first_x = -1", false},
      {"UPDATE frames SET fourcc = 'CROP', bytes = x'00'", false},
      {"UPDATE frames SET bytes = NULL", false},
      {"UPDATE frames SET bytes = 'text'", false},
      {"UPDATE frames SET seq = 'text', dropped = -1", true},
      // Times whose differences are beyond 64 bits.
      {"UPDATE frames SET t_ns = CASE id WHEN (SELECT min(id) FROM frames) THEN "
       "-9223372036854775807 ELSE 9223372036854775000 + id END WHERE id IN "
       "((SELECT min(id) FROM frames), (SELECT max(id) FROM frames))",
       true},
      {"UPDATE samples SET output_ns = 9223372036854775807, origin_ns = 0", true},
  };
  for (const auto& [sql, delivered] : lies) {
    std::filesystem::remove(path("copy"));
    write_recording(path("copy"), 3);
    Database(path("copy"), Database::Mode::write).run(sql);
    EXPECT_TRUE(read_all()) << sql;
    RecordingSource source(std::make_unique<RecordingReader>(path("copy")), true);
    Frame frame;
    EXPECT_EQ(source.read(frame), delivered ? ReadStatus::frame : ReadStatus::nothing) << sql;
  }
  const std::vector<const char*> refused = {
      // Expressions that would be evaluated, for ever if their author likes.
      "ALTER TABLE frames ADD COLUMN more INTEGER AS (instr(zeroblob(9), x'01'))",
      "CREATE INDEX slow ON frames (abs(seq))",
      "CREATE TABLE more (x CHECK (instr(zeroblob(9), x'01')))",
      "CREATE VIEW more AS SELECT 1",
      "UPDATE meta SET value = '99999999' WHERE key = 'width'",
      "UPDATE meta SET value = '-3' WHERE key = 'height'",
      "UPDATE meta SET value = '0' WHERE key = 'period_ns'",
      "UPDATE meta SET value = 'all' WHERE key = 'keep'",
      "DELETE FROM meta",
      "DROP TABLE frames",
      "ALTER TABLE frames RENAME COLUMN t_ns TO time",
      "UPDATE tracks SET status = 'fine'",
      "UPDATE events SET kind = 'party'",
      "UPDATE events SET step = -9 WHERE kind = 'mark'",
      // Rows twice, as where a page leads to one before it: a walk must end.
      "CREATE TABLE e AS SELECT * FROM events; INSERT INTO e SELECT * FROM e; DROP TABLE events; "
      "ALTER TABLE e RENAME TO events",
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 2000) INSERT INTO "
      "meta SELECT 'k' || i, i FROM n",
  };
  for (const char* sql : refused) {
    std::filesystem::remove(path("copy"));
    write_recording(path("copy"), 3);
    Database(path("copy"), Database::Mode::write).run(sql);
    EXPECT_FALSE(read_all()) << sql;
  }
}

}  // namespace
}  // namespace tagwrench::record::test

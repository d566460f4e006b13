// The language in which a fuzzer's bytes say what is in a recording: rows of its tables, value by
// value, and bytes of the file that are overwritten in the end.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

namespace tagwrench::fuzz {

enum class Table : std::uint8_t { frames, tracks, samples, reference, events, meta, files };
inline constexpr std::array<const char*, 7> kTables{"frames", "tracks", "samples", "reference",
                                                    "events", "meta",   "files"};
inline constexpr std::array<int, 7> kColumns{16, 15, 45, 25, 6, 2, 3};
/// In place of a table: a value of a row before is another; how far back, column, value.
inline constexpr std::uint8_t kChange = 7;
/// A byte of the file is overwritten in the end: place (4 bytes) and value.
inline constexpr std::uint8_t kDamage = 8;
inline constexpr std::uint8_t kSteps = 9;

/// How a value is given: a byte of this, and what follows.
enum class Value : std::uint8_t {
  null,
  next,   ///< one more than the last number that was given so
  same,   ///< that number again
  small,  ///< 1 byte, -128 to 127
  whole,  ///< 8 bytes
  real,   ///< 8 bytes
  word,   ///< 1 byte, one of kWords
  text,   ///< 1 byte of length, bytes
  blob,   ///< likewise
  reals,  ///< 1 byte of count, and one number of 8 bytes that is repeated in a blob
  edge,   ///< 1 byte, one of kEdges
};
inline constexpr std::uint8_t kValues = 11;
inline constexpr std::array<std::int64_t, 8> kEdges{std::numeric_limits<std::int64_t>::min(),
                                                    std::numeric_limits<std::int64_t>::max(),
                                                    std::int64_t{1} << 31,
                                                    std::int64_t{1} << 32,
                                                    -(std::int64_t{1} << 31) - 1,
                                                    1'000'001,
                                                    16'384 * 8 + 1,
                                                    -2};

enum class Word : std::uint8_t {
  ok,
  grey,
  crop,
  missing,
  disconnected,
  reconnected,
  note,
  mark,
  appearance
};
inline constexpr std::array<std::string_view, 24> kWords{
    "ok",        "GREY", "CROP",        "missing",     "disconnected", "reconnected",
    "note",      "mark", "appearance",  "acquiring",   "lost",         "doubtful",
    "saturated", "MJPG", "sensor.yaml", "calibration", "width",        "height",
    "period_ns", "keep", "region",      "none",        "closed",       "99999"};

/// Little-endian, as the file has it.
class RowWriter {
 public:
  RowWriter& row(Table table) { return byte(static_cast<std::uint8_t>(table)); }
  RowWriter& null() { return kind(Value::null); }
  RowWriter& next() { return kind(Value::next); }
  RowWriter& same() { return kind(Value::same); }
  RowWriter& small(int value) { return kind(Value::small).byte(static_cast<std::uint8_t>(value)); }
  RowWriter& real(double value) {
    return kind(Value::real).number(std::bit_cast<std::uint64_t>(value), 8);
  }
  RowWriter& words(Word word) { return kind(Value::word).byte(static_cast<std::uint8_t>(word)); }
  /// Of at most 255 bytes.
  RowWriter& blob(const std::vector<std::uint8_t>& blob) {
    kind(Value::blob).byte(static_cast<std::uint8_t>(blob.size()));
    bytes_.insert(bytes_.end(), blob.begin(), blob.end());
    return *this;
  }
  RowWriter& reals(std::uint8_t count, double value) {
    kind(Value::reals).byte(count);
    return number(std::bit_cast<std::uint64_t>(value), 8);
  }
  /// Of kEdges.
  RowWriter& edge(std::uint8_t which) { return kind(Value::edge).byte(which); }
  /// A value is to follow.
  RowWriter& change(std::uint8_t back, std::uint8_t column) {
    return byte(kChange).byte(back).byte(column);
  }
  RowWriter& damage(std::uint32_t place, std::uint8_t value) {
    return byte(kDamage).number(place, 4).byte(value);
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  RowWriter& kind(Value value) { return byte(static_cast<std::uint8_t>(value)); }
  RowWriter& byte(std::uint8_t value) {
    bytes_.push_back(value);
    return *this;
  }
  RowWriter& number(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) byte(static_cast<std::uint8_t>(value >> (8 * i)));
    return *this;
  }

  std::vector<std::uint8_t> bytes_;
};

}  // namespace tagwrench::fuzz

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "host/recording/reader.h"

namespace tagwrench::record {

const char* const kFrames =
    "SELECT f.id, f.seq, f.t_ns, f.dropped, f.fourcc, f.stride,"
    " f.first_x, f.first_y, f.first_width, f.first_height,"
    " f.all_x, f.all_y, f.all_width, f.all_height,"
    " s.output_ns - s.origin_ns, s.touched, f.bytes"
    " FROM frames f LEFT JOIN samples s ON s.id = f.id ORDER BY f.id";
const char* const kTroubles =
    "SELECT e.id, e.kind, e.t_ns, e.text, s.output_ns - s.origin_ns"
    " FROM events e LEFT JOIN samples s ON s.id = e.id"
    " WHERE e.kind IN ('missing', 'disconnected', 'reconnected') ORDER BY e.id";
const char* const kTracks =
    "SELECT t.id, f.t_ns, t.status, t.hint, t.x, t.y, t.z, t.rx, t.ry, t.rz, t.covariance,"
    " t.residual_px, t.residual_part, t.blur_px2, t.tags_held, t.corners"
    " FROM tracks t JOIN frames f ON f.id = t.id ORDER BY t.id";
const char* const kSamples = "SELECT * FROM samples ORDER BY id";
const char* const kReferences = "SELECT * FROM reference ORDER BY id";
const char* const kEvents = "SELECT id, t_ns, kind, step, value, text FROM events ORDER BY id";
const char* const kMarks =
    "SELECT id, t_ns, step, value FROM events WHERE kind = 'mark' ORDER BY id";

namespace {

static_assert(std::endian::native == std::endian::little, "blobs are copied as they are");

/// ns, so that a damaged file's times can be subtracted and added; 95 years.
constexpr std::int64_t kMax_ns = 3'000'000'000'000'000'000;

Duration duration(std::int64_t ns) { return Duration(std::clamp(ns, -kMax_ns, kMax_ns)); }

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

/// A number that counts something, of 32 bits.
std::uint32_t count(std::int64_t number) {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(number, 0, std::numeric_limits<std::uint32_t>::max()));
}

DatabaseError impossible(const std::string& what) { return {what, SQLITE_CORRUPT}; }

}  // namespace

TimePoint time_point(std::int64_t ns) { return TimePoint(duration(ns)); }

std::optional<Keep> keep_of(std::string_view text) {
  for (const Keep keep : {Keep::raw, Keep::region, Keep::none}) {
    if (text == name(keep)) return keep;
  }
  return std::nullopt;
}

Entry frame_entry(const Statement& row, const Head& head) {
  Entry entry;
  entry.id = row.integer(0);
  entry.sequence = static_cast<std::uint64_t>(row.integer(1));
  entry.time = time_point(row.integer(2));
  entry.dropped = count(row.integer(3));
  const std::string_view code = row.text(4);
  for (std::size_t i = std::min<std::size_t>(code.size(), 4); i-- > 0;)
    entry.raw.fourcc = entry.raw.fourcc << 8 | static_cast<std::uint8_t>(code[i]);
  entry.crop = code == "CROP";
  const std::int64_t stride = row.integer(5);
  entry.raw.stride = stride < 0 || stride > 8 * kMax_px ? 0 : static_cast<int>(stride);
  entry.first = region(row, 6, head.width, head.height);
  entry.all = region(row, 10, head.width, head.height);
  if (!row.is_null(14)) entry.latency = duration(row.integer(14));
  entry.touched = row.integer(15) != 0;
  entry.raw.bytes = row.blob(16);
  const auto area =
      static_cast<std::size_t>(entry.all.width) * static_cast<std::size_t>(entry.all.height);
  if (entry.crop &&
      (entry.first.empty() || !entry.all.contains(entry.first) || entry.raw.bytes.size() != area)) {
    entry.raw.bytes = {};
  }
  return entry;
}

Entry trouble_entry(const Statement& row) {
  Entry entry;
  entry.id = row.integer(0);
  const auto kind = kind_of(row.text(1));
  entry.kind = kind == EventKind::missing        ? Entry::Kind::missing
               : kind == EventKind::disconnected ? Entry::Kind::disconnected
                                                 : Entry::Kind::reconnected;
  entry.time = time_point(row.integer(2));
  entry.text = std::string(row.text(3).substr(0, kMaxText));
  if (!row.is_null(4)) entry.latency = duration(row.integer(4));
  return entry;
}

TrackRecord track_record(const Statement& row) {
  TrackRecord record;
  record.id = row.integer(0);
  record.time = time_point(row.integer(1));
  const auto status = status_of(row.text(2));
  if (!status) throw impossible(fmt::format("track {} has an unknown status", record.id));
  Track& track = record.track;
  track.status = *status;
  const std::int64_t diagnostic = row.integer(3);
  if (diagnostic >= 0 && diagnostic <= static_cast<std::int64_t>(Diagnostic::rest_elsewhere))
    track.diagnostic = static_cast<Diagnostic>(diagnostic);
  track.displacement = vector6(row, 4);
  read_covariance(doubles(row.blob(10)), track.covariance);
  track.residual_px = row.real(11);
  track.residual_fraction = row.real(12);
  track.blur_px2 = row.real(13);
  track.tags_held = static_cast<std::uint8_t>(std::clamp<std::int64_t>(row.integer(14), 0, 255));
  read_corners(doubles(row.blob(15)), track);
  return record;
}

Sample sample_record(const Statement& row) {
  Sample sample;
  sample.sequence = static_cast<std::uint64_t>(row.integer(1));
  sample.capture_time = time_point(row.integer(2));
  sample.latency_origin = time_point(row.integer(3));
  sample.output_time = time_point(row.integer(4));
  sample.dropped = count(row.integer(5));
  const auto status = status_of(row.text(6));
  if (!status) throw impossible(fmt::format("sample {} has an unknown status", row.integer(0)));
  sample.status = *status;
  sample.displacement = vector6(row, 7);
  sample.displacement_sigma = vector6(row, 13);
  sample.wrench = vector6(row, 19);
  sample.wrench_sigma = vector6(row, 25);
  sample.zero = vector6(row, 31);
  sample.deflection = vector6(row, 37);
  sample.zero_state = static_cast<ZeroState>(
      std::clamp<std::int64_t>(row.integer(43), 0, static_cast<int>(ZeroState::following)));
  sample.touched = row.integer(44) != 0;
  return sample;
}

ReferenceRecord reference_record(const Statement& row) {
  ReferenceRecord reading;
  reading.id = row.integer(0);
  reading.time = time_point(row.integer(1));
  reading.time_sigma = duration(row.integer(2));
  reading.channel = static_cast<int>(std::clamp<std::int64_t>(row.integer(3), 0, 255));
  reading.axes = row.integer(4) == 6 ? 6 : 1;
  reading.saturated = row.integer(5) != 0;
  reading.lost_before = count(row.integer(6));
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    reading.counts[at] = row.real(7 + i);
    reading.value[at] = row.real(13 + i);
    reading.sigma[at] = row.real(19 + i);
  }
  return reading;
}

EventRecord event_record(const Statement& row) {
  EventRecord event;
  event.id = row.integer(0);
  event.time = time_point(row.integer(1));
  const auto kind = kind_of(row.text(2));
  if (!kind) throw impossible(fmt::format("event {} is of an unknown kind", event.id));
  event.kind = *kind;
  event.step = static_cast<int>(std::clamp<std::int64_t>(row.integer(3), -1, kMaxStep));
  event.value = row.integer(4);
  event.text = std::string(row.text(5).substr(0, kMaxText));
  return event;
}

MarkRecord mark_record(const Statement& row) {
  const std::int64_t step = row.integer(2);
  if (step < 0 || step > kMaxStep) throw impossible(fmt::format("a mark is of step {}", step));
  const std::int64_t value = row.integer(3);
  if (value < kMarkWithdrawn || value > kMaxStep)
    throw impossible(fmt::format("a mark has the value {}", value));
  const auto zero = static_cast<int>(std::max<std::int64_t>(value - kMarkBegins, 0));
  return {{static_cast<int>(step), value >= kMarkBegins, time_point(row.integer(1)), row.integer(0),
           zero},
          value == kMarkWithdrawn};
}

}  // namespace tagwrench::record

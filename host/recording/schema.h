// What a recording is: one SQLite 3 file. Anybody's SQLite reads it; this is what they find.
//
// PRAGMA application_id is kApplicationId, user_version is kSchemaVersion: a reader refuses others.
//
// Order    Everything that happened has a number, `id`, which counts up over all tables. Rows of
//          frames, tracks and samples that belong to one frame share its id. A sample that has no
//          frame is the neutral one that the outputs got because none came in time.
// Time     t_ns and the like are nanoseconds on the clock of the frames: CLOCK_MONOTONIC of live
//          sources, the folder's or the simulator's own of others. origin_ns (where latency counts
//          from) and output_ns (the output call) are CLOCK_MONOTONIC always.
// Numbers  SI unless the name says else; displacement, wrench and corners as in host/core/types.h.
// NULL     is "not a number" or "none".
// Blobs    of numbers are little-endian doubles without padding.
//
// meta       key, value: created (UTC), software (version), source (one line), width, height,
//            period_ns, keep (raw, region or none), closed (1 once the writer has ended well), and
//            what the writer's command adds, such as board
// files      role (sensor.yaml, appearance, calibration), name as it was called, content: what the
//            sensor was when recording began
// frames     seq, t_ns, origin_ns, dropped; fourcc, stride and bytes of the frame as it came
//            (keep: raw), or CROP and the luminance of the part all_* (keep: region), or
//            NULL; first_* is the part that was decoded first, all_* what was decoded in the end
// tracks     status, hint (number of tagwrench::Diagnostic), displacement, covariance (its upper
//            triangle, row by row, 21 numbers), residual_px, residual_fraction, blur_px2,
//            tags_held, corners (for each tag 9 numbers: id, then x, y of four corners, px)
// samples    as the outputs got them
// reference  load cells (axes 1, channel) and six-axis sensors (axes 6): counts, value (N, N m),
//            sigma, each of the `axes` first columns; sigma_ns of the time; lost_before readings
// events     kind and, as it needs, step, value and text:
//              note          what people were told
//              missing       the sample of the same id went out because no frame came
//              disconnected, reconnected     of the source; text
//              board         news of the board; text
//              led           value: level in permille
//              clock         of the board; text: JSON of its state
//              button        step: number, value: 1 pressed, 0 let go
//              mark          of a plan: step, counted from 0; value: 1 or more it begins, 0 it
//                            ends, -1 the stretch marked before does not count (a bump, or done
//                            again). Steps that begin with one value count from one rest. Stands
//                            where the step was accepted; t_ns is that of its first or last frame
//              lost          value: records that found the buffer full, since the last such event
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/core/types.h"

namespace tagwrench::record {

// What goes into a recording and comes out of it.

/// What of each frame is kept.
enum class Keep : std::uint8_t {
  raw,     ///< the frame as it came
  region,  ///< the luminance of the part that was looked at
  none,
};

constexpr std::array<std::string_view, 3> kKeepNames = {"raw", "region", "none"};
constexpr std::string_view name(Keep keep) { return kKeepNames[static_cast<std::size_t>(keep)]; }

/// What a recording says of itself.
struct Head {
  std::string created;   ///< UTC, 2026-01-31T12:00:00Z
  std::string software;  ///< version
  std::string source;    ///< one line for people
  int width = 0;
  int height = 0;
  Duration period{};  ///< between frames, as the source announced it
  Keep keep = Keep::raw;
  std::string sensor_name;  ///< path of sensor.yaml, or what stood for it
  std::string sensor_yaml;  ///< its text as loaded
  std::string appearance;   ///< bytes of its rest.appearance; empty: it has none
  std::string calibration;  ///< bytes of its wrench.calibration; empty: it has none
  std::vector<std::pair<std::string, std::string>> measured;  ///< name and bytes of each file
  std::vector<std::pair<std::string, std::string>> more;      ///< key and value, for people
  bool closed = false;  ///< the writer has ended well; set by the reader
};

/// A reading of a load cell (axes 1) or a six-axis reference (axes 6).
struct ReferenceRecord {
  using Six = std::array<double, 6>;
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  static constexpr Six kNoneOfSix{kNone, kNone, kNone, kNone, kNone, kNone};

  std::int64_t id = 0;  ///< set by the reader
  TimePoint time{};
  Duration time_sigma{};
  int channel = 0;
  int axes = 1;
  Six counts = kNoneOfSix;
  Six value = kNoneOfSix;  ///< N, N m
  Six sigma = kNoneOfSix;  ///< one standard deviation
  bool saturated = false;
  std::uint32_t lost_before = 0;  ///< readings between the one before and this one
};

// clang-format off
enum class EventKind : std::uint8_t {
  note, missing, disconnected, reconnected, board, led, clock, button, mark, lost,
};
// clang-format on

/// As the database writes them.
constexpr std::array<std::string_view, 10> kEventNames = {
    "note", "missing", "disconnected", "reconnected", "board",
    "led",  "clock",   "button",       "mark",        "lost"};
constexpr std::string_view name(EventKind kind) {
  return kEventNames[static_cast<std::size_t>(kind)];
}

/// Values of a mark.
inline constexpr int kMarkWithdrawn = -1;
inline constexpr int kMarkEnds = 0;
inline constexpr int kMarkBegins = 1;  ///< or more: plus the number of its zero

struct EventRecord {
  std::int64_t id = 0;
  TimePoint time{};
  EventKind kind = EventKind::note;
  int step = -1;  ///< of a mark or a button
  std::int64_t value = 0;
  std::string text;
};

// The tables.

inline constexpr int kApplicationId = 0x54575243;  // "TWRC"
inline constexpr int kSchemaVersion = 1;

/// Of the sensor's files of measured/, before their names. Readers pass over roles they do not
/// know.
inline constexpr const char* kMeasuredRole = "measured/";

inline constexpr const char* kSchema = R"(
CREATE TABLE meta (key TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE files (role TEXT PRIMARY KEY, name TEXT, content BLOB);
CREATE TABLE frames (id INTEGER PRIMARY KEY, seq INTEGER, t_ns INTEGER, origin_ns INTEGER,
  dropped INTEGER, fourcc TEXT, stride INTEGER,
  first_x INTEGER, first_y INTEGER, first_width INTEGER, first_height INTEGER,
  all_x INTEGER, all_y INTEGER, all_width INTEGER, all_height INTEGER, bytes BLOB);
CREATE TABLE tracks (id INTEGER PRIMARY KEY, status TEXT, hint INTEGER,
  x REAL, y REAL, z REAL, rx REAL, ry REAL, rz REAL, covariance BLOB,
  residual_px REAL, residual_part REAL, blur_px2 REAL, tags_held INTEGER, corners BLOB);
CREATE TABLE samples (id INTEGER PRIMARY KEY, seq INTEGER, t_ns INTEGER, origin_ns INTEGER,
  output_ns INTEGER, dropped INTEGER, status TEXT,
  x REAL, y REAL, z REAL, rx REAL, ry REAL, rz REAL,
  sigma_x REAL, sigma_y REAL, sigma_z REAL, sigma_rx REAL, sigma_ry REAL, sigma_rz REAL,
  fx REAL, fy REAL, fz REAL, mx REAL, my REAL, mz REAL,
  sigma_fx REAL, sigma_fy REAL, sigma_fz REAL, sigma_mx REAL, sigma_my REAL, sigma_mz REAL,
  zero_fx REAL, zero_fy REAL, zero_fz REAL, zero_mx REAL, zero_my REAL, zero_mz REAL,
  motion_x REAL, motion_y REAL, motion_z REAL, motion_rx REAL, motion_ry REAL, motion_rz REAL,
  zero_state INTEGER, touched INTEGER);
CREATE TABLE reference (id INTEGER PRIMARY KEY, t_ns INTEGER, sigma_ns INTEGER, channel INTEGER,
  axes INTEGER, saturated INTEGER, lost_before INTEGER,
  counts_0 REAL, counts_1 REAL, counts_2 REAL, counts_3 REAL, counts_4 REAL, counts_5 REAL,
  value_0 REAL, value_1 REAL, value_2 REAL, value_3 REAL, value_4 REAL, value_5 REAL,
  sigma_0 REAL, sigma_1 REAL, sigma_2 REAL, sigma_3 REAL, sigma_4 REAL, sigma_5 REAL);
CREATE TABLE events (id INTEGER PRIMARY KEY, t_ns INTEGER, kind TEXT, step INTEGER, value INTEGER,
  text TEXT);
)";

}  // namespace tagwrench::record

// What goes into a recording and comes out of it.
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
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  std::int64_t id = 0;  ///< set by the reader
  TimePoint time{};
  Duration time_sigma{};
  int channel = 0;
  int axes = 1;
  std::array<double, 6> counts{kNone, kNone, kNone, kNone, kNone, kNone};
  std::array<double, 6> value{kNone, kNone, kNone, kNone, kNone, kNone};  ///< N, N m
  std::array<double, 6> sigma{kNone, kNone, kNone,
                              kNone, kNone, kNone};  ///< one standard deviation
  bool saturated = false;
  std::uint32_t lost_before = 0;  ///< readings between the one before and this one
};

enum class EventKind : std::uint8_t {
  note,
  missing,
  disconnected,
  reconnected,
  board,
  led,
  clock,
  button,
  mark,
  lost,
};

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

}  // namespace tagwrench::record

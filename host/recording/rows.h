// Rows of a recording's tables -> records. A file may be damaged, or anything else: every number is
// checked here before it is used.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "host/recording/database.h"
#include "host/recording/reader.h"

namespace tagwrench::record {

inline constexpr std::int64_t kMax_px = 16384;       ///< side of a picture
inline constexpr std::size_t kMaxText = 1 << 20;     ///< bytes
inline constexpr std::int64_t kMaxStep = 1'000'000;  ///< of a plan

/// A mark as it was set.
struct MarkRecord {
  Mark mark;
  bool withdrawn = false;  ///< the latest stretch of its step no longer counts
};

// What the functions below read, in the order of events.
extern const char* const kFrames;
extern const char* const kTroubles;
extern const char* const kTracks;
extern const char* const kSamples;
extern const char* const kReferences;
extern const char* const kEvents;
extern const char* const kMarks;

/// On the frames' clock; what is further than 95 years off is brought nearer, so that times can be
/// added and subtracted.
TimePoint time_point(std::int64_t ns);
std::optional<Keep> keep_of(std::string_view text);

// Of the row that a statement of the SQL above stands on. Throw DatabaseError where it holds what
// cannot be.

/// Of kFrames. Its bytes live until the statement's next step.
Entry frame_entry(const Statement& row, const Head& head);
/// Of kTroubles.
Entry trouble_entry(const Statement& row);
TrackRecord track_record(const Statement& row);
Sample sample_record(const Statement& row);
ReferenceRecord reference_record(const Statement& row);
EventRecord event_record(const Statement& row);
/// Of kMarks.
MarkRecord mark_record(const Statement& row);

}  // namespace tagwrench::record

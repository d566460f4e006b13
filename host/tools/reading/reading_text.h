// What `tagwrench read` prints: one reading as a live line, JSON or CSV, and the summary.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/tools/reading/hid_list.h"
#include "host/tools/reading/reading_stats.h"
#include "host/tools/reading/six_axis.h"
#include "host/tools/reading/tagwrench_hid.h"

namespace tagwrench {

/// What came last from the device that is being read. Of `wrench` and `puck` the one of `kind`
/// counts.
struct Reading {
  HidKind kind = HidKind::wrench;
  TimePoint time{};  ///< when it was read
  tagwrench_sample wrench{};
  std::uint32_t missing = 0;  ///< frames between it and the one before
  PuckState puck;
};

inline TimePoint capture_time(const tagwrench_sample& sample) {
  return TimePoint(std::chrono::nanoseconds(sample.capture_time_ns));
}

/// Nothing for a sample that is of no picture.
std::optional<Duration> latency_of(const Reading& reading) noexcept;

using ReadingBuffer = std::array<char, 768>;

/// Views into `buffer`, newline included; no heap. Keys and columns are those of the bridge's own
/// jsonl and csv where they mean the same; `host_ns` is when the report was read.
std::string_view json_line(ReadingBuffer& buffer, const Reading& reading) noexcept;
std::string_view csv_line(ReadingBuffer& buffer, const Reading& reading) noexcept;
std::string_view csv_header(HidKind kind) noexcept;

/// ASCII, without newline: the newest reading, rate and jitter lately, frames missing in all.
std::string_view live_line(ReadingBuffer& buffer, const Reading& reading,
                           const ReadingStats& lately, std::uint64_t missing) noexcept;

/// "1209:7a6e tagwrench-0 (/dev/hidraw3): 250 reports in ..."
std::string summary(const HidNode& node, const ReadingStats& stats, Duration time);

/// One line for each device.
std::string list_text(const std::vector<HidNode>& nodes);

}  // namespace tagwrench

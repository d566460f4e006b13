// Room tools/reading: wrench sensors and 6-DOF pucks on HID, ours and others; for `read`.
// In:  HID reports; /sys for who is there.
// Out: N and N m with sigmas, or counts of a puck; rate (Hz), jitter and latency (s).
// Then: tagwrench_hid.h (the C library for other programs), six_axis.h, reading_stats.h.
//
// The loop of `tagwrench read`: one device, found, read, lost and found again.
#pragma once

#include <optional>
#include <string>

#include "host/core/types.h"
#include "host/tools/reading/hid_list.h"

namespace tagwrench {

struct ReadOptions {
  enum class Style { people, json, csv };

  std::string device;  ///< path, VID:PID or serial; empty: the only one
  std::optional<Duration> time;
  bool wait = false;  ///< for a device that is not there yet, or no more
  Style style = Style::people;
  std::string log;             ///< CSV file beside what is printed; empty: none
  std::string nodes = "/dev";  ///< where device nodes come and go
  std::string hidraw_class = kHidrawClass;
};

/// Prints the list; returns the exit status.
int list_hid();

/// Until `stop_fd` (of termination_fd()) is readable or the time is over; prints the summary and
/// returns the exit status: 1 if the device went away, or what was read could not be written.
/// Throws ConfigError if there is no such device, or it may not be opened.
int read_hid(const ReadOptions& options, int stop_fd);

}  // namespace tagwrench

// Room tools/reading: wrench sensors and 6-DOF pucks on HID, ours and others; for `read`.
// In:  HID reports; /sys for who is there.
// Out: N and N m with sigmas, or counts of a puck; rate (Hz), jitter and latency (s).
// Then: tagwrench_hid.h (the C library for other programs).
//
// Which devices are plugged in, the choice of one, and what pucks say (hid_list.cpp); then the loop
// of `tagwrench read`: one device, found, read, lost and found again.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/core/types.h"
#include "host/tools/reading/tagwrench_hid.h"

namespace tagwrench {

// HID devices that are plugged in, from sysfs. hidapi's list is not for a program that waits while
// devices come and go: up to 0.13 it dies of one that goes while it is looked at.

inline constexpr const char* kHidrawClass = "/sys/class/hidraw";

struct HidUsage {
  std::uint16_t page = 0, usage = 0;
  friend bool operator==(const HidUsage&, const HidUsage&) = default;
};

/// What each top-level collection is for, as far as the descriptor goes (HID 1.11, 6.2.2). Any
/// bytes may come.
std::vector<HidUsage> top_level_usages(std::span<const std::uint8_t> descriptor);

enum class HidKind : std::uint8_t { wrench, puck };

constexpr const char* name(HidKind kind) { return kind == HidKind::wrench ? "wrench" : "6-dof"; }

struct HidNode {
  HidKind kind = HidKind::wrench;
  std::uint16_t vendor = 0, product = 0;
  std::string path;    ///< "/dev/hidraw3"
  std::string serial;  ///< may be empty
  std::string name;    ///< without the manufacturer where the device is on USB

  /// Whether this is the device that `other` was before it was plugged in again, perhaps as another
  /// node.
  bool is_again(const HidNode& other) const {
    return kind == other.kind && vendor == other.vendor && product == other.product &&
           serial == other.serial;
  }
  /// "1209:7a6e tagwrench-0 (/dev/hidraw3)"
  std::string label() const;
};

/// Wrench sensors first, then in the order of their numbers; no device needs to be readable for it
/// to be listed. One that is only half there is left out: it is coming or going. Texts are UTF-8
/// without control characters.
std::vector<HidNode> hid_nodes(const std::filesystem::path& hidraw_class);

/// What a person names a device by. Empty: the only one, or the wrench sensor beside pucks.
class HidChoice {
 public:
  /// A path, VID:PID in hex, or a serial.
  explicit HidChoice(const std::string& text);

  /// Nothing if no device fits. Throws ConfigError if several do: a wrench sensor goes before pucks
  /// of the same serial, but nothing else is guessed.
  std::optional<HidNode> among(const std::vector<HidNode>& nodes) const;

  /// For messages: "wrench sensor or 6-DOF device", with what was asked for.
  std::string words() const;

 private:
  bool fits(const HidNode& node) const;

  std::string text_;
  bool path_ = false;
  std::optional<std::pair<std::uint16_t, std::uint16_t>> id_;
};

// 6-DOF pucks on HID: which ones there are, and what their reports say. Pure.
//
// Two layouts are in use; every number is a little-endian int16, most often of +-350 counts.
//   combined   01 X Y Z RX RY RZ (13 bytes)
//   split      01 X Y Z (7), 02 RX RY RZ (7)
// Both have buttons, one bit each, in report 03. Axes are those of the HID usage tables (X right, Y
// toward the user, Z down) unless the device says otherwise.

struct PuckModel {
  std::uint16_t vendor = 0, product = 0;
  std::string_view layout;  ///< "combined", "split"; "any": not known
  std::string_view name;
};

/// Of 3Dconnexion's pucks, under its own vendor id 256f and under Logitech's 046d; nullptr if not
/// in the table. A puck need not be in it to be read.
const PuckModel* puck_model(std::uint16_t vendor, std::uint16_t product) noexcept;

struct PuckState {
  enum class Change : std::uint8_t {
    none,    ///< another report: the battery, say
    motion,  ///< counts are new; of a split pair, each half is
    buttons,
    stranger,  ///< too short for what its id promises
  };

  std::array<std::int16_t, 6> counts{};  ///< X Y Z RX RY RZ
  std::uint32_t buttons = 0;             ///< bit 0 is the first button

  /// Any bytes may come, report id first. The layout is told from the reports themselves: a device
  /// may speak another one than its model did.
  Change take(std::span<const std::uint8_t> report) noexcept;
};

// The loop.

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

// The stream of reports: its rate, jitter, gaps and latency, in constant memory.

/// Durations counted in classes that are 2 % wide, from 1 us to about a minute; what is outside
/// counts in the outermost ones.
class DurationHistogram {
 public:
  void add(Duration value) noexcept;
  std::uint64_t count() const noexcept { return count_; }
  Duration max() const noexcept { return max_; }
  /// The duration below which this part (0..1) lies, to 2 %; never above max(). 0 without any.
  Duration quantile(double part) const noexcept;

 private:
  std::array<std::uint32_t, 1024> classes_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

struct ReadingStats {
  void arrived(TimePoint time) noexcept;
  /// Of a wrench sample, after arrived().
  void sampled(std::uint32_t sequence, std::optional<Duration> latency_of_it) noexcept;
  /// Counts anew, but knows the last report: no interval and no gap between two spans is lost.
  void next_span() noexcept;
  /// The device was away: the time until the next report is no interval, its sequence starts anew.
  void interrupted() noexcept {
    last.reset();
    last_sequence.reset();
  }

  /// 0 with fewer than two reports.
  double rate_hz() const noexcept { return intervals > 0 && mean_s > 0 ? 1 / mean_s : 0; }
  Duration interval_mean() const noexcept;
  Duration interval_std() const noexcept;  ///< of a population, not of a sample

  std::uint64_t reports = 0, intervals = 0, missing = 0, gaps = 0, strangers = 0;
  std::optional<TimePoint> last;
  std::optional<std::uint32_t> last_sequence;
  double mean_s = 0;
  double squares_s2 = 0;  ///< sum of squared deviations from the mean (Welford 1962)
  Duration interval_max{};
  DurationHistogram latency;
};

// What is printed of it.

/// What came last from the device that is being read. Of `wrench` and `puck` the one of `kind`
/// counts.
struct Reading {
  HidKind kind = HidKind::wrench;
  TimePoint time{};  ///< when it was read
  tagwrench_sample wrench{};
  std::uint32_t missing = 0;  ///< frames between it and the one before
  PuckState puck;
};

/// Nothing for a sample that is of no picture, or whose clock cannot be ours: that of a simulated
/// sensor, a recording or another computer.
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

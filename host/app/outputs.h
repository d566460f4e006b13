// The outputs, a row each. Help texts, completion, messages and every choice between outputs are
// made of the rows: a word is looked up once, by parse_outputs(), and nobody compares words after
// that.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/output/output.h"
#include "host/output/spnav_output.h"
#include "host/output/watchdog.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

inline constexpr const char* kUsualSensorName = "sensor";

/// What outputs are made for.
struct OutputSetup {
  const SensorConfig& sensor;
  std::string source;            ///< one line: what the frames come from
  std::string name;              ///< of the sensor: tells two on one computer apart
  bool lossless = false;         ///< the source waits, so a file may
  bool standard_output = false;  ///< is taken by data
};

/// An output, and what it is to others.
struct OpenedOutput {
  std::unique_ptr<Output> output;
  std::vector<WatchdogDevice> devices{};  ///< that a watchdog must bring to rest
  const SpnavOutput* programs = nullptr;  ///< knows those that are connected
};

enum class OutputKind : std::uint8_t {
  device,     ///< others take it for hardware; made first, because it is what may be refused
  data,       ///< samples for programs
  people,     ///< a view
  pages,      ///< of a browser; built with the server that outlives runs
  reference,  ///< beside the load cells; built with the board
};

struct OutputRow {
  OutputKind kind;
  const char* name;
  const char* argument = "";  ///< ":FILE", "[:PATH]": what comes behind the name
  const char* help;           ///< one line
  bool names_file = false;
  bool hid = false;           ///< a virtual device of this computer, known by the sensor's name
  bool unasked = false;       ///< made, where it can be, when nothing is asked for
  bool outlives_job = false;  ///< goes on when the camera has been lent and comes back
  bool (*moves)(const std::string& argument) = nullptr;    ///< by what profiles say; null: never
  bool (*accepts)(const std::string& argument) = nullptr;  ///< null: any; may throw ConfigError
  /// Throws ConfigError. Null: built with what it belongs to.
  OpenedOutput (*open)(const OutputSetup& setup, const std::string& argument) = nullptr;
};

/// In the order of the help text.
std::span<const OutputRow> output_rows();

/// OUT as it was said, and its row.
struct OutputSpec {
  const OutputRow* row;
  std::string argument;

  bool is(OutputKind kind) const { return row->kind == kind; }
  bool moves() const { return row->moves != nullptr && row->moves(argument); }
  std::string text() const;
};

/// Throws ConfigError about what cannot be, before anything is made or overwritten: with the
/// outputs that there are, or with what is wrong with one, or with two of them.
std::vector<OutputSpec> parse_outputs(const std::vector<std::string>& texts);

/// The first of its kind; null: there is none.
const OutputSpec* find_output(std::span<const OutputSpec> specs, OutputKind kind);

/// Of an option --output that takes all of them.
std::string output_help();

/// Those that are asked for, one after the other as they are needed. `unasked`: where nothing is
/// asked for, the view and every device that this machine allows.
class Outputs {
 public:
  Outputs(const std::vector<OutputSpec>& asked, bool unasked);
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// Opens those that are not open: devices first, files are only then overwritten. Throws
  /// ConfigError; of unasked ones it says why they cannot be.
  void open(OutputSetup setup);
  /// All but those that outlive a job.
  void close_for_job() {
    for (Entry& entry : entries_)
      if (!entry.spec.row->outlives_job) entry.opened = {};
  }
  /// Neutral, then gone.
  void close() {
    for (Entry& entry : entries_) entry.opened = {};
  }

  /// Those that are open, devices first. Borrowed.
  std::vector<Output*> all() const {
    std::vector<Output*> all;
    for (const Entry& entry : entries_)
      if (entry.opened.output) all.push_back(entry.opened.output.get());
    return all;
  }
  std::vector<WatchdogDevice> devices() const {
    std::vector<WatchdogDevice> devices;
    for (const Entry& entry : entries_)
      devices.insert(devices.end(), entry.opened.devices.begin(), entry.opened.devices.end());
    return devices;
  }
  /// Null: nobody knows them.
  const SpnavOutput* programs() const {
    for (const Entry& entry : entries_)
      if (entry.opened.programs != nullptr) return entry.opened.programs;
    return nullptr;
  }

  /// Whether something that profiles move is among them.
  bool any_moves() const {
    return std::any_of(entries_.begin(), entries_.end(),
                       [](const Entry& entry) { return entry.spec.moves(); });
  }
  /// Whether a virtual device was asked for.
  bool any_hid_asked() const {
    return std::any_of(entries_.begin(), entries_.end(),
                       [](const Entry& entry) { return entry.asked && entry.spec.row->hid; });
  }

 private:
  struct Entry {
    OutputSpec spec;
    bool asked = true;
    OpenedOutput opened{};
  };

  std::vector<Entry> entries_;  ///< devices first
};

}  // namespace tagwrench

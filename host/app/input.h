// Where the frames of a command come from: SRC and sensor.yaml to the objects.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "host/core/os/unique_fd.h"
#include "host/recording/reader.h"
#include "host/sensor/sensor_config.h"
#include "host/source/frame_source.h"
#include "host/source/simulator/bench.h"
#include "host/tracker/tracker.h"

namespace tagwrench {

struct Spec {
  std::string kind;
  std::string argument;
};

/// "kind:argument", or "kind".
Spec split_spec(const std::string& spec);

struct InputOptions {
  std::string sensor;  ///< path of sensor.yaml; empty: what the source suggests
  std::string source;  ///< SRC
  bool fast = false;   ///< sources that are not live run as fast as they can, no frame dropped
  WrenchCalibration calibration = WrenchCalibration::use;
  record::IfDamaged if_damaged = record::IfDamaged::refuse;
};

/// A source and the sensor that it shows.
struct Input {
  SensorConfig sensor;
  std::unique_ptr<FrameSource> source;
  std::string spec;  ///< SRC that it was opened with
  SourceKind kind = SourceKind::simulator;
  std::string argument;     ///< of SRC, behind the colon
  std::string sensor_name;  ///< path of the sensor.yaml that was loaded, or what stands for it
  std::string sensor_text;  ///< of a sensor that has no file
  std::optional<record::Head> recorded;  ///< of a recording, whose sensor is its own
};

/// Throws ConfigError if the source is none, cannot be opened, or the sensor cannot be used.
Input open_input(const InputOptions& options);

/// sensor.yaml of the paper's sensor with nominal lens: what a fresh build comes closest to.
std::string paper_sensor_yaml();

/// The same behind this camera: a whole new sensor.yaml for people to change.
std::string paper_sensor_yaml(const CameraModel& camera);

/// Throws ConfigError unless the source's frames have the size that the sensor's camera has.
void check_size(const Input& input);

/// Throws ConfigError unless the picture of the sensor at rest, where one is given, shows its tags.
void check_appearance(const Input& input);

/// Of the option --despite-damage.
inline constexpr const char* kDespiteDamage = "--despite-damage";
inline constexpr const char* kDespiteDamageHelp =
    "what can be read of a recording that is damaged is taken";
inline record::IfDamaged if_damaged(bool despite) {
  return despite ? record::IfDamaged::take : record::IfDamaged::refuse;
}

/// After all has been read, before anything is written: throws DamagedFile if the source was
/// damaged, and is not to be taken all the same.
void check_whole(const FrameSource& source, record::IfDamaged if_damaged);

enum class Next : std::uint8_t { frame, nothing, end, stopped };

/// The tracker of this sensor.
Tracker make_tracker(const SensorConfig& sensor);

/// Waits a while for a frame, the end of the source or a signal; says when a camera goes or comes.
Next next_frame(FrameSource& source, const UniqueFd& stop, Frame& frame);

// The sources, a row each. Help texts, completion, messages and every choice between sources are
// made of the rows: a word is looked up once, by parse_source(), and nobody compares words after
// that.

struct SourceRow {
  SourceKind kind;
  const char* name;
  const char* argument;       ///< "DIR": what comes behind the colon
  bool stands_alone = false;  ///< without an argument, too
  const char* help = "";      ///< one line; may be empty
  bool own_time = false;      ///< its pictures are of another time than now
  Input (*open)(const InputOptions& options, const std::string& argument);
};

/// In the order of the help text.
std::span<const SourceRow> source_rows();

/// SRC as it was said, and its row.
struct SourceSpec {
  const SourceRow* row;
  std::string argument;

  bool is(SourceKind kind) const { return row->kind == kind; }
};

/// Throws ConfigError, with the sources that there are.
SourceSpec parse_source(const std::string& text);

/// Of an option --source that takes all of them.
std::string source_help();

/// "sim | sim:SCENARIO.yaml | images:DIR": of an option --source that takes some of them.
std::string source_forms(std::initializer_list<SourceKind> kinds);

// A source with somebody at hand who does what is asked: a person before a camera, the simulated
// one at the simulated sensor.

/// The bench outlives the source, which asks it for the load.
struct BenchInput {
  std::unique_ptr<sim::Bench> bench{};  ///< null unless the source is the simulated sensor
  TimePoint time_zero{};                ///< of the bench, on the frames' clock
  Input input{};
};

/// As open_input(); but the simulated sensor is loaded by a bench, in place of its scenario's
/// trajectory; with `fast` it runs on a virtual clock, else in real time.
BenchInput open_at_bench(const InputOptions& options);

}  // namespace tagwrench

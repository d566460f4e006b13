// `tagwrench zero`: what the sensor reads with hands off becomes its zero, in measured/zero.yaml.
#include <fmt/format.h>

#include <filesystem>

#include "host/app/input.h"
#include "host/commands/commands.h"
#include "host/commands/measured_results.h"
#include "host/commands/static_measurement.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/sensor/measured_files.h"

namespace tagwrench {
namespace {

struct ZeroCommandOptions {
  std::string sensor;  ///< path
  std::string source;  ///< SRC
  int events = -1;     ///< descriptor, see Events
};

std::string in_words(const Vector6& wrench) {
  return fmt::format("{:.4f} {:.4f} {:.4f} N, {:.3f} {:.3f} {:.3f} mN m", wrench[0], wrench[1],
                     wrench[2], wrench[3] * 1e3, wrench[4] * 1e3, wrench[5] * 1e3);
}

/// What stands in the way of a zero: a sensor that is not what was calibrated must not have its
/// fault taken off as if it were drift. Empty if nothing does.
std::string objection(const std::vector<InSituFinding>& findings) {
  for (const InSituFinding& f : findings) {
    switch (f.fault) {
      case Fault::tag_moved:
      case Fault::some_tag_moved:
      case Fault::tag_not_seen:
      case Fault::out_of_focus:
      case Fault::rest_elsewhere: return text(f);
      case Fault::not_known:
        if (f.subject == Subject::zero) return text(f);
        break;
      default: break;
    }
  }
  return {};
}

/// 0: written; 1: refused, nothing was written.
int set_zero(const ZeroCommandOptions& options) {
  const MeasuredSensor measured(options.sensor, "", {kMeasuredZero});
  const UniqueFd stop = termination_fd();
  BenchInput at =
      open_at_bench({options.sensor, options.source, true, WrenchCalibration::zero_that_fits});
  const SensorConfig& sensor = at.input.sensor;
  check_size(at.input);
  check_calibrated_rest(sensor, "zero");
  StaticMeasurement static_measurement(sensor);
  Events events(options.events);
  log_info("source: " + at.input.source->format().description);
  log_info("hands off for some seconds");
  const Seen seen = watch(*at.input.source, stop, static_measurement, events);
  if (seen == Seen::stopped) return stopped_unwritten();
  std::string why = why_nothing(seen, static_measurement);
  if (why.empty()) why = objection(judge(static_measurement.result()));
  if (!why.empty()) {
    log_info(why + "; nothing was written");
    return 1;
  }
  const Vector6 zero = static_measurement.result().wrench + sensor.zero.set;
  const std::filesystem::path file = measured.folder() / kMeasuredZero;
  write_measured(file, zero_yaml({stamp_for(options.sensor), zero,
                                  sha256_of(identity_of(sensor.camera, sensor.target, sensor.rest)),
                                  sha256_of(sensor.wrench)}));
  log_info("zero was {}{}", in_words(sensor.zero.set),
           sensor.zero.date.empty() ? "" : ", since " + sensor.zero.date);
  log_info(
      "zero is  {}, from {} frames in {:.1f} s; no thermometer is read: let it warm up before, and "
      "zero again after",
      in_words(zero), static_measurement.result().frames, static_measurement.seconds());
  log_info("written: " + file.string());
  return 0;
}

}  // namespace

void zero_command(command_line::Command program) {
  const auto o = std::make_shared<ZeroCommandOptions>();
  auto verb = program.add_subcommand("zero",
                                     "hands off: what the sensor reads now becomes its zero, "
                                     "written to measured/zero.yaml beside its sensor.yaml");
  verb.add_option("--sensor", o->sensor, "sensor.yaml of this sensor").required();
  verb.add_option("--source", o->source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  add_events_option(verb, o->events);
  verb.runs([o] { return set_zero(*o); });
}

}  // namespace tagwrench

#include "host/commands/zero_command.h"

#include <fmt/format.h>

#include <filesystem>

#include "host/app/bench_input.h"
#include "host/app/sources.h"
#include "host/commands/check_text.h"
#include "host/commands/events_option.h"
#include "host/commands/measured_results.h"
#include "host/commands/static_measurement.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/sensor/sensor_identity.h"

namespace tagwrench {
namespace {

constexpr int kRefused = 1;

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
      case Fault::rest_elsewhere:
        return text(f);
      case Fault::not_known:
        if (f.subject == Subject::zero) return text(f);
        break;
      default:
        break;
    }
  }
  return {};
}

}  // namespace

ZeroCommand::ZeroCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "zero",
          "hands off: what the sensor reads now becomes its zero, written to "
          "measured/zero.yaml beside its sensor.yaml")) {
  verb_.add_option("--sensor", options_.sensor, "sensor.yaml of this sensor").required();
  verb_
      .add_option("--source", options_.source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  add_events_option(verb_, options_.events);
}

int ZeroCommand::run() const {
  const MeasuredSensor measured(options_.sensor, "", {kMeasuredZero});
  const UniqueFd stop = termination_fd();
  BenchInput at =
      open_at_bench({options_.sensor, options_.source, true, WrenchCalibration::zero_that_fits});
  const SensorConfig& sensor = at.input.sensor;
  check_size(at.input);
  check_calibrated_rest(sensor, "zero");
  StaticMeasurement static_measurement(sensor);
  Events events(options_.events);
  log_info("source: " + at.input.source->format().description);
  log_info("hands off for some seconds");
  const Seen seen = watch(*at.input.source, stop, static_measurement, events);
  if (seen == Seen::stopped) {
    log_info("stopped; nothing was written");
    return kRefused;
  }
  std::string why = why_nothing(seen, static_measurement);
  if (why.empty()) why = objection(judge(static_measurement.result()));
  if (!why.empty()) {
    log_info(why + "; nothing was written");
    return kRefused;
  }
  const Vector6 zero = static_measurement.result().wrench + sensor.zero.set;
  const std::filesystem::path file = measured.folder() / kMeasuredZero;
  write_measured(file, zero_yaml({stamp_for(options_.sensor), zero,
                                  sha256_of(identity_of(sensor.camera, sensor.target, sensor.rest)),
                                  sha256_of(sensor.wrench)}));
  log_info(fmt::format("zero was {}{}", in_words(sensor.zero.set),
                       sensor.zero.date.empty() ? "" : ", since " + sensor.zero.date));
  log_info(fmt::format(
      "zero is  {}, from {} frames in {:.1f} s; no thermometer is read: let it warm up "
      "before, and zero again after",
      in_words(zero), static_measurement.result().frames, static_measurement.seconds()));
  log_info("written: " + file.string());
  return 0;
}

}  // namespace tagwrench

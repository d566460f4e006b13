#include "host/commands/zero_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <ctime>

#include "host/app/bench_input.h"
#include "host/app/sources.h"
#include "host/commands/check_text.h"
#include "host/commands/events_option.h"
#include "host/commands/static_measurement.h"
#include "host/commands/today.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/termination.h"

namespace tagwrench {
namespace {

constexpr int kRefused = 1;

std::string list(const Eigen::Vector3d& v) {
  return fmt::format("[{:.7f}, {:.7f}, {:.7f}]", v.x(), v.y(), v.z());
}

std::vector<YamlEntry> zero_entries(const Vector6& zero, const std::string& date) {
  return {{"zero_n", list(zero.head<3>())},
          {"zero_nm", list(zero.tail<3>())},
          {"zero_date", "'" + date + "'"}};
}

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

std::vector<YamlEntry> without_zero(const SensorConfig& sensor) {
  if (sensor.zero.date.empty() && sensor.zero.set.isZero()) return {};
  return zero_entries(Vector6::Zero(), "");
}

ZeroCommand::ZeroCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "zero",
          "hands off: what the sensor reads now becomes its zero, written to "
          "its sensor.yaml")) {
  verb_.add_option("--sensor", options_.sensor, "sensor.yaml of this sensor").required();
  verb_
      .add_option("--source", options_.source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  add_events_option(verb_, options_.events);
}

int ZeroCommand::run() const {
  const std::string yaml = read_text(options_.sensor);
  check_replaceable(options_.sensor);
  const UniqueFd stop = termination_fd();
  BenchInput at = open_at_bench({options_.sensor, options_.source, true});
  const SensorConfig& sensor = at.input.sensor;
  check_editable(yaml, {{"wrench", zero_entries(Vector6::Zero(), "")}}, options_.sensor);
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
  const std::string date = today();
  write_sensor(yaml, {{"wrench", zero_entries(zero, date)}}, options_.sensor);
  log_info(fmt::format("zero was {}{}", in_words(sensor.zero.set),
                       sensor.zero.date.empty() ? "" : ", since " + sensor.zero.date));
  log_info(fmt::format(
      "zero is  {}, from {} frames in {:.1f} s; no thermometer is read: let it warm up "
      "before, and zero again after",
      in_words(zero), static_measurement.result().frames, static_measurement.seconds()));
  log_info("written: " + options_.sensor);
  return 0;
}

}  // namespace tagwrench

#include "host/app/bench_input.h"

#include <utility>

#include "host/app/scenario_config.h"
#include "host/app/sources.h"
#include "host/source/simulator/folder_export.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench {

BenchInput open_at_bench(const InputOptions& options) {
  const SourceSpec spec = parse_source(options.source);
  BenchInput at;
  if (!spec.is(SourceKind::simulator)) {
    at.input = open_input(options);
    return at;
  }
  const sim::Scenario scenario =
      spec.argument.empty() ? sim::Scenario{} : load_scenario(spec.argument);
  at.bench = std::make_unique<sim::Bench>(scenario.bench, scenario.seed);
  if (options.sensor.empty()) {
    at.input.sensor_name = "the simulated sensor";
    at.input.sensor_text = sim::sensor_yaml(scenario);
    at.input.sensor = parse_sensor(at.input.sensor_text, at.input.sensor_name);
  } else {
    at.input.sensor_name = options.sensor;
    at.input.sensor = load_sensor(options.sensor, options.calibration);
  }
  auto source = std::make_unique<SimulatorSource>(scenario, !options.fast, nullptr, at.bench.get());
  at.time_zero = source->time_zero();
  at.input.source = std::move(source);
  return at;
}

}  // namespace tagwrench

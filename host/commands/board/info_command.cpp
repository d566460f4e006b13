// `tagwrench board info`.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/board/board_loop.h"
#include "host/board/cell_calibration.h"
#include "host/commands/board/board.h"
#include "host/commands/commands.h"
#include "host/core/json/json_text.h"
#include "host/core/log.h"
#include "host/output/line_outputs.h"

namespace tagwrench {
namespace {

using link::BoardSession;

double us(Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

std::string for_people(const BoardSession& session, const std::string& port) {
  const link::Hello& hello = session.hello();
  const link::Capabilities& can = session.capabilities();
  const link::Status& status = session.status();
  const link::ClockReport clock = session.clock().report();
  const link::SessionCounters counters = session.counters();
  std::string out;
  const auto line = [&out](const char* what, const std::string& value) {
    out += fmt::format("{:<12}{}\n", what, value);
  };
  const std::string id = link::id_text(hello.unique_id);
  line("board", fmt::format("{}, firmware {}, protocol {}.{}", hello.board, hello.firmware,
                            hello.protocol_major, hello.protocol_minor));
  line("id", id.empty() ? "none" : id);
  line("port", port);
  line("started", fmt::format("by {} (boot {:08x})",
                              link::reset_cause_name(static_cast<std::uint32_t>(hello.reset_cause)),
                              hello.boot_id));
  line("inputs", fmt::format("{} load cells, {} analogue ({} bits), {} buttons", can.cells,
                             can.adc_channels, can.adc_bits, can.buttons));
  line("LED",
       fmt::format("{} levels; {:.0f} % for ever, full for {:.0f} s from cold", can.led_levels,
                   can.led_sustained_permille / 10.0, can.led_full_time_ms / 1000.0));
  line("strobe",
       fmt::format("pulses of {} to {} us, one every {} to {} us", can.strobe_width_min_us,
                   can.strobe_width_max_us, can.strobe_period_min_us, can.strobe_period_max_us));
  line("clock", fmt::format("{:+.1f} +- {:.1f} ppm to this host, in steps of {} ns; times are good "
                            "to {:.0f} us, {:.0f} us of it common to all{}",
                            clock.skew_ppm, clock.skew_sigma_ppm, can.time_step_ns,
                            std::hypot(us(clock.random_sigma), us(clock.asymmetry_sigma)),
                            us(clock.asymmetry_sigma), clock.converged ? "" : "; not settled yet"));
  if (session.has_status()) {
    line("supply",
         can.measures_supply ? fmt::format("{:.2f} V", status.supply_mv / 1000.0) : "not measured");
    if (can.measures_temperature)
      line("temperature", fmt::format("{:.1f} C", status.temperature_centidegree / 100.0));
    line("loop", fmt::format("longest {} us; {} bytes of stack never used", status.longest_loop_us,
                             status.stack_free_bytes));
    line("board lost", fmt::format("{} bad frames, {} bytes, {} reports", status.bad_frames,
                                   status.overruns, status.dropped_reports));
  }
  line("host lost", fmt::format("{} bad frames, {} frames missing", counters.damaged_frames,
                                counters.lost_frames));
  return out;
}

std::string as_json(const BoardSession& session, const std::string& port) {
  const link::Hello& hello = session.hello();
  const link::Capabilities& can = session.capabilities();
  const link::Status& status = session.status();
  const link::ClockReport clock = session.clock().report();
  const link::SessionCounters counters = session.counters();
  const nlohmann::ordered_json root{
      {"board", hello.board},
      {"firmware", hello.firmware},
      {"protocol", fmt::format("{}.{}", hello.protocol_major, hello.protocol_minor)},
      {"id", link::id_text(hello.unique_id)},
      {"port", port},
      {"boot_id", hello.boot_id},
      {"reset_cause", link::reset_cause_name(static_cast<std::uint32_t>(hello.reset_cause))},
      {"cells", can.cells},
      {"adc_channels", can.adc_channels},
      {"adc_bits", can.adc_bits},
      {"buttons", can.buttons},
      {"led_levels", can.led_levels},
      {"led_sustained_permille", can.led_sustained_permille},
      {"led_full_time_ms", can.led_full_time_ms},
      {"skew_ppm", clock.skew_ppm},
      {"skew_sigma_ppm", clock.skew_sigma_ppm},
      {"time_sigma_us", std::hypot(us(clock.random_sigma), us(clock.asymmetry_sigma))},
      {"clock_converged", clock.converged},
      {"supply_mv", status.supply_mv},
      {"bad_frames", status.bad_frames},
      {"overruns", status.overruns},
      {"dropped_reports", status.dropped_reports},
      {"stack_free_bytes", status.stack_free_bytes},
      {"longest_loop_us", status.longest_loop_us},
      {"host_damaged_frames", counters.damaged_frames},
      {"host_lost_frames", counters.lost_frames},
  };
  // The board's strings are bytes of a stranger; what is no UTF-8 is replaced.
  return dump_json(root) + "\n";
}

}  // namespace

int board_info(const BoardOptions& options) {
  BoardLoop loop(options.port, session_options(options));
  if (!loop.settle()) return 0;
  print_data(options.json ? as_json(loop.session(), loop.link().port())
                          : for_people(loop.session(), loop.link().port()));
  return 0;
}

}  // namespace tagwrench

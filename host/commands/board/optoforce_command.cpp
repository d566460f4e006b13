// `tagwrench board optoforce`.
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>

#include "host/board/optoforce.h"
#include "host/commands/board/board.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/output/line_outputs.h"

namespace tagwrench {
namespace {

using link::OptoforceReading;
using std::chrono::milliseconds;

constexpr Duration kMaxSilence = std::chrono::seconds(3);
constexpr const char* kAxes[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

std::string optoforce_json(const OptoforceReading& reading) {
  std::string values;
  for (std::size_t i = 0; i < reading.axes; ++i)
    values += fmt::format("{}{:.6g}", i == 0 ? "" : ",", reading.values[i]);
  return fmt::format(
      R"({{"kind":"optoforce","t_ns":{},"t_sigma_ns":{},"values":[{}],"trouble":"{}",)"
      R"("counter":{},"lost_before":{}}})"
      "\n",
      std::chrono::duration_cast<Duration>(reading.time.time.time_since_epoch()).count(),
      reading.time.sigma.count(), values, link::status_text(reading.status), reading.counter,
      reading.lost_before);
}

std::string line_for_people(const OptoforceReading& reading) {
  std::string out = fmt::format(
      "{:14.6f} s", std::chrono::duration<double>(reading.time.time.time_since_epoch()).count());
  for (std::size_t i = 0; i < reading.axes; ++i) {
    const bool torque = reading.axes == 6 && i >= 3;
    out += fmt::format("  {} {:+9.4f} {}", kAxes[reading.axes == 6 ? i : i % 3], reading.values[i],
                       torque ? "N m" : "N");
  }
  const std::string trouble = link::status_text(reading.status);
  return out + (trouble.empty() ? "" : "  " + trouble) + "\n";
}

class ForceWatch {
 public:
  explicit ForceWatch(const BoardOptions& options)
      : options_(options),
        out_("-", /*lossless=*/true),
        stop_(termination_fd()),
        sensor_({.port = options.port,
                 .baud = 1'000'000,
                 .rate_hz = options.force_rate,
                 .filter_hz = options.force_filter,
                 .zero = options.force_zero,
                 .counts_per_unit = options.counts_per_unit}) {}

  int run() {
    const TimePoint begin = clock_now();
    const TimePoint end =
        options_.seconds ? begin + in_seconds(*options_.seconds) : TimePoint::max();
    next_line_ = begin;
    bool good = true;
    while (good && clock_now() < end && wait(std::min(end, clock_now() + milliseconds(200)))) {
      sensor_.service();
      for (OptoforceReading reading; good && sensor_.next(reading);) good = show(reading);
      watch_port();
      if (nothing() && clock_now() - begin > kMaxSilence) break;
    }
    if (nothing() && !stopped_) return say_nothing();
    const auto& counters = sensor_.counters();
    if (counters.lost_frames > 0 || counters.interruptions > 0)
      log_info("{} samples were lost, {} times bytes came that belong to none",
               counters.lost_frames, counters.interruptions);
    if (!good) log_info(out_.failure());
    return good ? 0 : 1;
  }

 private:
  /// False if a signal came.
  bool wait(TimePoint until) {
    const auto left = std::chrono::ceil<milliseconds>(until - clock_now());
    std::array<pollfd, 2> fds{{{sensor_.poll_fd(), POLLIN, 0}, {stop_.get(), POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    stopped_ = fds[1].revents != 0;
    return !stopped_;
  }

  bool show(const OptoforceReading& reading) {
    if (options_.json) return out_.write(optoforce_json(reading)) != SendStatus::failed;
    if (clock_now() < next_line_) return true;
    next_line_ = clock_now() + in_seconds(options_.line_period);
    return out_.write(line_for_people(reading)) != SendStatus::failed;
  }

  bool nothing() const { return sensor_.counters().frames == 0; }

  void watch_port() {
    if (sensor_.plugged() != plugged_) {
      plugged_ = sensor_.plugged();
      log_info(options_.port + (plugged_
                                    ? ": the port is back"
                                    : ": the port is gone; plug it in again, this program waits"));
    }
  }

  int say_nothing() const {
    const std::uint64_t bytes = sensor_.counters().skipped_bytes;
    log_info(bytes == 0
                 ? fmt::format("{}: nothing comes; is this the sensor's port?", options_.port)
                 : fmt::format(
                       "{}: {} bytes came, but no frame of an OptoForce sensor; is this its port?",
                       options_.port, bytes));
    return 1;
  }

  const BoardOptions& options_;
  TextSink out_;
  UniqueFd stop_;
  link::OptoforceSensor sensor_;
  TimePoint next_line_{};
  bool plugged_ = true;
  bool stopped_ = false;  ///< by a signal
};

}  // namespace

int board_optoforce(const BoardOptions& options) { return ForceWatch(options).run(); }

}  // namespace tagwrench

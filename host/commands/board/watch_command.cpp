// `tagwrench board watch`, `log` and `optoforce`: samples of a board, or of an OptoForce sensor, as
// lines: CSV and JSON for programs, a line of all cells for people.

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>

#include "host/board/cell_calibration.h"
#include "host/board/optoforce.h"
#include "host/commands/board/board.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/output/line_outputs.h"

namespace tagwrench {
namespace {

constexpr const char* kBoardCsvHeader =
    "kind,channel,t_ns,t_sigma_ns,counts,value,sigma,sequence,lost_before\n";

std::int64_t ns(TimePoint time) {
  return std::chrono::duration_cast<Duration>(time.time_since_epoch()).count();
}

std::string cell_text(std::size_t channel, const link::CellReading& reading,
                      const link::CellCalibration& calibration) {
  const char* full = reading.saturated ? " SATURATED" : "";
  if (!calibration.calibrated)
    return fmt::format("cell {} {:+9d} counts{}", channel, reading.counts, full);
  const link::Newtons force = calibration.newtons(reading.counts);
  return fmt::format("cell {} {:+9.4f} N ±{:.4f}{}", channel, force.value, force.sigma, full);
}

std::string csv_row(std::string_view kind, int channel, const link::HostTime& time,
                    const std::string& rest = ",,,,") {
  return fmt::format("{},{},{},{},{}\n", kind, channel, ns(time.time), time.sigma.count(), rest);
}

std::string json_row(const std::string& head, const link::HostTime& time, const std::string& rest) {
  return fmt::format("{{{},\"t_ns\":{},\"t_sigma_ns\":{}{}}}\n", head, ns(time.time),
                     time.sigma.count(), rest);
}

/// `calibration` says newtons, or nothing (then value and sigma are empty, null in JSON).
std::string csv_line(const link::CellReading& r, const link::CellCalibration& calibration) {
  const link::Newtons force = calibration.newtons(r.counts);
  const std::string newtons = calibration.calibrated
                                  ? fmt::format("{:.6g},{:.3g}", force.value, force.sigma)
                                  : std::string(",");
  return csv_row(r.saturated ? "cell_saturated" : "cell", r.channel, r.time,
                 fmt::format("{},{},{},{}", r.counts, newtons, r.sequence, r.lost_before));
}

std::string csv_line(const link::AdcReading& r) {
  return csv_row("adc", r.channel, r.time,
                 fmt::format("{},,,{},{}", r.counts, r.sequence, r.lost_before));
}

std::string csv_line(const link::ButtonReading& r) {
  return csv_row(r.pressed ? "press" : "release", r.button, r.time);
}

std::string csv_line(const link::FaultReading& r) {
  return csv_row(link::fault_name(static_cast<std::uint32_t>(r.code)), r.channel, r.time);
}

std::string json_line(const link::CellReading& r, const link::CellCalibration& calibration) {
  const link::Newtons force = calibration.newtons(r.counts);
  const std::string newtons =
      calibration.calibrated
          ? fmt::format(R"("f_n":{:.6g},"f_sigma_n":{:.3g})", force.value, force.sigma)
          : std::string(R"("f_n":null,"f_sigma_n":null)");
  return json_row(fmt::format(R"("kind":"cell","channel":{})", r.channel), r.time,
                  fmt::format(R"(,"counts":{},{},"saturated":{},"sequence":{},"lost_before":{})",
                              r.counts, newtons, r.saturated, r.sequence, r.lost_before));
}

std::string json_line(const link::AdcReading& r) {
  return json_row(fmt::format(R"("kind":"adc","channel":{})", r.channel), r.time,
                  fmt::format(R"(,"counts":{},"sequence":{},"lost_before":{})", r.counts,
                              r.sequence, r.lost_before));
}

std::string json_line(const link::ButtonReading& r) {
  return json_row(fmt::format(R"("kind":"button","button":{})", r.button), r.time,
                  fmt::format(R"(,"pressed":{})", r.pressed));
}

std::string json_line(const link::FaultReading& r) {
  return json_row(fmt::format(R"("kind":"fault","fault":"{}","channel":{})",
                              link::fault_name(static_cast<std::uint32_t>(r.code)), r.channel),
                  r.time, "");
}

/// What people see: the latest of everything.
class BoardView {
 public:
  void take(const link::CellReading& reading) {
    if (reading.channel >= cells_.size()) return;
    Cell& cell = cells_[reading.channel];
    cell.seen = true;
    cell.reading = reading;
    cell.lost += reading.lost_before;
    latest_ = reading.time;
  }
  void take(const link::AdcReading& reading) {
    if (reading.channel < adc_.size()) adc_[reading.channel] = reading.counts;
  }
  void take(const link::ButtonReading& reading) {
    if (reading.button >= pressed_.size()) return;
    button_seen_[reading.button] = true;
    pressed_[reading.button] = reading.pressed;
  }

  /// One line; cells that have said nothing since `stale` are said to be so.
  std::string line(const link::CellCalibrations& calibrations, const BoardLoop& loop,
                   TimePoint stale) const {
    const double t = std::chrono::duration<double>(latest_.time.time_since_epoch()).count();
    const double sigma_us = std::chrono::duration<double, std::micro>(latest_.sigma).count();
    std::string out = fmt::format("{:14.6f} s ±{:3.0f} us", t, sigma_us);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const Cell& cell = cells_[i];
      const link::FaultCode fault = loop.cell_fault(i);
      out += "  ";
      if (fault == link::FaultCode::cell_stuck)
        out += fmt::format("cell {} is stuck", i);
      else if (!cell.seen || fault == link::FaultCode::cell_silent)
        out += fmt::format("cell {} is not wired", i);
      else if (cell.reading.time.time < stale)
        out += fmt::format("cell {} is silent", i);
      else
        out += cell_text(i, cell.reading, calibrations[i]);
      if (cell.lost > 0) out += fmt::format(" ({} lost)", cell.lost);
    }
    for (std::size_t i = 0; i < adc_.size(); ++i)
      if (adc_[i] >= 0) out += fmt::format("  adc {} {}", i, adc_[i]);
    for (std::size_t i = 0; i < pressed_.size(); ++i)
      if (button_seen_[i]) out += fmt::format("  button {} {}", i, pressed_[i] ? "down" : "up");
    return out + "\n";
  }

 private:
  struct Cell {
    bool seen = false;
    link::CellReading reading;
    std::uint64_t lost = 0;
  };
  std::array<Cell, link::kMaxChannels> cells_;
  std::array<int, 8> adc_{-1, -1, -1, -1, -1, -1, -1, -1};
  std::array<bool, 8> button_seen_{};
  std::array<bool, 8> pressed_{};
  link::HostTime latest_;
};

/// One board, one stream of lines.
class Watch {
 public:
  enum class Style { people, json, csv };

  Watch(const BoardOptions& options, Style style, const std::string& path)
      : options_(options),
        style_(style),
        path_(path),
        out_(path, /*lossless=*/true),
        loop_(options.port, session_options(options)) {}

  int run() {
    if (!loop_.settle()) return 0;
    drop_samples();
    load_calibrations();
    if (style_ == Style::csv && !options_.seconds)
      log_info("writing to {}; Ctrl-C ends it", place());
    const TimePoint begin = clock_now();
    const TimePoint end =
        options_.seconds ? begin + in_seconds(*options_.seconds) : TimePoint::max();
    next_line_ = begin + period();
    bool good = style_ != Style::csv || write(kBoardCsvHeader);
    while (good && clock_now() < end) {
      if (!loop_.turn(style_ == Style::people ? std::min(end, next_line_) : end)) break;
      good = take_samples();
      if (good && style_ == Style::people && clock_now() >= next_line_) good = write_view();
    }
    if (good && style_ == Style::csv)
      log_info("{} samples and events written to {}", samples_, place());
    say_losses();
    if (!good) log_info(out_.failure());
    return good ? 0 : 1;
  }

 private:
  std::string place() const { return path_ == "-" ? "standard output" : path_; }

  /// What came while the clock was being settled; nobody asked for it, and some of it is lost.
  void drop_samples() {
    link::BoardSession& session = loop_.session();
    for (link::CellReading r; session.next(r);) {
    }
    for (link::AdcReading r; session.next(r);) {
    }
    overwritten_before_ = session.overwritten();
  }

  Duration period() const { return in_seconds(options_.line_period); }

  void load_calibrations() {
    cells_ = load_cells(options_, loop_.session());
    if (std::none_of(cells_.begin(), cells_.end(), [](const auto& c) { return c.calibrated; }))
      log_info(
          "the load cells are not calibrated: showing counts; `tagwrench board calibrate-cell` "
          "makes newtons of them");
  }

  bool take_samples() {
    link::BoardSession& session = loop_.session();
    bool good = true;
    for (link::CellReading r; good && session.next(r);) {
      loop_.cell_spoke(r.channel);
      view_.take(r);
      good = write_sample([&] { return json_line(r, cells_[r.channel]); },
                          [&] { return csv_line(r, cells_[r.channel]); });
    }
    for (link::AdcReading r; good && session.next(r);) good = take(r);
    for (link::ButtonReading r; good && session.next(r);) good = take(r);
    for (link::FaultReading r; good && session.next(r);)
      good = write_sample([&] { return json_line(r); }, [&] { return csv_line(r); });
    return good && flush();
  }

  template <class Reading>
  bool take(const Reading& reading) {
    view_.take(reading);
    return write_sample([&] { return json_line(reading); }, [&] { return csv_line(reading); });
  }

  template <class Json, class Csv>
  bool write_sample(const Json& json, const Csv& csv) {
    if (style_ == Style::people) return true;
    ++samples_;
    return write(style_ == Style::json ? json() : csv());
  }

  bool write_view() {
    next_line_ = clock_now() + period();
    if (!loop_.link().plugged()) return true;
    return write(view_.line(cells_, loop_, clock_now() - std::chrono::seconds(1))) && flush();
  }

  /// Lines that came together go out together.
  bool write(const std::string& text) {
    if (lines_.size() + text.size() > TextSink::kMaxBlock && !flush()) return false;
    lines_ += text;
    return true;
  }

  bool flush() {
    const bool good = lines_.empty() || out_.write(lines_) != SendStatus::failed;
    lines_.clear();
    return good;
  }

  void say_losses() {
    const link::SessionCounters counters = loop_.session().counters();
    const std::uint64_t lost =
        counters.lost_conversions + loop_.session().overwritten() - overwritten_before_;
    if (lost > 0 || counters.damaged_frames > 0)
      log_info("{} samples were lost, {} frames came damaged", lost, counters.damaged_frames);
  }

  const BoardOptions& options_;
  Style style_;
  std::string path_;
  TextSink out_;
  std::uint64_t samples_ = 0;  ///< written, events among them
  std::string lines_;
  BoardLoop loop_;
  link::CellCalibrations cells_{};
  BoardView view_;
  TimePoint next_line_{};
  std::uint64_t overwritten_before_ = 0;
};

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

int board_watch(const BoardOptions& options) {
  check_cells_file(options);
  return Watch(options, options.json ? Watch::Style::json : Watch::Style::people, "-").run();
}

int board_log(const BoardOptions& options) {
  check_cells_file(options);
  return Watch(options, Watch::Style::csv, options.out).run();
}

int board_optoforce(const BoardOptions& options) { return ForceWatch(options).run(); }

}  // namespace tagwrench

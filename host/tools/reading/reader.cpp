#include "host/tools/reading/reader.h"

#include <fmt/format.h>
#include <hidapi.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <memory>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/unique_fd.h"
#include "host/output/line_outputs.h"
#include "host/tools/reading/hid_text.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

constexpr double kMin_ns = 1e3;
const double kLogStep = std::log(1.02);

Duration from_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

std::int64_t ns(TimePoint time) {
  return std::chrono::duration_cast<Duration>(time.time_since_epoch()).count();
}

double ms(Duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

/// Appends to a buffer and stops at its end.
class Line {
 public:
  explicit Line(ReadingBuffer& buffer) : buffer_(buffer) {}

  template <class... Args>
  Line& put(fmt::format_string<Args...> format, Args&&... args) {
    const std::size_t room = buffer_.size() - used_;
    const auto result =
        fmt::format_to_n(buffer_.data() + used_, room, format, std::forward<Args>(args)...);
    used_ += std::min(room, result.size);
    return *this;
  }
  Line& list(const double (&values)[3], const char* between) {
    return put("{:.6f}{}{:.6f}{}{:.6f}", values[0], between, values[1], between, values[2]);
  }
  Line& counts(const PuckState& puck, const char* between) {
    for (std::size_t i = 0; i < puck.counts.size(); ++i)
      put("{}{}", i > 0 ? between : "", puck.counts[i]);
    return *this;
  }
  Line& latency(const std::optional<Duration>& value, const char* none) {
    if (!value) return put("{}", none);
    return put("{}", std::chrono::duration_cast<std::chrono::microseconds>(*value).count());
  }
  std::string_view view() const { return {buffer_.data(), used_}; }

 private:
  ReadingBuffer& buffer_;
  std::size_t used_ = 0;
};

/// hidapi waits on a descriptor that it keeps to itself, so that a signal is seen this much later
/// at most.
constexpr Duration kSlice = milliseconds(50);
constexpr Duration kRefresh = milliseconds(100);
constexpr Duration kLinePeriod = std::chrono::seconds(1);

TimePoint clock_now() { return std::chrono::steady_clock::now(); }

int whole_ms(Duration time) {
  const auto left = std::chrono::ceil<milliseconds>(std::max(time, Duration(0)));
  return static_cast<int>(std::min<std::int64_t>(left.count(), 60'000));
}

struct CloseHid {
  void operator()(hid_device* device) const { hid_close(device); }
};
using OpenHid = std::unique_ptr<hid_device, CloseHid>;

/// Columns of the terminal that standard output is; 0 if it is none.
int terminal_columns() {
  winsize size{};
  if (::isatty(STDOUT_FILENO) == 0) return 0;
  const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

/// Where readings go: live lines, JSON or CSV on standard output, and a log file.
class ReadingSink {
 public:
  explicit ReadingSink(const ReadOptions& options)
      : style_(options.style),
        columns_(style_ == ReadOptions::Style::people ? terminal_columns() : 0),
        out_("-", /*lossless=*/style_ != ReadOptions::Style::people) {
    if (!options.log.empty()) log_.emplace(options.log, /*lossless=*/true);
  }

  void begin(HidKind kind) {
    if (begun_) return;
    begun_ = true;
    if (style_ == ReadOptions::Style::csv) keep(out_, csv_header(kind));
    if (log_) keep(*log_, csv_header(kind));
  }
  void take(const Reading& reading) noexcept {
    if (style_ == ReadOptions::Style::json) keep(out_, json_line(buffer_, reading));
    if (style_ == ReadOptions::Style::csv) keep(out_, csv_line(buffer_, reading));
    if (log_) keep(*log_, csv_line(buffer_, reading));
  }
  /// A live line, if it is time for one; true if there was.
  bool show(const Reading& reading, const ReadingStats& lately, std::uint64_t missing,
            TimePoint now) noexcept {
    if (style_ != ReadOptions::Style::people || now < next_) return false;
    next_ = now + (columns_ > 0 ? kRefresh : kLinePeriod);
    std::string_view line = live_line(buffer_, reading, lately, missing);
    if (columns_ > 0) line = line.substr(0, static_cast<std::size_t>(columns_) - 1);
    const auto result = columns_ > 0
                            ? fmt::format_to_n(text_.data(), text_.size(), "\r{}\x1b[K", line)
                            : fmt::format_to_n(text_.data(), text_.size(), "{}\n", line);
    keep(out_, {text_.data(), std::min(result.size, text_.size())});
    open_line_ = columns_ > 0;
    return true;
  }
  /// What is told next begins on a line of its own.
  void end_line() noexcept {
    if (open_line_) keep(out_, "\n");
    open_line_ = false;
  }
  const std::string& failure() const noexcept { return failure_; }

 private:
  void keep(TextSink& sink, std::string_view text) noexcept {
    if (sink.write(text) == SendStatus::failed && failure_.empty()) failure_ = sink.failure();
  }

  ReadOptions::Style style_;
  int columns_;
  TextSink out_;
  std::optional<TextSink> log_;
  bool begun_ = false;
  bool open_line_ = false;  ///< the terminal's cursor stands behind a live line
  TimePoint next_{};
  std::string failure_;
  ReadingBuffer buffer_{};
  std::array<char, sizeof(ReadingBuffer) + 8> text_{};
};

class Reader {
 public:
  Reader(const ReadOptions& options, int stop_fd)
      : options_(options),
        choice_(options.device),
        stop_fd_(stop_fd),
        nodes_changed_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)),
        sink_(options) {
    // Watched before looking, so that no node comes unseen; udev gives permission after the node is
    // made.
    ::inotify_add_watch(nodes_changed_.get(), options.nodes.c_str(), IN_CREATE | IN_ATTRIB);
  }

  int run() {
    if (!open() && !options_.wait) {
      throw ConfigError(
          "no {} is plugged in; `tagwrench read --list` says what is, --wait waits for it",
          choice_.words());
    }
    if (!device_) log_info("waiting for a {}", choice_.words());
    const TimePoint begin = clock_now();
    end_ = options_.time ? begin + *options_.time : TimePoint::max();
    while (!stopped() && clock_now() < end_ && sink_.failure().empty()) {
      if (!device_) {
        wait_for_node();
      } else if (!read()) {
        lose();
        if (!options_.wait) break;
      }
    }
    return finish(clock_now() - begin);
  }

 private:
  bool stopped() const {
    pollfd stop{stop_fd_, POLLIN, 0};
    return ::poll(&stop, 1, 0) > 0;
  }

  /// The device that was read before, or the one that was asked for.
  std::optional<HidNode> find() const {
    const std::vector<HidNode> nodes = hid_nodes(options_.hidraw_class);
    if (!node_) return choice_.among(nodes);
    const auto again = std::find_if(nodes.begin(), nodes.end(),
                                    [&](const HidNode& node) { return node.is_again(*node_); });
    return again == nodes.end() ? std::nullopt : std::optional(*again);
  }

  /// False if it is not there, or (told once) may not be opened yet and waiting was asked for.
  bool open() {
    const std::optional<HidNode> found = find();
    if (!found) return false;
    device_.reset(hid_open_path(found->path.c_str()));
    if (!device_) {
      std::array<char, TAGWRENCH_TEXT_SIZE> why{};
      tagwrench_why_not_open(found->path.c_str(), found->vendor, found->product, why.data(),
                             why.size());
      if (!options_.wait) throw ConfigError(why.data());
      if (!refusal_told_) log_info(why.data());
      refusal_told_ = true;
      return false;
    }
    log_info("{} {}: {}", node_ ? "back," : "reading", found->label(), found->name);
    node_ = found;
    reading_ = {};
    reading_.kind = found->kind;
    refusal_told_ = false;
    sink_.begin(found->kind);
    return true;
  }

  void wait_for_node() {
    std::array<pollfd, 2> fds{{{nodes_changed_.get(), POLLIN, 0}, {stop_fd_, POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), whole_ms(end_ - clock_now()));
    alignas(inotify_event) std::array<char, 4096> events;
    while (::read(nodes_changed_.get(), events.data(), events.size()) > 0) {
    }
    open();
  }

  /// False if the device is gone.
  bool read() noexcept {
    const TimePoint before = clock_now();
    errno = 0;
    const int size = hid_read_timeout(device_.get(), report_.data(), report_.size(),
                                      whole_ms(std::min(kSlice, end_ - before)));
    if (size < 0) return errno == EINTR || stopped();
    const TimePoint now = clock_now();
    if (size > 0) take({report_.data(), static_cast<std::size_t>(size)}, now);
    // Of the second that has passed, or of the first one so far.
    const ReadingStats& lately = last_span_.reports > 1 ? last_span_ : span_;
    // What came last is shown even if nothing comes after it: a release, above all.
    if (unseen_ && sink_.show(reading_, lately, all_.missing, now)) unseen_ = false;
    return true;
  }

  void take(std::span<const std::uint8_t> report, TimePoint now) noexcept {
    reading_.time = now;
    if (!decode(report)) return;
    for (ReadingStats* stats : {&all_, &span_}) stats->arrived(now);
    if (reading_.kind == HidKind::wrench) count_sample();
    sink_.take(reading_);
    unseen_ = true;
    if (now < span_end_) return;
    last_span_ = span_;
    span_.next_span();
    span_end_ = now + kLinePeriod;
  }

  bool decode(std::span<const std::uint8_t> report) noexcept {
    if (reading_.kind == HidKind::wrench) {
      const bool good = tagwrench_decode(report.data(), report.size(), &reading_.wrench) > 0;
      if (!good) ++all_.strangers;
      return good;
    }
    using Change = PuckState::Change;
    const Change change = reading_.puck.take(report);
    if (change == Change::stranger) ++all_.strangers;
    return change == Change::motion || change == Change::buttons;
  }

  void count_sample() noexcept {
    reading_.missing = 0;
    if (reading_.wrench.capture_time_ns == 0) return;  // of no picture: has no sequence
    const std::uint64_t before = all_.missing;
    const std::optional<Duration> latency = latency_of(reading_);
    for (ReadingStats* stats : {&all_, &span_}) stats->sampled(reading_.wrench.sequence, latency);
    reading_.missing = static_cast<std::uint32_t>(all_.missing - before);
  }

  void lose() {
    device_.reset();
    unseen_ = false;
    all_.interrupted();
    span_.interrupted();
    lost_ = true;
    sink_.end_line();
    log_info("{}: gone: unplugged, or the bridge has ended; {}", node_->label(),
             options_.wait ? "waiting for it" : "--wait would wait for it");
  }

  int finish(Duration time) {
    sink_.end_line();
    if (node_) log_info(summary(*node_, all_, time));
    if (!sink_.failure().empty()) {
      log_info(sink_.failure());
      return 1;
    }
    return lost_ && !options_.wait ? 1 : 0;
  }

  const ReadOptions& options_;
  HidChoice choice_;
  int stop_fd_;
  UniqueFd nodes_changed_;
  ReadingSink sink_;
  OpenHid device_;
  std::optional<HidNode> node_;  ///< the one being read, or that was
  bool refusal_told_ = false, lost_ = false;
  TimePoint end_{};
  std::array<std::uint8_t, 256> report_{};
  Reading reading_;
  ReadingStats all_;
  ReadingStats span_;  ///< of the second that is running
  ReadingStats last_span_;
  bool unseen_ = false;  ///< reading_ has not been shown yet
  TimePoint span_end_{};
};

}  // namespace

void DurationHistogram::add(Duration value) noexcept {
  const double ratio = std::max(1.0, static_cast<double>(value.count()) / kMin_ns);
  const auto index = static_cast<std::size_t>(std::log(ratio) / kLogStep);
  ++classes_[std::min(index, classes_.size() - 1)];
  ++count_;
  max_ = std::max(max_, value);
}

Duration DurationHistogram::quantile(double part) const noexcept {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(count_)));
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < classes_.size(); ++i) {
    below += classes_[i];
    if (below >= wanted && below > 0) {
      const double upper_ns = kMin_ns * std::exp(kLogStep * static_cast<double>(i + 1));
      return std::min(max_, Duration(static_cast<Duration::rep>(upper_ns)));
    }
  }
  return max_;
}

void ReadingStats::arrived(TimePoint time) noexcept {
  ++reports;
  if (last) {
    const Duration interval = time - *last;
    const double s = std::chrono::duration<double>(interval).count();
    ++intervals;
    const double off = s - mean_s;
    mean_s += off / static_cast<double>(intervals);
    squares_s2 += off * (s - mean_s);
    interval_max = std::max(interval_max, interval);
  }
  last = time;
}

void ReadingStats::sampled(std::uint32_t sequence, std::optional<Duration> latency_of_it) noexcept {
  if (last_sequence) {
    const std::uint32_t between = tagwrench_missing(*last_sequence, sequence);
    missing += between;
    gaps += between > 0 ? 1 : 0;
  }
  last_sequence = sequence;
  if (latency_of_it) latency.add(*latency_of_it);
}

void ReadingStats::next_span() noexcept {
  *this = {.last = last, .last_sequence = last_sequence, .latency = {}};
}

Duration ReadingStats::interval_mean() const noexcept { return from_seconds(mean_s); }

Duration ReadingStats::interval_std() const noexcept {
  if (intervals == 0) return Duration(0);
  return from_seconds(std::sqrt(squares_s2 / static_cast<double>(intervals)));
}

std::optional<Duration> latency_of(const Reading& reading) noexcept {
  constexpr Duration kMax = std::chrono::seconds(10);  // beyond, the clocks are not one
  const std::chrono::nanoseconds captured(reading.wrench.capture_time_ns);
  const Duration latency = reading.time - TimePoint(captured);
  if (captured.count() == 0 || latency < Duration(0) || latency >= kMax) return std::nullopt;
  return latency;
}

std::string_view json_line(ReadingBuffer& buffer, const Reading& reading) noexcept {
  Line line(buffer);
  if (reading.kind == HidKind::puck) {
    line.put(R"({{"host_ns":{},"counts":[)", ns(reading.time)).counts(reading.puck, ",");
    return line.put("],\"buttons\":{}}}\n", reading.puck.buttons).view();
  }
  const tagwrench_sample& s = reading.wrench;
  line.put(R"({{"host_ns":{},"seq":{},"t_ns":{},"status":"{}","f_n":[)", ns(reading.time),
           s.sequence, s.capture_time_ns, tagwrench_status_name(s.status));
  line.list(s.force_n, ",").put("],\"m_nm\":[").list(s.torque_nm, ",").put("],\"w_sigma\":[");
  line.list(s.force_sigma_n, ",").put(",").list(s.torque_sigma_nm, ",");
  line.put("],\"dropped\":{},\"missing\":{},\"latency_us\":", s.lost, reading.missing);
  return line.latency(latency_of(reading), "null").put("}}\n").view();
}

std::string_view csv_header(HidKind kind) noexcept {
  if (kind == HidKind::puck) return "host_ns,x,y,z,rx,ry,rz,buttons\n";
  return "host_ns,seq,t_ns,status,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,sigma_fx_n,sigma_fy_n,sigma_fz_"
         "n,sigma_mx_nm,sigma_my_nm,sigma_mz_nm,dropped,missing,latency_us\n";
}

std::string_view csv_line(ReadingBuffer& buffer, const Reading& reading) noexcept {
  Line line(buffer);
  if (reading.kind == HidKind::puck) {
    line.put("{},", ns(reading.time)).counts(reading.puck, ",");
    return line.put(",{}\n", reading.puck.buttons).view();
  }
  const tagwrench_sample& s = reading.wrench;
  line.put("{},{},{},{},", ns(reading.time), s.sequence, s.capture_time_ns,
           tagwrench_status_name(s.status));
  line.list(s.force_n, ",").put(",").list(s.torque_nm, ",").put(",");
  line.list(s.force_sigma_n, ",").put(",").list(s.torque_sigma_nm, ",");
  line.put(",{},{},", s.lost, reading.missing);
  return line.latency(latency_of(reading), "").put("\n").view();
}

std::string_view live_line(ReadingBuffer& buffer, const Reading& reading,
                           const ReadingStats& lately, std::uint64_t missing) noexcept {
  Line line(buffer);
  if (reading.kind == HidKind::puck) {
    constexpr std::array<const char*, 6> kAxes = {"X", "Y", "Z", "RX", "RY", "RZ"};
    for (std::size_t i = 0; i < kAxes.size(); ++i)
      line.put("{}{:+5d} ", kAxes[i], reading.puck.counts[i]);
    line.put(" buttons {:x}", reading.puck.buttons);
  } else {
    const tagwrench_sample& s = reading.wrench;
    line.put("{:9}", tagwrench_status_name(s.status));
    line.put(" F {:+7.3f} {:+7.3f} {:+7.3f} N", s.force_n[0], s.force_n[1], s.force_n[2]);
    line.put("  M {:+8.4f} {:+8.4f} {:+8.4f} N m", s.torque_nm[0], s.torque_nm[1], s.torque_nm[2]);
  }
  line.put("  {:5.1f}/s, jitter {:.2f} ms, longest {:.1f}", lately.rate_hz(),
           ms(lately.interval_std()), ms(lately.interval_max));
  if (reading.kind == HidKind::wrench) {
    line.put(", missing {}", missing);
    if (const auto latency = latency_of(reading)) line.put(", latency {:.1f} ms", ms(*latency));
  }
  return line.view();
}

std::string summary(const HidNode& node, const ReadingStats& stats, Duration time) {
  std::string text = fmt::format(
      "{}: {} reports in {:.1f} s, {:.2f}/s, interval {:.2f} ms, standard deviation {:.2f}, "
      "longest {:.1f}",
      node.label(), stats.reports, 1e-3 * ms(time), stats.rate_hz(), ms(stats.interval_mean()),
      ms(stats.interval_std()), ms(stats.interval_max));
  if (node.kind == HidKind::wrench && stats.reports > 0) {
    const DurationHistogram& latency = stats.latency;
    text += fmt::format("; {} frames missing in {} gaps; ", stats.missing, stats.gaps);
    text += latency.count() == 0 ? "no latency: the capture times are of another clock"
                                 : fmt::format("latency median {:.2f} ms, p99 {:.2f}, max {:.2f}",
                                               ms(latency.quantile(0.5)),
                                               ms(latency.quantile(0.99)), ms(latency.max()));
  }
  if (stats.strangers > 0) text += fmt::format("; not understood: {}", stats.strangers);
  return text;
}

std::string list_text(const std::vector<HidNode>& nodes) {
  std::string text;
  for (const HidNode& node : nodes) {
    const PuckModel* model = puck_model(node.vendor, node.product);
    const std::string also =
        model == nullptr ? "" : fmt::format(", as {} ({} layout)", model->name, model->layout);
    text += fmt::format("{:6}  {:04x}:{:04x}  {:13}  {:16}  {}{}\n", name(node.kind), node.vendor,
                        node.product, node.path, node.serial.empty() ? "-" : node.serial,
                        node.name.empty() ? "-" : node.name, also);
  }
  return text;
}

int list_hid() {
  const std::vector<HidNode> nodes = hid_nodes(kHidrawClass);
  if (nodes.empty()) log_info("no wrench sensor or 6-DOF device is plugged in");
  TextSink out("-", /*lossless=*/true);
  if (out.write(list_text(nodes)) != SendStatus::failed) return 0;
  log_info(out.failure());
  return 1;
}

int read_hid(const ReadOptions& options, int stop_fd) { return Reader(options, stop_fd).run(); }

}  // namespace tagwrench

#include "host/tools/reading/reading_text.h"

#include <fmt/format.h>

namespace tagwrench {
namespace {

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
    for (std::size_t i = 0; i < puck.counts.size(); ++i) {
      put("{}{}", i > 0 ? between : "", puck.counts[i]);
    }
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

}  // namespace

std::optional<Duration> latency_of(const Reading& reading) noexcept {
  if (reading.wrench.capture_time_ns == 0) return std::nullopt;
  return plausible_latency(reading.time, capture_time(reading.wrench));
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
  return "host_ns,seq,t_ns,status,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,sigma_fx_n,sigma_fy_n,"
         "sigma_fz_n,sigma_mx_nm,sigma_my_nm,sigma_mz_nm,dropped,missing,latency_us\n";
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
    for (std::size_t i = 0; i < kAxes.size(); ++i) {
      line.put("{}{:+5d} ", kAxes[i], reading.puck.counts[i]);
    }
    line.put(" buttons {:x}", reading.puck.buttons);
  } else {
    const tagwrench_sample& s = reading.wrench;
    line.put("{:9}", tagwrench_status_name(s.status));
    line.put(" F {:+7.3f} {:+7.3f} {:+7.3f} N", s.force_n[0], s.force_n[1], s.force_n[2]);
    line.put("  M {:+8.4f} {:+8.4f} {:+8.4f} N m", s.torque_nm[0], s.torque_nm[1], s.torque_nm[2]);
  }
  line.put("  {:5.1f}/s, jitter {:.2f} ms, longest {:.1f}", lately.rate_hz(),
           ms(lately.interval_std()), ms(lately.interval_max()));
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
      node.label(), stats.reports(), 1e-3 * ms(time), stats.rate_hz(), ms(stats.interval_mean()),
      ms(stats.interval_std()), ms(stats.interval_max()));
  if (node.kind == HidKind::wrench && stats.reports() > 0) {
    const DurationHistogram& latency = stats.latency();
    text += fmt::format("; {} frames missing in {} gaps; ", stats.missing(), stats.gaps());
    text += latency.count() == 0 ? "no latency: the capture times are of another clock"
                                 : fmt::format("latency median {:.2f} ms, p99 {:.2f}, max {:.2f}",
                                               ms(latency.quantile(0.5)),
                                               ms(latency.quantile(0.99)), ms(latency.max()));
  }
  if (stats.strangers() > 0) text += fmt::format("; not understood: {}", stats.strangers());
  return text;
}

std::string list_text(const std::vector<HidNode>& nodes) {
  std::string text;
  for (const HidNode& node : nodes) {
    const PuckModel* model = puck_model(node.vendor, node.product);
    const std::string also =
        model == nullptr
            ? ""
            : fmt::format(", as {} ({} layout)", model->name,
                          model->layout == PuckLayout::unknown ? "any" : name(model->layout));
    text += fmt::format("{:6}  {:04x}:{:04x}  {:13}  {:16}  {}{}\n", name(node.kind), node.vendor,
                        node.product, node.path, node.serial.empty() ? "-" : node.serial,
                        node.name.empty() ? "-" : node.name, also);
  }
  return text;
}

}  // namespace tagwrench

#include "host/output/sample_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/output/output.h"

namespace tagwrench {
namespace {

constexpr std::string_view kJson =
    R"({{"seq":{},"t_ns":{},"status":"{}",)"
    R"("d_m":[{},{},{}],"d_rad":[{},{},{}],"d_sigma":[{},{},{},{},{},{}],)"
    R"("f_n":[{},{},{}],"m_nm":[{},{},{}],"w_sigma":[{},{},{},{},{},{}],)"
    R"("dropped":{},"latency_us":{}}})"
    "\n";

constexpr std::string_view kCsv =
    "{},{},{},"
    "{},{},{},{},{},{},{},{},{},{},{},{},"
    "{},{},{},{},{},{},{},{},{},{},{},{},"
    "{},{}\n";

template <typename Format>
std::string_view line(LineBuffer& buffer, Format format, const Sample& sample) noexcept {
  const Status status = shown_status(sample);
  const bool numbers = carries_numbers(status);
  static const Vector6 kZero = Vector6::Zero();
  const Vector6& d = numbers ? sample.displacement : kZero;
  const Vector6& ds = numbers ? sample.displacement_sigma : kZero;
  const Vector6& w = numbers ? sample.wrench : kZero;
  const Vector6& ws = numbers ? sample.wrench_sigma : kZero;
  const std::int64_t t_ns =
      std::chrono::duration_cast<Duration>(sample.capture_time.time_since_epoch()).count();
  const auto done = fmt::format_to_n(buffer.data(), buffer.size(), format, sample.sequence, t_ns,
                                     name(status),                              //
                                     d[0], d[1], d[2], d[3], d[4], d[5],        //
                                     ds[0], ds[1], ds[2], ds[3], ds[4], ds[5],  //
                                     w[0], w[1], w[2], w[3], w[4], w[5],        //
                                     ws[0], ws[1], ws[2], ws[3], ws[4], ws[5],  //
                                     sample.dropped, latency_us(sample));
  return {buffer.data(), std::min(done.size, buffer.size())};
}

}  // namespace

std::string_view json_line(LineBuffer& buffer, const Sample& sample) noexcept {
  return line(buffer, FMT_STRING(kJson), sample);
}

std::string_view csv_line(LineBuffer& buffer, const Sample& sample) noexcept {
  return line(buffer, FMT_STRING(kCsv), sample);
}

std::int64_t latency_us(const Sample& sample) noexcept {
  const auto late = std::chrono::duration_cast<std::chrono::microseconds>(sample.output_time -
                                                                          sample.latency_origin);
  return std::max<std::int64_t>(late.count(), 0);
}

}  // namespace tagwrench

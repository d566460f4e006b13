#include "host/web/server/live_figures.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace tagwrench {

void LiveWindow::add(TimePoint output_time, std::int64_t latency_us) {
  entries_.push_back({output_time, latency_us});
  while (entries_.size() > kMax || output_time - entries_.front().output_time > kSpan)
    entries_.pop_front();
}

LiveFigures LiveWindow::figures(TimePoint now) const {
  std::vector<std::int64_t> latencies;
  std::vector<double> intervals_us;
  const Entry* before = nullptr;
  for (const Entry& entry : entries_) {
    if (now - entry.output_time > kSpan) continue;
    latencies.push_back(entry.latency_us);
    if (before != nullptr) {
      const std::chrono::duration<double, std::micro> step =
          entry.output_time - before->output_time;
      intervals_us.push_back(step.count());
    }
    before = &entry;
  }
  LiveFigures out;
  if (latencies.empty()) return out;
  std::sort(latencies.begin(), latencies.end());
  const auto quantile = [&](double part) {
    return latencies[static_cast<std::size_t>(part * static_cast<double>(latencies.size() - 1) +
                                              0.5)];
  };
  out.latency_median_us = quantile(0.5);
  out.latency_p99_us = quantile(0.99);
  double sum = 0;
  double squares = 0;
  for (const double step : intervals_us) sum += step;
  if (sum <= 0) return out;
  const auto steps = static_cast<double>(intervals_us.size());
  const double mean = sum / steps;
  for (const double step : intervals_us) squares += (step - mean) * (step - mean);
  out.rate_hz = 1e6 / mean;
  out.jitter_us = std::llround(std::sqrt(squares / steps));
  return out;
}

}  // namespace tagwrench

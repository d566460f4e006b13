#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/core/json/json_text.h"
#include "host/tools/camera_timing/measurement.h"

namespace tagwrench {
namespace {

constexpr double kRolls = 5;  // standard deviations of a read-out that is one

/// As many digits as the uncertainty has two of, but no more than a microsecond's worth.
std::string with_sigma(double value, double sigma, const char* unit) {
  const double finest = 1e-4;
  const int digits =
      std::clamp(1 - static_cast<int>(std::floor(std::log10(std::max(sigma, finest)))), 0, 4);
  return fmt::format("{:.{}f} +/- {:.{}f} {}", value, digits, std::max(sigma, finest), digits,
                     unit);
}

std::string milliseconds(const Figure& figure) {
  if (!figure.known) return "cannot tell";
  return with_sigma(1e3 * figure.value, 1e3 * figure.sigma, "ms");
}

bool rolls(const CameraTimingResult& r) {
  return r.readout.known && std::abs(r.readout.value) > kRolls * r.readout.sigma &&
         std::abs(r.readout.value) > 1e-4;
}

std::string shutter(const CameraTimingResult& r) {
  if (!r.readout.known) return "";
  if (!rolls(r)) return "all rows at once: a global shutter";
  return r.readout.value > 0 ? "first row to last: a rolling shutter"
                             : "last row to first: a rolling shutter, upside down";
}

std::string percent(int part, int all) {
  return fmt::format("{} of {} ({:.1f} %)", part, all, all > 0 ? 100.0 * part / all : 0.0);
}

std::string line(const std::string& name, const std::string& value,
                 const std::string& remark = {}) {
  return remark.empty() ? fmt::format("{:<15}{}\n", name, value)
                        : fmt::format("{:<15}{:<26}{}\n", name, value, remark);
}

void add_latency(const CameraTimingMeasurement& m, std::string& lines) {
  const CameraTimingResult& r = m.result;
  lines += line("latency", milliseconds(r.latency),
                "mean, from the middle of the exposure to the kernel's time stamp");
  if (r.latency.known && r.timed > 0) {
    lines +=
        line("", fmt::format("{:.1f} to {:.1f} ms", 1e3 * r.latency_least, 1e3 * r.latency_most),
             fmt::format("median {:.1f}, 95 % within {:.1f}", 1e3 * r.latency_median,
                         1e3 * r.latency_95));
  }
  lines += line("jitter", milliseconds(r.jitter), "standard deviation of latency");
  lines += line("read-out", milliseconds(r.readout), shutter(r));
  lines += line("exposure", milliseconds(r.exposure), "of each row");
}

void add_processing(const CameraTimingMeasurement& m, const CameraTimingSetting& setting,
                    std::string& lines) {
  if (m.processing.empty()) return;
  const double median = quantile(m.processing, 0.5);
  lines += line("processing", fmt::format("{:.2f} ms", 1e3 * median),
                fmt::format("median, from time stamp to {}; 95 % within {:.2f} ms", setting.output,
                            1e3 * quantile(m.processing, 0.95)));
  if (m.result.latency.known) {
    lines += line("in all", fmt::format("{:.1f} ms", 1e3 * (m.result.latency.value + median)),
                  fmt::format("from light to {}", setting.output));
  }
}

/// Json: keys in alphabetical order or as written.
template <typename Json = nlohmann::json>
Json figure(const Figure& f) {
  if (!f.known) return nullptr;
  return {{"value", f.value}, {"sigma", f.sigma}};
}

}  // namespace

std::string report_text(const CameraTimingMeasurement& m, const CameraTimingSetting& setting) {
  const CameraTimingResult& r = m.result;
  std::string lines;
  lines += line("camera", setting.camera);
  lines += line("lamp", setting.lamp);
  lines += line("frame rate",
                r.frame_rate.known ? with_sigma(r.frame_rate.value, r.frame_rate.sigma, "Hz")
                                   : std::string("cannot tell"),
                setting.announced_period > 0
                    ? fmt::format("exposures; announced {:.5g} Hz", 1 / setting.announced_period)
                    : "exposures; none announced");
  lines += line("new pictures", fmt::format("{:.2f} a second", r.new_pictures_rate()));
  add_latency(m, lines);
  add_processing(m, setting, lines);
  lines += line("stale frames", percent(r.stale, r.frames),
                r.undecided > 0
                    ? fmt::format("that show the picture before them; of {} more it cannot be told",
                                  r.undecided)
                    : "that show the picture before them");
  lines +=
      line("missing", fmt::format("{} pictures", r.missing),
           fmt::format("by the light; the driver told of {}, stale frames took the place of {}",
                       r.dropped_by_driver, r.stale));
  if (r.strange > 0)
    lines += line("strange", percent(r.strange, r.frames), "that show the light of no time near");
  lines += line("light", fmt::format("{:.1f} % not the LED's", 100 * m.ambient_fraction),
                fmt::format("{:.0f} % of the picture used, {:.1f} % white", 100 * m.used_fraction,
                            100 * m.saturated_fraction));
  if (m.exposure_set_us > 0) {
    lines += line("", fmt::format("exposure {:.1f} ms", 1e-3 * m.exposure_set_us),
                  "set for this measurement, or the LED had made the picture white");
  }
  lines += line(
      "clock",
      m.edge_sigma > 0 ? fmt::format("+/- {:.3f} ms", 1e3 * m.edge_sigma) : std::string("the same"),
      "of the lamp's edges on this computer's clock");
  lines += line("pattern", fmt::format("bits of {:.3f} ms", 1e3 * m.bit),
                fmt::format("{} of {} pictures tell when they were taken", r.timed, r.frames));
  return lines;
}

std::string report_json(const CameraTimingMeasurement& m, const CameraTimingSetting& setting) {
  const CameraTimingResult& r = m.result;
  nlohmann::ordered_json json;
  json["format"] = "tagwrench-bandwidth-1";
  json["camera"] = setting.camera;
  json["lamp"] = setting.lamp;
  if (setting.announced_period > 0) json["announced_hz"] = 1 / setting.announced_period;
  json["frame_rate_hz"] = figure(r.frame_rate);
  json["new_pictures_hz"] = r.new_pictures_rate();
  json["latency_s"] = figure(r.latency);
  if (r.latency.known) {
    json["latency_quantiles_s"] = {{"least", r.latency_least},
                                   {"median", r.latency_median},
                                   {"95", r.latency_95},
                                   {"most", r.latency_most}};
  }
  json["jitter_s"] = figure(r.jitter);
  json["readout_s"] = figure(r.readout);
  json["rolling_shutter"] = r.readout.known ? nlohmann::json(rolls(r)) : nlohmann::json(nullptr);
  json["exposure_s"] = figure(r.exposure);
  if (!m.processing.empty()) {
    json["processing_s"] = {{"output", setting.output},
                            {"median", quantile(m.processing, 0.5)},
                            {"95", quantile(m.processing, 0.95)},
                            {"most", m.processing.back()}};
  }
  json["frames"] = {{"delivered", r.frames},
                    {"timed", r.timed},
                    {"stale", r.stale},
                    {"undecided", r.undecided},
                    {"strange", r.strange},
                    {"missing", r.missing},
                    {"driver_dropped", r.dropped_by_driver}};
  json["light"] = {{"ambient_part", m.ambient_fraction},
                   {"used_part", m.used_fraction},
                   {"saturated_part", m.saturated_fraction}};
  json["exposure_set_us"] = m.exposure_set_us > 0 ? nlohmann::json(m.exposure_set_us) : nullptr;
  json["bit_s"] = m.bit;
  json["edge_sigma_s"] = m.edge_sigma;
  return dump_json(json, 2) + "\n";
}

std::string report_text(const ScreenMeasurement& m, const std::string& camera,
                        const std::string& screen, double announced_period) {
  std::string lines;
  lines += line("camera", camera);
  lines += line("screen", screen);
  lines += line("frame rate",
                fmt::format("{:.3f} +/- {:.3f} Hz", m.frame_rate.value, m.frame_rate.sigma),
                announced_period > 0
                    ? fmt::format("by the time stamps; announced {:.5g} Hz", 1 / announced_period)
                    : "by the time stamps; none announced");
  lines += line("latency",
                fmt::format("{:.1f} +/- {:.1f} ms", 1e3 * m.latency.value, 1e3 * m.latency.sigma),
                "screen and camera together, to the kernel's time stamp");
  lines += line("round trip", fmt::format("{:.1f} ms", 1e3 * m.round_trip),
                "mean, from a flip to the arrival of the picture that shows it");
  lines += line("flips", fmt::format("{} seen, {} missed", m.flips, m.missed),
                fmt::format("{:.0f} grey levels between black and white", m.contrast));
  return lines;
}

std::string report_json(const ScreenMeasurement& m, const std::string& camera,
                        const std::string& screen, double announced_period) {
  nlohmann::ordered_json json;
  json["format"] = "tagwrench-screen-1";
  json["camera"] = camera;
  json["screen"] = screen;
  if (announced_period > 0) json["announced_hz"] = 1 / announced_period;
  json["frame_rate_hz"] = figure<nlohmann::ordered_json>(m.frame_rate);
  json["latency_s"] = figure<nlohmann::ordered_json>(m.latency);
  json["round_trip_s"] = m.round_trip;
  json["flips"] = {{"seen", m.flips}, {"missed", m.missed}};
  json["contrast_counts"] = m.contrast;
  return dump_json(json, 2) + "\n";
}

}  // namespace tagwrench

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/calibration/analysis/analysis.h"
#include "host/core/json/json_text.h"

namespace tagwrench::study {
namespace {

using nlohmann::json;
using Out = std::back_insert_iterator<std::string>;

std::string figure(double value, const char* unit = "") {
  return std::isfinite(value) ? fmt::format("{:.3g}{}", value, unit) : "-";
}

std::string percent(double value) {
  if (value > 1000) return ">1000";
  return std::isfinite(value) ? fmt::format("{:.2f}", value) : "-";
}

/// How far below nothing a prediction is does not matter in the end.
std::string score(double value, int decimals) {
  if (value < -10) return "<-10";
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "-";
}

/// Before the point; 0.07 has -1.
int digits(double value) { return static_cast<int>(std::floor(std::log10(value))) + 1; }

/// Of all ranges, so that they can be compared down the column: enough for four digits of the
/// smallest full scale, if that leaves room for the largest.
int range_decimals(const Analysis& a) {
  constexpr int kRoom = 9;  // digits
  int decimals = 0, most = kRoom;
  for (const AxisReport& axis : a.axis) {
    if (axis.full_scale <= 0) continue;
    if (axis.calibrated) decimals = std::max(decimals, 4 - digits(axis.full_scale));
    most = std::min(most, kRoom - digits(axis.full_scale));
  }
  return std::clamp(decimals, 0, std::clamp(most, 0, 7));
}

std::string times(double value) {
  if (value > 1000) return ">1000";
  return value < 0.1 ? "<0.1" : fmt::format("{:.3g}", value);
}

void add_head(Out out, const Analysis& a) {
  fmt::format_to(out, "{}\n", fmt::join(a.names, ", "));
  fmt::format_to(out, "{} readings at {:.1f} Hz, {} of the reference", a.readings, a.reading_rate,
                 a.references);
  if (a.reference_rate > 0) fmt::format_to(out, " at {:.1f} Hz", a.reference_rate);
  fmt::format_to(out, ", {:.1f} s; {} features, condition {:.0f}\n", a.seconds,
                 a.feature_names.size(), a.condition);
  if (a.reference_rate > 0) {
    fmt::format_to(
        out, "lag{}\n",
        a.lag.known ? ": " + lag_text(a.lag) + ", the same on all axes" : " not known; taken as 0");
  }
  fmt::format_to(out, "held out: {}\n\n", a.validation);
}

void add_scores(Out out, const Analysis& a) {
  fmt::format_to(out, "{:<5}{:>12}{:>12}  {:<4}{:>8}{:>8}{:>11}{:>7}{:>8}{:>7}{:>9}{:>8}\n", "axis",
                 "from", "to", "", "R2 in", "R2 held", "RMSE", "% FS", "non-lin", "hyst.",
                 "excited", "alone");
  // Predictions that a calibration brought have figures, whatever these data alone could show.
  const char* not_calibrated = a.own_predictions ? "  see below" : "  not calibrated";
  const int decimals = range_decimals(a);
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& x = a.axis[k];
    fmt::format_to(out, "{:<5}{:>12.{}f}{:>12.{}f}  {:<4}", kWrenchAxes[k], x.range_low, decimals,
                   x.range_high, decimals, kAxisUnits[k]);
    if (x.full_scale == 0) {
      fmt::format_to(out, "  not calibrated\n");
      continue;
    }
    fmt::format_to(out, "{:>8}{:>8} {:>10.3g} {:>6} {:>7} {:>6} {:>8} {:>7}{}\n",
                   score(x.r2_in_sample, 4), score(x.r2, 4), x.rmse, percent(x.rmse_percent),
                   percent(x.nonlinearity_percent), percent(x.hysteresis_percent),
                   times(x.excitation), times(x.independent), x.calibrated ? "" : not_calibrated);
  }
  fmt::format_to(out,
                 "R2 and RMSE held out, in the axis' unit; % of full scale; excited: times the "
                 "reference's noise, alone: the part\nthat the other axes do not tell\n\n");
}

void add_rest(Out out, const Analysis& a) {
  fmt::format_to(out, "{:<5}{:>12}{:>14}{:>13}{:>13}{:>11}{:>12}\n", "axis", "noise", "per root Hz",
                 "resolution", "drift per h", "creep", "within 95 %");
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& x = a.axis[k];
    const std::string coverage =
        std::isfinite(x.coverage) ? fmt::format("{:.1f} %", 100 * x.coverage) : "-";
    fmt::format_to(out, "{:<5}{:>12}{:>14}{:>13}{:>13}{:>11}{:>12}\n", kWrenchAxes[k],
                   figure(x.noise), figure(x.noise_density), figure(x.resolution),
                   figure(x.drift_per_hour), figure(x.creep_percent, " %"), coverage);
  }
  fmt::format_to(out, "- where these data hold no rest, or no hold long enough\n\n");
}

void add_cross_talk(Out out, const Analysis& a) {
  fmt::format_to(out, "error in % of full scale at full load of\n{:<5}", "");
  for (const char* name : kWrenchAxes) fmt::format_to(out, "{:>9}", name);
  fmt::format_to(out, "\n");
  for (std::size_t k = 0; k < 6; ++k) {
    fmt::format_to(out, "{:<5}", kWrenchAxes[k]);
    for (std::size_t j = 0; j < 6; ++j) {
      const double value = a.cross_talk(k, j);
      fmt::format_to(out, "{:>9}", std::isfinite(value) ? fmt::format("{:.2f}", value) : "-");
    }
    fmt::format_to(out, "\n");
  }
  fmt::format_to(out, "- where loads went together too much to tell\n");
  if (!a.weakest.empty()) {
    fmt::format_to(out, "excited least: {} ({:.1f} % of what independent axes would have)\n",
                   a.weakest, 100 * a.weakest_share);
  }
  fmt::format_to(out, "\n");
}

void add_folds(Out out, const Analysis& a) {
  if (a.folds.empty()) return;
  fmt::format_to(out, "{:<22}{:>9}", "held out, s", "lag, ms");
  for (const char* name : kWrenchAxes) fmt::format_to(out, "{:>9}", fmt::format("R2 {}", name));
  fmt::format_to(out, "\n");
  for (const Fold& fold : a.folds) {
    fmt::format_to(out, "{:<22}{:>9}", fmt::format("{:.2f} to {:.2f}", fold.from, fold.to),
                   !fold.lag_sought ? "-"
                   : fold.lag.known ? fmt::format("{:.1f}", 1e3 * fold.lag.value)
                                    : "?");
    for (const double r2 : fold.r2) fmt::format_to(out, "{:>9}", score(r2, 3));
    fmt::format_to(out, "\n");
  }
  fmt::format_to(out, "- where no lag was looked for, or the reference did no more than waver\n");
}

// What is not finite is written as null.

json vector(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

json matrix(const Eigen::MatrixXd& m) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) rows.push_back(vector(m.row(i).transpose()));
  return rows;
}

json lag_json(const Lag& lag) {
  return {{"known", lag.known},
          {"s", lag.value},
          {"sigma_s", lag.sigma},
          {"at_limit", lag.at_limit},
          {"explained", lag.explained}};
}

json axis_json(const AxisReport& x, std::size_t k) {
  return {{"axis", kWrenchAxes[k]},
          {"unit", kAxisUnits[k]},
          {"calibrated", x.calibrated},
          {"reason", x.reason},
          {"range", {x.range_low, x.range_high}},
          {"full_scale", x.full_scale},
          {"r2_in_sample", x.r2_in_sample},
          {"r2", x.r2},
          {"rmse", x.rmse},
          {"rmse_percent", x.rmse_percent},
          {"nonlinearity_percent", x.nonlinearity_percent},
          {"hysteresis_percent", x.hysteresis_percent},
          {"noise", x.noise},
          {"noise_density", x.noise_density},
          {"resolution", x.resolution},
          {"drift_per_hour", x.drift_per_hour},
          {"creep_percent", x.creep_percent},
          {"coverage", x.coverage},
          {"reference_noise", x.reference_noise},
          {"reference_step", x.reference_step},
          {"excitation", x.excitation},
          {"independent", x.independent}};
}

}  // namespace

std::string analysis_text(const Analysis& analysis) {
  std::string text;
  const auto out = std::back_inserter(text);
  add_head(out, analysis);
  add_scores(out, analysis);
  add_rest(out, analysis);
  add_cross_talk(out, analysis);
  add_folds(out, analysis);
  if (!analysis.warnings.empty()) text += '\n';
  for (const std::string& warning : analysis.warnings)
    fmt::format_to(out, "warning: {}\n", warning);
  return text;
}

std::string analysis_json(const Analysis& a, bool with_series) {
  json root = {{"format", "tagwrench-analysis-1"},
               {"trials", a.names},
               {"features", a.feature_names},
               {"readings", a.readings},
               {"references", a.references},
               {"seconds", a.seconds},
               {"reading_rate_hz", a.reading_rate},
               {"reference_rate_hz", a.reference_rate},
               {"validation", a.validation},
               {"lag", lag_json(a.lag)},
               {"matrix", matrix(a.matrix)},
               {"offset", vector(a.offset)},
               {"cross_talk_percent", matrix(a.cross_talk)},
               {"condition", a.condition},
               {"weakest", a.weakest},
               {"weakest_share", a.weakest_share},
               {"warnings", a.warnings}};
  for (std::size_t k = 0; k < 6; ++k) root["axes"].push_back(axis_json(a.axis[k], k));
  for (const Fold& fold : a.folds) {
    root["folds"].push_back({{"trial", fold.trial},
                             {"from_s", fold.from},
                             {"to_s", fold.to},
                             {"lag", lag_json(fold.lag)},
                             {"r2", fold.r2},
                             {"rmse", fold.rmse}});
  }
  if (with_series) {
    root["held_out"] = {{"t_s", vector(a.time)},
                        {"predicted", matrix(a.predicted)},
                        {"predicted_sigma", matrix(a.predicted_sigma)},
                        {"felt", matrix(a.felt)}};
  }
  // Names come from files of others and need not be UTF-8.
  return dump_json(root, 2) + "\n";
}

}  // namespace tagwrench::study

// What a certificate says, as the page and as JSON, and how people read its numbers.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/calibration/certificate/certificate.h"
#include "host/core/json/json_text.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

constexpr double kAlike = 0.05;
constexpr double kMinPercent = 0.01;
constexpr const char* kSpace = "\u00a0";  // does not break

struct Prefix {
  double factor;
  const char* text;
};

Prefix prefix_for(double value) {
  const double size = std::abs(value);
  if (size >= 0.9995 || size == 0) return {1, ""};
  if (size >= 0.9995e-3) return {1e3, "m"};
  if (size >= 0.9995e-6) return {1e6, "µ"};
  return {1e9, "n"};
}

const char* unit(int axis) { return axis < 3 ? "N" : "N\u00a0m"; }

/// A typographic minus.
std::string with_minus(std::string text) {
  if (!text.empty() && text[0] == '-') text.replace(0, 1, "−");
  return text;
}

/// The power of ten of the first of so many significant digits, after rounding.
int decade_of(double value, int digits) {
  const std::string text = fmt::format("{:.{}e}", value, digits - 1);
  return std::stoi(text.substr(text.find('e') + 1));
}

/// No minus before a zero.
std::string fixed(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  return text.find_first_of("123456789") == std::string::npos && text[0] == '-' ? text.substr(1)
                                                                                : with_minus(text);
}

/// In decimal notation where that is short.
std::string rounded(double value, int digits) {
  if (value == 0) return "0";
  const int decade = decade_of(value, digits);
  if (decade < -3 || decade > 4) return fmt::format("{:.{}e}", value, digits - 1);
  return fmt::format("{:.{}f}", value, std::max(0, digits - 1 - decade));
}

using study::Analysis;
using study::AxisReport;

// The look: one page of A4, and the same on a screen.
constexpr const char* kCertificateStyle = R"(
@page { size: A4; margin: 11mm 12mm 9mm 12mm }
* { box-sizing: border-box }
html { background: #fff; color: #1a1a1a }
body { margin: 0; font: 6.9pt/1.28 sans-serif }
@media screen { body { width: 186mm; margin: 8mm auto } }
h1 { font-size: 17pt; font-weight: 700; margin: 0; letter-spacing: -0.2pt }
h2 { font-size: 7.2pt; font-weight: 700; margin: 0 0 0.7mm 0; color: #14406b }
p { margin: 0 }
header { display: table; width: 100%; border-bottom: 1.2pt solid #14406b; padding-bottom: 1.6mm; margin-bottom: 2mm }
header > div { display: table-cell; vertical-align: bottom }
header p { font-size: 8pt; color: #555 }
header .id { text-align: right; font-size: 7.2pt }
header .id b { font-size: 9pt }
.columns { display: table; table-layout: fixed; width: 100%; margin-bottom: 2mm }
.columns > section { display: table-cell; width: 50%; vertical-align: top; padding-right: 4mm }
.columns > section:last-child { padding-right: 0 }
.wide-left > section:first-child { width: 62% }
.wide-left > section:last-child { width: 38% }
table { border-collapse: collapse }
.facts th { text-align: left; font-weight: 400; color: #666; padding: 0 3mm 0 0; vertical-align: top; white-space: nowrap }
.facts { table-layout: auto; width: 100% }
.facts th { width: 1% }
.facts td { padding: 0; overflow-wrap: anywhere }
code { font-family: inherit; font-variant-numeric: tabular-nums }
.axes { width: 100%; table-layout: fixed; margin-bottom: 0.6mm; font-size: 6.1pt; font-variant-numeric: tabular-nums }
.axes th { font-weight: 400; color: #666; text-align: right; padding: 0.2mm 0.7mm; vertical-align: bottom; line-height: 1.1 }
.axes thead tr:first-child th { text-align: center; color: #14406b }
.axes thead tr:last-child { border-bottom: 0.6pt solid #14406b }
.axes tbody tr { border-bottom: 0.3pt solid #ccc }
.axes tbody th { text-align: left; vertical-align: middle; font-weight: 700; color: #1a1a1a; font-size: 7.6pt }
.axes td { text-align: right; vertical-align: middle; padding: 0.75mm 0.7mm; white-space: nowrap }
.axes .first { border-left: 0.3pt solid #ccc }
.axes .no { text-align: left; overflow-wrap: anywhere; white-space: normal; color: #a11616; background: #fbf0f0; padding-left: 2mm }
.cross { width: 100%; margin-bottom: 0.4mm; font-size: 6.5pt; font-variant-numeric: tabular-nums }
.cross th { font-weight: 400; color: #666; padding: 0.2mm 0.6mm; text-align: right }
.cross td { text-align: right; padding: 0.35mm 0.6mm; border: 0.3pt solid #ddd }
.cross .self { background: #eee }
.cross .large { font-weight: 700; color: #a11616 }
.note { color: #666; font-size: 6pt; margin-bottom: 2mm }
.scatter svg, .traces svg { display: block; width: 100% }
.traces { margin-bottom: 2mm }
.red { color: #d62728 }
.black { color: #000 }
ul { margin: 0; padding-left: 3mm }
li { overflow-wrap: anywhere }
footer { display: table; width: 100%; border-top: 0.6pt solid #14406b; padding-top: 1mm; font-size: 5.8pt; line-height: 1.25; color: #555 }
footer > div { display: table-cell; vertical-align: top }
footer .sign { width: 52mm; padding-top: 8mm; padding-left: 6mm; text-align: center }
footer .sign::before { content: ""; display: block; border-top: 0.4pt solid #555; margin-bottom: 0.6mm }
)";

constexpr double kCrossTalkOfNote = 1;  // % of full scale: printed bold
constexpr std::size_t kHashShown = 16;  // hexadecimal digits; the JSON has them all
constexpr std::size_t kMaxData = 4;
constexpr double kMaxExcitation = 1000;
constexpr std::size_t kMaxName = 28;

/// At most `most` characters, the end replaced by an ellipsis.
std::string shortened(std::string_view text, std::size_t most) {
  std::size_t characters = 0;
  for (std::size_t i = 0; i < text.size(); ++characters) {
    if (characters + 1 == most) return std::string(text.substr(0, i)) + "…";
    i += std::max<std::size_t>(1, utf8_length(text.substr(i)));
  }
  return std::string(text);
}

std::string cell(const std::string& text, const char* attributes = "") {
  return fmt::format("<td{}>{}</td>", attributes, text);
}

std::string header(const Certificate& c) {
  return fmt::format(
      "<header><div><h1>Calibration certificate</h1><p>Six-axis force–torque sensor, tracked "
      "optically</p></div><div class=\"id\"><b>No. {}</b><br>issued {}<br>{}</div></header>\n",
      escaped(c.number), escaped(c.issued), escaped(c.software));
}

std::string fact_list(const char* title, const std::vector<Fact>& facts, const PageRoom& room) {
  std::string text = fmt::format("<section><h2>{}</h2><table class=\"facts\">", title);
  for (const Fact& fact : facts) {
    text += fmt::format("<tr><th>{}</th><td>{}</td></tr>", escaped(fact.name),
                        escaped(shortened(fact.value, room.fact_length)));
  }
  return text + "</table></section>";
}

std::string axis_row(const AxisReport& r, int axis, const PageRoom& room) {
  std::string row = fmt::format("<tr><th>{}</th>", kWrenchAxes[axis]);
  if (!r.calibrated) {
    return row +
           fmt::format("<td colspan=\"13\" class=\"no\"><b>Not calibrated.</b> {}</td></tr>\n",
                       escaped(shortened(r.reason, room.warning_length)));
  }
  row += cell(range_text(r.range_low, r.range_high, axis));
  const auto add_group = [&row](std::initializer_list<std::string> texts) {
    for (const std::string& text : texts)
      row += cell(text, &text == texts.begin() ? " class=\"first\"" : "");
  };
  add_group({std::isfinite(r.r2) ? fmt::format("{:.5f}", r.r2) : "–", load_text(r.rmse, axis),
             percent_text(r.rmse_percent),
             std::isfinite(r.coverage) ? fmt::format("{:.0f}\u00a0%", 100 * r.coverage) : "–"});
  add_group({percent_text(r.nonlinearity_percent), percent_text(r.hysteresis_percent),
             percent_text(r.creep_percent)});
  add_group({load_text(r.noise, axis), load_text(r.noise_density, axis),
             load_text(r.resolution, axis), load_text(r.drift_per_hour, axis)});
  // Masses have next to no noise.
  add_group({!(r.excitation > 0)             ? "–"
             : r.excitation < kMaxExcitation ? number_text(r.excitation)
                                             : ">1000"});
  return row + "</tr>\n";
}

nlohmann::ordered_json facts_json(const std::vector<Fact>& facts) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (const Fact& fact : facts) out[fact.name] = fact.value;
  return out;
}

std::string axes(const Analysis& a, const PageRoom& room) {
  std::string text = "<table class=\"axes\"><colgroup>";
  for (const double percent :
       {3.2, 15.0, 6.4, 8.4, 5.8, 5.6, 6.0, 6.0, 5.8, 8.2, 8.4, 8.2, 8.6, 4.4})
    text += fmt::format("<col style=\"width:{}%\">", percent);
  text +=
      "</colgroup><thead><tr><th></th><th></th><th colspan=\"4\" class=\"first\">held out</th><th "
      "colspan=\"3\" class=\"first\">shape, of full scale</th><th colspan=\"4\" class=\"first\">at "
      "rest</th><th class=\"first\"></th></tr><tr><th></th><th>range</th><th "
      "class=\"first\">R²</th><th>RMSE</th><th>of full<br>scale</th><th>in 95 "
      "%<br>interval</th><th "
      "class=\"first\">non-<br>linearity</th><th>hyster-<br>esis</th><th>creep</th><th "
      "class=\"first\">noise</th><th>density<br>per "
      "√Hz</th><th>resolu-<br>tion</th><th>drift/h</th><th "
      "class=\"first\">excita-<br>tion</th></tr></thead><tbody>\n";
  for (int axis = 0; axis < 6; ++axis) text += axis_row(a.axis[axis], axis, room);
  return text +
         fmt::format(
             "</tbody></table>\n<p class=\"note\">R² and RMSE are of single readings{}, their own "
             "noise and that of the reference included. Percentages are of the full scale loaded: "
             "the larger end of the range. – not told by these data.</p>\n",
             a.own_predictions ? ", predicted by the calibration's own fit without their step"
                               : "");
}

std::string cross_talk(const Analysis& a) {
  std::string text = "<h2>Cross-talk, % of full scale</h2><table class=\"cross\"><tr><th></th>";
  for (const char* name : kWrenchAxes) text += fmt::format("<th>{}</th>", name);
  text += "</tr>";
  for (int row = 0; row < 6; ++row) {
    text += fmt::format("<tr><th>{}</th>", kWrenchAxes[row]);
    for (int column = 0; column < 6; ++column) {
      const double value = a.cross_talk(row, column);
      const bool known =
          a.axis[row].calibrated && a.axis[column].calibrated && std::isfinite(value);
      const bool large = known && std::abs(value) >= kCrossTalkOfNote;
      text += cell(known ? fixed(value, 2) : "–", row == column ? " class=\"self\""
                                                  : large       ? " class=\"large\""
                                                                : "");
    }
    text += "</tr>";
  }
  return text +
         "</table><p class=\"note\">Row: the axis that errs; column: the one that is loaded; "
         "diagonal: error of gain.</p>";
}

std::string lag_of(const study::Lag& lag) {
  if (!lag.known) return "not found";
  std::string text = study::lag_text(lag);
  if (const std::size_t sign = text.find("+-"); sign != std::string::npos)
    text.replace(sign, 2, "±");
  return text + ", the same on all axes";
}

std::vector<Fact> conditions(const Analysis& a) {
  const bool moving = a.reference_rate > 0;
  std::vector<Fact> facts{
      {"Readings", fmt::format("{} in {} s, {} Hz", a.readings, number_text(a.seconds),
                               number_text(a.reading_rate))},
      {"Reference",
       moving ? fmt::format("{} readings, {} Hz", a.references, number_text(a.reference_rate))
              : "loads that hung still, without lag"}};
  if (moving) facts.push_back({"Lag", lag_of(a.lag)});
  if (!a.validation.empty()) facts.push_back({"Held out", a.validation});
  facts.push_back({"Conditioning", number_text(a.condition)});
  if (!a.weakest.empty()) facts.push_back({"Least excited", a.weakest});
  return facts;
}

std::string data(const Certificate& c) {
  std::string text = "<section><h2>Data</h2><table class=\"facts\">";
  for (std::size_t i = 0; i < std::min(c.data.size(), kMaxData); ++i) {
    text += fmt::format("<tr><th>{}</th><td>{} bytes, SHA-256 <code>{}…</code></td></tr>",
                        escaped(shortened(c.data[i].name, kMaxName)), c.data[i].bytes,
                        escaped(c.data[i].sha256.substr(0, kHashShown)));
  }
  if (c.data.size() > kMaxData) {
    text += fmt::format("<tr><th></th><td>and {} more, in the JSON</td></tr>",
                        c.data.size() - kMaxData);
  }
  return text + "</table></section>";
}

std::string remarks(const Analysis& a, const PageRoom& room) {
  const std::vector<std::string> in_the_table = study::excitation_warnings(a);
  std::string items;
  std::size_t count = 0;
  for (const std::string& warning : a.warnings) {
    if (std::ranges::find(in_the_table, warning) != in_the_table.end()) continue;
    if (++count <= room.warnings)
      items += fmt::format("<li>{}</li>", escaped(shortened(warning, room.warning_length)));
  }
  if (count > room.warnings)
    items += fmt::format("<li><b>{} more, in the JSON.</b></li>", count - room.warnings);
  if (items.empty()) return "<section><h2>Remarks: None.</h2></section>";
  return "<section><h2>Remarks</h2><ul>" + items + "</ul></section>";
}

constexpr const char* kDefinitions =
    "Held out: each part of the data is judged by a fit that has not seen it. R² and RMSE against "
    "the reference. Non-linearity: largest deviation of the binned mean from a line. Hysteresis: "
    "largest gap between rising and falling load. Creep: change during a constant load. "
    "Resolution: what two readings at rest tell apart at 95 %. Excitation: spread of the reference "
    "over its own noise. No accredited laboratory has taken part: the figures are as good as the "
    "reference or the masses.";

}  // namespace

std::string number_text(double value) {
  return std::isfinite(value) ? with_minus(rounded(value, 3)) : "–";
}

std::string percent_text(double value) {
  if (std::abs(value) < kMinPercent) return "<0.01\u00a0%";
  return std::isfinite(value) ? with_minus(rounded(value, 2)) + kSpace + "%" : "–";
}

std::string load_text(double value, int axis) {
  if (!std::isfinite(value)) return "–";
  const Prefix prefix = prefix_for(value);
  return fmt::format("{}{}{}{}", number_text(value * prefix.factor), kSpace, prefix.text,
                     unit(axis));
}

std::string range_text(double low, double high, int axis) {
  const double largest = std::max(std::abs(low), std::abs(high));
  if (!std::isfinite(largest)) return "–";
  const Prefix prefix = prefix_for(largest);
  if (low < 0 && high > 0 && std::abs(low + high) < kAlike * largest)
    return fmt::format("±{}{}{}{}", number_text(std::min(-low, high) * prefix.factor), kSpace,
                       prefix.text, unit(axis));
  const int decimals = std::max(0, 2 - decade_of(largest * prefix.factor, 3));
  return fmt::format("{}{}to{}{}{}{}{}", fixed(low * prefix.factor, decimals), kSpace, kSpace,
                     fixed(high * prefix.factor, decimals), kSpace, prefix.text, unit(axis));
}

std::string escaped(std::string_view text) {
  constexpr std::array<std::pair<char, const char*>, 5> kEntities{
      {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}}};
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    const char c = text[i];
    const auto entity = std::find_if(kEntities.begin(), kEntities.end(),
                                     [c](const auto& known) { return known.first == c; });
    if (length == 0)
      out += "\uFFFD";
    else if (length > 1)
      out += text.substr(i, length);
    else if (entity != kEntities.end())
      out += entity->second;
    else
      out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    i += std::max<std::size_t>(1, length);
  }
  return out;
}

std::string certificate_html(const Certificate& c, const std::string& scatter,
                             const std::string& traces, const PageRoom& room) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Calibration "
      "certificate {}</title><style>{}.scatter svg{{height:{:.1f}mm}} .traces "
      "svg{{height:{:.1f}mm}}</style></head><body>\n",
      escaped(c.number), kCertificateStyle, room.scatter_mm, room.traces_mm);
  page += header(c);
  page += "<div class=\"columns\">" + fact_list("Sensor", c.sensor, room) +
          fact_list("Calibration", c.procedure, room) + "</div>\n";
  page += axes(c.analysis, room);
  page +=
      "<div class=\"columns wide-left\"><section class=\"scatter\"><h2>This sensor, held out, "
      "against the reference</h2>" +
      scatter + "</section><section>" + cross_talk(c.analysis) +
      fact_list("Conditions", conditions(c.analysis), room) + "</section></div>\n";
  page +=
      "<section class=\"traces\"><h2>Over time, s, without pauses: <span "
      "class=\"black\">reference</span> and <span class=\"red\">this sensor, held out</span></h2>" +
      traces + "</section>\n";
  page += "<div class=\"columns\">" + data(c) + remarks(c.analysis, room) + "</div>\n";
  page += fmt::format(
      "<footer><div>{}</div><div class=\"sign\">Date, name and signature</div></footer>\n"
      "</body></html>\n",
      kDefinitions);
  return page;
}

std::string certificate_json(const Certificate& c) {
  nlohmann::ordered_json out{{"format", "tagwrench-certificate-1"},
                             {"number", c.number},
                             {"issued", c.issued},
                             {"software", c.software}};
  out["sensor"] = facts_json(c.sensor);
  out["calibration"] = facts_json(c.procedure);
  out["data"] = nlohmann::ordered_json::array();
  for (const CertificateData& d : c.data)
    out["data"].push_back({{"file", d.name}, {"sha256", d.sha256}, {"bytes", d.bytes}});
  out["analysis"] = parse_ordered_json(study::analysis_json(c.analysis, false));
  // Texts of files may hold anything; what is no UTF-8 is replaced.
  return dump_json(out, 1) + "\n";
}

}  // namespace tagwrench

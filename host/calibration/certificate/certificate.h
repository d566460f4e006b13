// Room calibration/certificate: an analysis -> one page, as HTML, PDF and JSON.
// In:  the figures of calibration/analysis, N and N m; facts about sensor, plan and program.
// Out: three files that bear the same number, a hash of the contents.
// Then: html.cpp, render.cpp.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench {

/// Texts may hold anything: whoever writes them into a format escapes them.
struct Fact {
  std::string name, value;
};

struct CertificateData {
  std::string name;    ///< of the file, without folders
  std::string sha256;  ///< 64 hexadecimal digits
  std::uintmax_t bytes = 0;
};

struct Certificate {
  std::string number;    ///< of its contents; empty until they are complete
  std::string issued;    ///< YYYY-MM-DD
  std::string software;  ///< "tagwrench 0.1.0"
  std::vector<Fact> sensor, procedure;
  std::vector<CertificateData> data;
  study::Analysis analysis;
};

/// The whole of it, SI units, one JSON object; its "analysis" is that of study::analysis_json().
std::string certificate_json(const Certificate& certificate);

// Numbers as people read them. The spaces in them do not break.

/// N or N m, with a prefix that leaves 1 to 999, three significant digits: "1.40 mN". What is not
/// finite is a dash.
std::string load_text(double value, int axis);

/// From low to high: "±0.45 N" where they are alike within 5 %, else "-0.450 to 0.900 N": three
/// significant digits of the larger, and as many decimals of the other.
std::string range_text(double low, double high, int axis);

/// Three significant digits, a dash for what is not finite.
std::string number_text(double value);

/// Two significant digits and a percent sign; "<0.01 %" for less, either way.
std::string percent_text(double value);

// The page: HTML that needs nothing else, for screens and for A4.

/// How much room the figures and the remarks get, where a page would overflow.
struct PageRoom {
  double scatter_mm = 68, traces_mm = 98;  ///< height of the figures
  std::size_t warnings = 8;                ///< shown; the page says how many more the JSON has
  std::size_t warning_length = 300;        ///< characters
  std::size_t fact_length = 160;           ///< characters
};

/// `scatter` and `traces` are SVG of ours; everything else is escaped.
std::string certificate_html(const Certificate& certificate, const std::string& scatter,
                             const std::string& traces, const PageRoom& room);

/// `text` with what HTML would take for markup written as entities, and without control characters;
/// what is no UTF-8 becomes U+FFFD.
std::string escaped(std::string_view text);

// The two figures, drawn by gnuplot.

/// Another program as a function: text in, text out. No shell.
struct Program {
  std::string name;     ///< looked up in PATH
  std::string package;  ///< of Debian, for the message where it is missing
};

/// Its standard output, with `input` as its standard input. Throws ConfigError if it is not
/// installed; std::runtime_error, with the last line of its standard error, if it fails or does not
/// end in time (it is ended then).
std::string run_program(const Program& program, const std::vector<std::string>& arguments,
                        std::string_view input, std::chrono::seconds patience);

struct PlotSize {
  int width = 0, height = 0;  ///< px of CSS, 96 an inch
};

/// SVG, without an XML declaration. Reads: predicted against reference, one panel an axis. Throw
/// ConfigError if gnuplot is not installed, std::runtime_error if it fails.
std::string scatter_svg(const study::Analysis& analysis, PlotSize size);

/// The same over time: reference black, ours red.
std::string traces_svg(const study::Analysis& analysis, PlotSize size);

// The three files.

struct RenderedCertificate {
  std::string html, pdf, json;
  int pages = 0;  ///< of the PDF; more than one only where even the smallest figures do not fit
};

/// Figures shrink and remarks are cut until the PDF is one page of A4. Throws ConfigError if
/// gnuplot or weasyprint is not installed, std::runtime_error if one fails.
RenderedCertificate render_certificate(const Certificate& certificate);

struct NamedText {
  std::filesystem::path path;
  std::string_view text;
};

/// Writes temporaries beside all of them, then gives them their names. What had a name before is
/// replaced if `replace`, and stays as it was if any of the files cannot be written. Throws
/// std::runtime_error, also where a file is in the way and not to be replaced.
void write_together(const std::vector<NamedText>& files, bool replace);

}  // namespace tagwrench

// The certificate's three files: what they say, that nothing of it is taken for markup or commands,
// that one page stays one page, and that they come all or none.
#include "host/calibration/certificate/certificate.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/core/config_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/calibration/certificate/example.h"

namespace tagwrench {
namespace {

using test::example_certificate;
namespace fs = std::filesystem;

/// Somewhere in PATH: to ask weasyprint for its version takes a second.
bool installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

#define NEEDS(program) \
  if (!installed(program)) GTEST_SKIP() << program << " is not installed"

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string html_of(const Certificate& c) { return certificate_html(c, "<svg/>", "<svg/>", {}); }

class Folder {
 public:
  fs::path operator/(const std::string& name) const { return path_ / name; }
  std::ptrdiff_t files() const { return std::distance(fs::directory_iterator(path_), {}); }

 private:
  test::TemporaryFolder temporary_;
  fs::path path_ = temporary_.path();
};

std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Quantity, HasThreeDigitsAndAPrefix) {
  EXPECT_EQ(load_text(0.0014, 0), "1.40\u00a0mN");
  EXPECT_EQ(load_text(-12.34, 2), "−12.3\u00a0N");
  EXPECT_EQ(load_text(3.21e-5, 4), "32.1\u00a0µN\u00a0m");
  EXPECT_EQ(load_text(0.99996, 0), "1.00\u00a0N");
  EXPECT_EQ(load_text(std::numeric_limits<double>::quiet_NaN(), 0), "–");
  EXPECT_EQ(range_text(-0.45, 0.46, 0), "±450\u00a0mN");
  EXPECT_EQ(range_text(-0.0057, 0.0009, 5), "−5.70\u00a0to\u00a00.90\u00a0mN\u00a0m");
  EXPECT_EQ(range_text(-1.75, -0.0004, 0), "−1.75\u00a0to\u00a00.00\u00a0N");
  EXPECT_EQ(range_text(-0.0004, 0.9996, 0), "0.00\u00a0to\u00a01.00\u00a0N");
  EXPECT_EQ(number_text(1234.5), "1234");
  EXPECT_EQ(number_text(0), "0");
  EXPECT_EQ(percent_text(0.123), "0.12\u00a0%");
  EXPECT_EQ(percent_text(-2.04), "−2.0\u00a0%");
  EXPECT_EQ(percent_text(0.0004), "<0.01\u00a0%");
}

TEST(CertificateHtml, SaysEveryFigureOfAnAxis) {
  const std::string page = html_of(example_certificate());
  for (const char* part :
       {"No. 0123456789AB", "0.99987", "2.84\u00a0mN", "0.71\u00a0%", "95\u00a0%", "0.12\u00a0%",
        "0.080\u00a0%", "160\u00a0µN", "40.0\u00a0µN", "440\u00a0µN", "1.20\u00a0mN", "340",
        "the readings come 41.2 ± 0.7 ms after the reference", "34.5", "of single readings",
        "– not told by these data", "aaaaaaaaaaaaaaaa…", "masses-three-mountings",
        "the reference lags by 41 ms"}) {
    EXPECT_TRUE(holds(page, part)) << part;
  }
}

TEST(CertificateHtml, NamesAnAxisThatIsNotCalibratedAndGivesNoFigureOfIt) {
  Certificate c = example_certificate();
  c.analysis.axis[5].r2 = 0.12345;
  const std::string page = html_of(c);
  EXPECT_TRUE(holds(page, "Not calibrated."));
  EXPECT_TRUE(holds(page, "no torque about z was applied"));
  EXPECT_FALSE(holds(page, "0.12345"));
}

TEST(CertificateHtml, TextsOfFilesAreNoMarkup) {
  Certificate c = example_certificate();
  const std::string attack = "<script>alert('x')</script>&\"\x01\xff";
  c.sensor[0] = {attack, attack};
  c.procedure[0] = {attack, attack};
  c.data[0] = {attack, attack, 1};
  c.analysis.warnings = {attack};
  c.analysis.weakest = attack;
  c.analysis.axis[5].reason = attack;
  c.number = c.issued = c.software = attack;
  const std::string page = html_of(c);
  EXPECT_FALSE(holds(page, "<script>"));
  EXPECT_FALSE(holds(page, "alert('x')"));
  EXPECT_FALSE(holds(page, "\x01"));
  EXPECT_FALSE(holds(page, "\xff"));
  EXPECT_TRUE(holds(page, "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;&quot; \uFFFD"));
}

TEST(CertificateHtml, BrokenUtf8BecomesReplacementCharacters) {
  EXPECT_EQ(escaped("21 °C"), "21 °C");
  EXPECT_EQ(escaped("a\xc2"), "a\uFFFD");
  EXPECT_EQ(escaped("\xc0\xaf"), "\uFFFD\uFFFD");
  EXPECT_EQ(escaped("\xed\xa0\x80"), "\uFFFD\uFFFD\uFFFD") << "half of a surrogate pair";
}

TEST(CertificateHtml, WhatTheTableSaysIsNotRepeated) {
  Certificate c = example_certificate();
  c.analysis.warnings = {"Mz: not calibrated: " + c.analysis.axis[5].reason, "other"};
  const std::string page = html_of(c);
  EXPECT_FALSE(holds(page, "<li>Mz: not calibrated"));
  EXPECT_TRUE(holds(page, "<li>other</li>"));
}

TEST(CertificateHtml, LoadsThatHangHaveNoLag) {
  Certificate c = example_certificate();
  c.analysis.reference_rate = 0;
  EXPECT_FALSE(holds(html_of(c), "ms after"));
  EXPECT_TRUE(holds(html_of(c), "hung still"));
}

TEST(CertificateHtml, NoRemarkIsSaidToBeNone) {
  Certificate c = example_certificate();
  c.analysis.warnings.clear();
  EXPECT_TRUE(holds(html_of(c), "Remarks: None."));
}

TEST(CertificateHtml, RemarksThatDoNotFitAreCounted) {
  Certificate c = example_certificate();
  c.analysis.warnings.assign(20, "w");
  EXPECT_TRUE(holds(html_of(c), "12 more, in the JSON"));
}

TEST(CertificateJson, HoldsWhatThePageHoldsInSiUnits) {
  const nlohmann::json json = nlohmann::json::parse(certificate_json(example_certificate()));
  EXPECT_EQ(json["format"], "tagwrench-certificate-1");
  EXPECT_EQ(json["calibration"]["Plan"], "masses-three-mountings");
  const nlohmann::json& analysis = json["analysis"];
  EXPECT_EQ(analysis["axes"].size(), 6u);
  EXPECT_NEAR(analysis["axes"][0]["rmse"].get<double>(), 0.00284, 1e-12);
  EXPECT_EQ(analysis["axes"][5]["calibrated"], false);
  EXPECT_NEAR(analysis["lag"]["s"].get<double>(), 0.0412, 1e-12);
  EXPECT_EQ(json["data"][0]["sha256"], std::string(64, 'a'));
  EXPECT_NEAR(analysis["cross_talk_percent"][2][0].get<double>(), 1.4, 1e-12);
}

TEST(CertificateJson, SurvivesNumbersAndTextsThatJsonHasNot) {
  Certificate c = example_certificate();
  c.analysis.axis[0].r2 = std::numeric_limits<double>::quiet_NaN();
  c.analysis.axis[1].noise = std::numeric_limits<double>::infinity();
  c.analysis.axis[2].noise = study::kNaN;
  c.analysis.lag.known = false;
  c.sensor[0].value = "\xff";
  const nlohmann::json json = nlohmann::json::parse(certificate_json(c));
  EXPECT_TRUE(json["analysis"]["axes"][0]["r2"].is_null());
  EXPECT_TRUE(json["analysis"]["axes"][1]["noise"].is_null());
  EXPECT_TRUE(json["analysis"]["axes"][2]["noise"].is_null());
}

TEST(Program, GivesItsOutputForItsInput) {
  EXPECT_EQ(run_program({"cat", "coreutils"}, {}, "a\nb", std::chrono::seconds(60)), "a\nb");
}

TEST(Program, ThatIsMissingIsNamedWithItsPackage) {
  try {
    run_program({"tagwrench-no-such-program", "its-package"}, {}, "", std::chrono::seconds(60));
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_TRUE(holds(e.what(), "tagwrench-no-such-program")) << e.what();
    EXPECT_TRUE(holds(e.what(), "apt install its-package")) << e.what();
  }
}

TEST(Program, ThatFailsSaysWhy) {
  try {
    run_program({"cat", "coreutils"}, {"/no/such/file"}, "", std::chrono::seconds(60));
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_TRUE(holds(e.what(), "cat failed")) << e.what();
    EXPECT_TRUE(holds(e.what(), "/no/such/file")) << e.what();
  }
}

TEST(Program, ThatDoesNotEndIsEnded) {
  EXPECT_THROW(run_program({"sleep", "coreutils"}, {"1000"}, "", std::chrono::seconds(0)),
               std::runtime_error);
}

TEST(Plots, DrawASvgOfItsOwn) {
  NEEDS("gnuplot");
  const Certificate c = example_certificate();
  const std::string svg = traces_svg(c.analysis, {700, 300});
  EXPECT_EQ(svg.rfind("<svg", 0), 0u);
  EXPECT_TRUE(holds(svg, "Fx"));
  EXPECT_TRUE(holds(svg, "not calibrated"));
  EXPECT_LT(svg.size(), 400'000u) << "thinned to what paper shows";
  EXPECT_TRUE(holds(scatter_svg(c.analysis, {400, 200}), "not calibrated"));
}

TEST(Plots, OfHoldsAndOfNothingDoNotFail) {
  NEEDS("gnuplot");
  study::Analysis a;
  EXPECT_TRUE(holds(traces_svg(a, {700, 300}), "not calibrated"));
  a = example_certificate().analysis;
  const Eigen::Index few = 3;
  a.time = a.time.head(few).eval();
  a.felt = Eigen::MatrixXd::Zero(few, 6);
  a.predicted = Eigen::MatrixXd::Constant(few, 6, std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(holds(traces_svg(a, {700, 300}), "<svg"));
  EXPECT_TRUE(holds(scatter_svg(a, {400, 200}), "<svg"));
}

TEST(Plots, PausesBetweenSlowReadingsStayShort) {
  NEEDS("gnuplot");
  study::Analysis a = example_certificate().analysis;
  constexpr Eigen::Index kReadings = 80;  // a second apart; ten segments, 70 s
  a.time = Eigen::VectorXd::LinSpaced(kReadings, 0, kReadings - 1);
  a.felt = a.felt.topRows(kReadings).eval();
  a.predicted = a.predicted.topRows(kReadings).eval();
  a.segment.resize(kReadings);
  for (Eigen::Index i = 0; i < kReadings; ++i) a.segment[i] = static_cast<int>(i / 8);
  const std::string svg = traces_svg(a, {700, 300});
  EXPECT_TRUE(holds(svg, ">100<"));
  EXPECT_FALSE(holds(svg, ">150<") || holds(svg, ">200<")) << "mostly pauses";
}

TEST(RenderedCertificate, IsOnePage) {
  NEEDS("gnuplot");
  NEEDS("weasyprint");
  const RenderedCertificate rendered = render_certificate(example_certificate());
  EXPECT_EQ(rendered.pages, 1);
  EXPECT_EQ(rendered.pdf.rfind("%PDF-", 0), 0u);
  EXPECT_TRUE(holds(rendered.html, "<svg"));
  EXPECT_FALSE(holds(rendered.html, "src="));
}

TEST(RenderedCertificate, IsOnePageWithAllThatCanGoWrong) {
  NEEDS("gnuplot");
  NEEDS("weasyprint");
  Certificate c = example_certificate();
  for (study::AxisReport& axis : c.analysis.axis) {
    axis.calibrated = false;
    axis.reason = std::string(400, 'x');
  }
  c.analysis.warnings.assign(40, std::string(30, 'W') + " " + std::string(600, 'w'));
  for (Fact& fact : c.procedure) fact.value = std::string(1000, 'y');
  for (Fact& fact : c.sensor) fact.value = std::string(1000, 'z');
  c.data.assign(30, {std::string(200, 'd') + ".csv", std::string(64, 'b'), 1});
  EXPECT_EQ(render_certificate(c).pages, 1);
}

TEST(WriteTogether, WritesAllAndLeavesNothingElse) {
  const Folder folder;
  write_together({{folder / "a", "1"}, {folder / "b", "2"}}, false);
  EXPECT_EQ(contents(folder / "a"), "1");
  EXPECT_EQ(contents(folder / "b"), "2");
  EXPECT_EQ(folder.files(), 2);
  write_together({{folder / "a", "3"}, {folder / "b", "4"}}, true);
  EXPECT_EQ(contents(folder / "a"), "3");
  EXPECT_EQ(contents(folder / "b"), "4");
  EXPECT_EQ(folder.files(), 2);
}

TEST(WriteTogether, WhatIsThereIsNotReplacedUnasked) {
  const Folder folder;
  write_together({{folder / "b", "old"}}, false);
  EXPECT_THROW(write_together({{folder / "a", "1"}, {folder / "b", "2"}}, false),
               std::runtime_error);
  EXPECT_EQ(contents(folder / "b"), "old");
  EXPECT_EQ(folder.files(), 1) << "nor is the first of the two there";
}

TEST(WriteTogether, FilesComeBackIfALaterOneCannotBeWritten) {
  const Folder folder;
  write_together({{folder / "a", "old"}}, false);
  fs::create_directory(folder / "b");
  EXPECT_THROW(write_together({{folder / "a", "1"}, {folder / "b", "2"}}, true),
               std::runtime_error);
  EXPECT_EQ(contents(folder / "a"), "old");
  EXPECT_TRUE(fs::is_directory(folder / "b"));
  EXPECT_EQ(folder.files(), 2);
  EXPECT_THROW(write_together({{folder / "a", "1"}, {folder / "no" / "c", "2"}}, true),
               std::runtime_error);
  EXPECT_EQ(contents(folder / "a"), "old");
}

}  // namespace
}  // namespace tagwrench

// `tagwrench certificate` and `tagwrench design` as people run them: what they write, and what they
// refuse in one line with nothing written.
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/calibration/analysis/trial_csv.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

/// A minute of six loads moving independently of each other, and readings that follow them.
std::string data() {
  constexpr Eigen::Index kCount = 1500;
  study::Trial trial;
  trial.name = "made by hand";
  trial.feature_names = study::displacement_names();
  trial.time.resize(kCount);
  trial.features.resize(kCount, 6);
  trial.reference_time.resize(kCount);
  trial.reference.resize(kCount, 6);
  for (Eigen::Index i = 0; i < kCount; ++i) {
    const double t = 0.04 * static_cast<double>(i);
    trial.time[i] = trial.reference_time[i] = t;
    for (int axis = 0; axis < 6; ++axis) {
      const double load =
          std::sin((1.1 + 0.37 * axis) * t) + 0.4 * std::sin((0.3 + 0.11 * axis) * t);
      const double noise = 1e-3 * std::sin(1e4 * (axis + 1) * t);
      trial.reference(i, axis) = (axis < 3 ? 1.0 : 0.01) * load;
      trial.features(i, axis) = (axis < 3 ? 1e-3 : 0.05) * (load + noise);
    }
  }
  return study::trial_to_csv(trial);
}

class CertificateInput : public testing::Test {
 protected:
  void SetUp() override { write_file(temporary_ / "some.data.csv", data()); }

  void expect_refused(const Outcome& outcome, const std::vector<std::string>& parts) {
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
    for (const std::string& part : parts) {
      EXPECT_NE(outcome.err.find(part), std::string::npos)
          << "no '" << part << "' in: " << outcome.err;
    }
  }
  Outcome certify(std::vector<std::string> more) {
    more.insert(more.begin(), "certificate");
    return run_bridge(more);
  }
  std::string name(const std::string& file) const { return temporary_ / file; }
  std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(temporary_.path()), {});
  }

  TemporaryFolder temporary_;
};

TEST_F(CertificateInput, WhatCannotBeCertifiedIsRefusedAndNothingIsWritten) {
  expect_refused(certify({"--out", name("c")}), {"nothing to certify", "--calibration"});
  expect_refused(certify({"--out", name("no/such/c"), name("some.data.csv")}),
                 {"no/such", "--out"});
  expect_refused(certify({"--out", name("c"), name("none.data.csv")}), {"none.data.csv"});
  expect_refused(certify({"--out", name("c"), "--calibration", name("none.json")}), {"none.json"});
  write_file(name("other.json"), "{\"format\": \"other\"}");
  expect_refused(certify({"--out", name("c"), "--calibration", name("other.json")}),
                 {"other.json", "format"});
  write_file(name("short.data.csv"), "# tagwrench-data-1\nkind,t_s\n");
  expect_refused(certify({"--out", name("c"), name("short.data.csv")}), {"short.data.csv"});
  EXPECT_EQ(files(), 3);
}

TEST_F(CertificateInput, AnExistingFileIsKeptUnlessForced) {
  write_file(name("c.pdf"), "mine");
  expect_refused(certify({"--out", name("c"), name("some.data.csv")}), {"c.pdf", "--force"});
  EXPECT_EQ(read_file(name("c.pdf")), "mine");
  EXPECT_EQ(files(), 2);
}

TEST_F(CertificateInput, AMissingProgramIsNamedWithItsPackage) {
  Outcome outcome = Bridge({"PATH=/nonexistent", TAGWRENCH_PROGRAM, "certificate", "--out",
                            name("c"), name("some.data.csv")},
                           "/dev/null", "/usr/bin/env")
                        .finish();
  expect_refused(outcome, {"gnuplot", "apt install gnuplot-nox"});
  EXPECT_EQ(files(), 1);
}

TEST_F(CertificateInput, ThreeFilesSayTheSame) {
  if (!std::filesystem::exists("/usr/bin/gnuplot") ||
      !std::filesystem::exists("/usr/bin/weasyprint")) {
    GTEST_SKIP() << "gnuplot or weasyprint is not installed";
  }
  const Outcome outcome =
      certify({"--out", name("c"), "--environment", "<b>21</b> C", name("some.data.csv")});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  const std::string html = read_file(name("c.html"));
  EXPECT_EQ(html.find("<b>21"), std::string::npos);
  EXPECT_EQ(read_file(name("c.pdf")).rfind("%PDF-", 0), 0u);
  const nlohmann::json json = nlohmann::json::parse(read_file(name("c.json")));
  EXPECT_NE(html.find("No. " + json["number"].get<std::string>()), std::string::npos);
  EXPECT_GT(json["analysis"]["axes"][5]["r2"].get<double>(), 0.999);
  EXPECT_EQ(files(), 4);
}

TEST(Design, PrintsThePublishedFigures) {
  const Outcome outcome = run_bridge({"design"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* figure : {"10 bits", "11 bits", "0.0075 mm", "0.0702 mm", "0.1386 deg",
                             "0.5121 deg", "81.18 px", "21.97 px", "2.08", "1.02", "83.3", "40.8",
                             "printed as 11 bits", "divides the chord by 150"}) {
    EXPECT_NE(outcome.out.find(figure), std::string::npos) << figure << "\n" << outcome.out;
  }
  EXPECT_NE(outcome.err.find("leave the image"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.out.find("(1)"), std::string::npos);
}

TEST(Design, SaysWhatWasNotReachedAndRepeatsNoRow) {
  const Outcome stiff =
      run_bridge({"design", "--axial-n-per-mm", "5000", "--lateral-n-per-mm", "5000"});
  ASSERT_EQ(stiff.status, 0) << stiff.err;
  EXPECT_NE(stiff.out.find("beyond 1000 N"), std::string::npos) << stiff.out;
  EXPECT_EQ(stiff.out.find("1000.00"), std::string::npos);
  EXPECT_NE(stiff.out.find("\n  given "), std::string::npos);
  EXPECT_NE(stiff.out.find("under +- 1 N"), std::string::npos);
}

TEST(Design, RefusesWhatCannotBeBuilt) {
  const auto refused = [](std::vector<std::string> options, const std::string& part) {
    options.insert(options.begin(), "design");
    const Outcome outcome = run_bridge(options);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  };
  refused({"--fps", "nan"}, "--fps");
  refused({"--mass-g", "0"}, "--mass-g");
  refused({"--camera", "640"}, "WIDTHxHEIGHT");
  refused({"--image-px", "700x240"}, "no way to move");
  refused({"--wire-mm", "5"}, "--wire-mm");
  refused({"--ids", "1,2,3"}, "--ids");
  refused({"--family", "none"}, "--family");
  refused({"--sensor", "none.yaml"}, "none.yaml");
  refused({"--tag-with-border-mm", "3"}, "--tag-with-border-mm");
}

TEST(Design, TakesCameraAndTagsFromASensor) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_bridge({"sim", "--out", folder.path(), "--frames", "1"}).status, 0);
  const Outcome outcome = run_bridge({"design", "--sensor", folder / "sensor.yaml"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("11 bits"), std::string::npos) << outcome.out;
  const Outcome both =
      run_bridge({"design", "--sensor", folder / "sensor.yaml", "--camera", "640x480"});
  EXPECT_EQ(both.status, 2) << both.err;
}

}  // namespace
}  // namespace tagwrench::test

// hardware/bom.csv: complete, dated, with sources, and what each sensor costs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>

#include "documents.h"
#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

using documents::number;
using documents::Row;

const std::string kSensors = TAGWRENCH_SOURCE_DIR "/hardware/sensors";

/// Not sensors, but what goes with one.
const std::set<std::string> kExtras{"board", "load_cell", "coin_cell", "calibration"};

std::set<std::string> words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

std::vector<Row> bill_of(const std::string& variant) {
  std::vector<Row> out;
  for (const Row& row : documents::csv("hardware/bom.csv")) {
    const std::set<std::string> of = words(row.at("variant"));
    if (of.contains(variant) || (of.contains("all") && !kExtras.contains(variant)))
      out.push_back(row);
  }
  return out;
}

double cost(const std::vector<Row>& bill, const std::string& price) {
  double sum = 0;
  for (const Row& row : bill) sum += number(row.at("quantity")) * number(row.at(price));
  return sum;
}

std::vector<Row> rows_of(const std::vector<Row>& bill, const std::string& part) {
  std::vector<Row> out;
  std::copy_if(bill.begin(), bill.end(), std::back_inserter(out),
               [&](const Row& row) { return row.at("part") == part; });
  return out;
}

std::vector<std::filesystem::path> sensors() {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::directory_iterator(kSensors))
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

TEST(Bill, SaysOfEveryPartHowManyAtWhatPriceFromWhen) {
  std::set<std::string> known = kExtras;
  known.insert("all");
  for (const auto& path : sensors()) known.insert(path.stem());
  for (const Row& row : documents::csv("hardware/bom.csv")) {
    SCOPED_TRACE(row.at("part"));
    EXPECT_FALSE(row.at("part").empty());
    EXPECT_FALSE(row.at("look_for").empty());
    EXPECT_FALSE(row.at("source").empty());
    EXPECT_GT(number(row.at("quantity")), 0);
    EXPECT_GE(number(row.at("price_low_usd")), 0);
    EXPECT_LE(number(row.at("price_low_usd")), number(row.at("price_high_usd")));
    EXPECT_TRUE(std::regex_match(row.at("price_date"), std::regex(R"(20\d\d-(0[1-9]|1[0-2]))")));
    for (const std::string& variant : words(row.at("variant")))
      EXPECT_TRUE(known.contains(variant)) << variant;
  }
}

TEST(Bill, OfEverySensorIsCompleteAndAgreesWithItsParameters) {
  for (const auto& path : sensors()) {
    const std::string variant = path.stem();
    SCOPED_TRACE(variant);
    const hardware::Parameters parameters = load_hardware(path);
    const std::vector<Row> bill = bill_of(variant);
    for (const std::string part : {"camera", "springs", "LED", "filament", "epoxy", "wire"})
      EXPECT_EQ(rows_of(bill, part).size(), 1u) << part;
    const auto within = [&](const std::string& part, double price) {
      for (const Row& row : rows_of(bill, part)) {
        const double pieces = number(row.at("quantity"));
        EXPECT_GE(price, pieces * number(row.at("price_low_usd"))) << part;
        EXPECT_LE(price, pieces * number(row.at("price_high_usd"))) << part;
      }
    };
    within("camera", parameters.camera.price);
    within("springs", parameters.springs.price);
    fmt::print("{:10} {:6.2f} to {:6.2f} USD\n", variant, cost(bill, "price_low_usd"),
               cost(bill, "price_high_usd"));
  }
  for (const std::string& extra : kExtras) {
    const std::vector<Row> bill = bill_of(extra);
    EXPECT_FALSE(bill.empty()) << extra;
    fmt::print("{:10} {:6.2f} to {:6.2f} USD\n", extra, cost(bill, "price_low_usd"),
               cost(bill, "price_high_usd"));
  }
}

/// "screw M2 x 12 countersunk": thread and length, mm; nothing of other parts.
struct Screw {
  double thread = 0, length = 0;
};
Screw screw_of(const Row& row) {
  std::smatch match;
  const std::string part = row.at("part");
  if (!std::regex_match(part, match, std::regex(R"(screw M(\d) x (\d+) .*)"))) return {};
  return {number(match[1]), number(match[2])};
}

TEST(Bill, OfEverySensorHasTheScrewsOfItsDrawing) {
  for (const auto& path : sensors()) {
    SCOPED_TRACE(path.stem());
    const hardware::Parameters p = load_hardware(path);
    const hardware::Geometry g = hardware::geometry(p);
    double bolts = 0, top = 0, stops = 0;
    for (const Row& row : bill_of(path.stem())) {
      const Screw screw = screw_of(row);
      const double pieces = number(row.at("quantity")), length = 1e-3 * screw.length;
      const bool countersunk = row.at("part").ends_with("countersunk");
      if (screw.thread == 2 && countersunk && std::abs(length - g.bolt_length) < 1e-6)
        bolts += pieces;
      // They hold by 2 mm at least, and do not come out below.
      else if (screw.thread == 2 && countersunk && length >= p.top.roof + 2e-3 &&
               length <= p.top.roof + p.top.plate)
        top += pieces;
      if (screw.thread == 3 && row.at("part").ends_with("pan head")) {
        for (const auto& stop : g.stop_screws) EXPECT_NEAR(stop.length, length, 1e-6);
        stops += pieces;
      }
    }
    EXPECT_EQ(bolts, g.bolts.size());
    EXPECT_EQ(top, g.top_screws.size());
    EXPECT_EQ(stops, g.stop_screws.size());
  }
}

TEST(Bill, IsWhatTheGuideSaysOfThePublishedSensor) {
  const std::string guide = documents::text_of("hardware/README.md");
  std::smatch match;
  ASSERT_TRUE(std::regex_search(guide, match, std::regex(R"(`paper` costs (\d+) to (\d+) US)")));
  EXPECT_NEAR(number(match[1]), cost(bill_of("paper"), "price_low_usd"), 0.51);
  EXPECT_NEAR(number(match[2]), cost(bill_of("paper"), "price_high_usd"), 0.51);
}

TEST(Bill, OfThePublishedSensorIsBelowFiftyDollarsEvenAtTheHighPrices) {
  EXPECT_LT(cost(bill_of("paper"), "price_high_usd"), 50);
}

TEST(Bill, HasTheResistorsOfTheDrawings) {
  std::map<std::string, int> drawn, listed;
  for (const Row& row : documents::csv("hardware/wiring/parts.csv")) {
    if (row.at("circuit") == "nano" && row.at("kind") == "resistor") ++drawn[row.at("value")];
  }
  const std::regex name(R"(resistor (\d+) (k?)ohm)");
  for (const Row& row : bill_of("board")) {
    std::smatch match;
    const std::string part = row.at("part");
    if (std::regex_match(part, match, name))
      listed[match[1].str() + " " + match[2].str() + "Ω"] += std::stoi(row.at("quantity"));
  }
  EXPECT_EQ(drawn, listed);
}

}  // namespace
}  // namespace tagwrench

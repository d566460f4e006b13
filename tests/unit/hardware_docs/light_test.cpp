// The numbers in hardware/light.md, recomputed from the values that it states.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "documents.h"
#include "firmware/app/led.h"
#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

using documents::number;
using Table = std::vector<std::vector<std::string>>;

constexpr double kRounding = 0.03;  // two figures

class Light : public testing::Test {
 protected:
  void SetUp() override {
    for (const auto& row : documents::markdown_table(text_, "| symbol | value | may be | what |"))
      value_[row[0]] = number(row[1]);
    table_ = documents::markdown_table(
        text_, "| light | mA | lumens | lux at the tags | ms at gain 1 | ms at gain 4 |");
    heat_ = documents::markdown_table(
        text_,
        "| LED | mA | V | R, K/W | C, J/K | P, W | K at full, for ever | K at 30 %, for ever | K "
        "after 10 s at full, from 30 % |");
  }

  static void expect_stated(double computed, const std::string& stated) {
    EXPECT_NEAR(computed, number(stated), std::max(kRounding * computed, 1e-3)) << stated;
  }

  const std::string text_ = documents::text_of("hardware/light.md");
  std::map<std::string, double> value_;
  Table table_, heat_;
};

TEST_F(Light, StandsWhereThePublishedSensorHasIt) {
  const hardware::Parameters paper =
      load_hardware(TAGWRENCH_SOURCE_DIR "/hardware/sensors/paper.yaml");
  const hardware::Geometry geometry = hardware::geometry(paper);
  EXPECT_NEAR(1e3 * (geometry.platform - geometry.cover_top), value_.at("h"), 0.1);
  EXPECT_NEAR(1e3 * std::hypot(paper.light.x, paper.light.y), value_.at("a"), 0.1);
  EXPECT_DOUBLE_EQ(paper.light.diffuser, 0.6e-3);
}

TEST_F(Light, ReachesTheTagsAndTheSensorAsStated) {
  const double h = 1e-3 * value_.at("h"), a = 1e-3 * value_.at("a");
  const double r = std::hypot(h, a);
  ASSERT_EQ(table_.size(), 4u);
  for (const auto& row : table_) {
    SCOPED_TRACE(row[0]);
    const double lumens = number(row[1]) * value_.at("Φ/I");
    expect_stated(lumens, row[2]);
    const double candela = value_.at("T") * lumens / std::numbers::pi;
    const double lux = candela * (h / r) * std::cos(std::numbers::pi / 4) * (h / r) / (r * r);
    expect_stated(lux, row[3]);
    const double on_sensor = lux * value_.at("ρ") * value_.at("τ") /
                             (4 * std::pow(value_.at("N") * (1 + value_.at("m")), 2));
    const double seconds = 190.0 / 255 * value_.at("V") / (value_.at("S") * on_sensor);
    expect_stated(1e3 * seconds, row[4]);
    expect_stated(1e3 * seconds / 4, row[5]);
  }
}

TEST_F(Light, HasCurrentsThatFollowFromTheResistorsInTheDrawings) {
  std::map<std::string, double> ohm;
  for (const documents::Row& row : documents::csv("hardware/wiring/parts.csv")) {
    if (row.at("kind") == "resistor")
      ohm[row.at("circuit") + " " + row.at("part")] = number(row.at("value"));
  }
  const auto volts = [&](int row) { return number(heat_.at(row)[2]); };
  constexpr double kCell = 3.0, kInside = 20, kUsb = 5;
  const double coin = 1e3 * (kCell - volts(0)) / (ohm.at("coin_cell R1") + kInside);
  const double camera = 1e3 * (kUsb - volts(1)) / ohm.at("camera_usb R1");
  const double arduino = 1e3 * (kUsb - volts(2)) / ohm.at("nano R4");
  EXPECT_NEAR(coin, number(table_[0][1]), 0.2);
  EXPECT_NEAR(camera, number(table_[2][1]), 0.2);
  EXPECT_NEAR(arduino, number(table_[3][1]), 0.6);
  EXPECT_NEAR(arduino * firmware::kSustainedPermille / 1000, number(table_[1][1]), 0.3);
  EXPECT_NEAR(coin, number(heat_[0][1]), 0.2);
  EXPECT_NEAR(camera, number(heat_[1][1]), 0.2);
  EXPECT_NEAR(arduino, number(heat_[2][1]), 0.6);
  EXPECT_NEAR(1e3 * (kUsb - volts(3)) / 6.8, number(heat_[3][1]), 2);
}

TEST_F(Light, WarmsABareLedAsStated) {
  constexpr double kHeatShare = 0.75, kPlasticBears = 30;  // K above the room
  const double sustained = firmware::kSustainedPermille / 1000.0;
  const double full_s = firmware::kFullTimeMs / 1000.0;
  EXPECT_DOUBLE_EQ(sustained, 0.3);
  EXPECT_DOUBLE_EQ(full_s, 10);
  ASSERT_EQ(heat_.size(), 4u);
  for (const auto& row : heat_) {
    SCOPED_TRACE(row[0]);
    const double resistance = number(row[3]), capacity = number(row[4]);
    const double watt = kHeatShare * number(row[2]) * number(row[1]) / 1e3;
    expect_stated(watt, row[5]);
    const double full = watt * resistance, low = sustained * full;
    const double burst = low + (full - low) * (1 - std::exp(-full_s / (resistance * capacity)));
    EXPECT_NEAR(full, number(row[6]), 0.6);
    EXPECT_NEAR(low, number(row[7]), 0.6);
    EXPECT_NEAR(burst, number(row[8]), 0.6);
    EXPECT_LT(low, kPlasticBears);
    // Where no firmware watches, full light must be bearable for ever.
    const bool watched = row[0].find("Arduino") != std::string::npos;
    EXPECT_TRUE(watched || full < kPlasticBears);
  }
}

}  // namespace
}  // namespace tagwrench

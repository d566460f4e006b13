// One truth about the wires: the firmware's pins, its README's table, the netlist and the drawings.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>

#include "documents.h"
#include "firmware/board/atmega328p/pins.h"

namespace tagwrench {
namespace {

using documents::Row;
using Pin = std::pair<std::string, std::string>;  // part, pin

class Circuit {
 public:
  explicit Circuit(const std::string& name) {
    for (const Row& row : documents::csv("hardware/wiring/parts.csv"))
      if (row.at("circuit") == name) parts[row.at("part")] = row;
    for (const Row& row : documents::csv("hardware/wiring/nets.csv")) {
      if (row.at("circuit") != name) continue;
      const Pin pin{row.at("part"), row.at("pin")};
      EXPECT_TRUE(net_of.emplace(pin, row.at("net")).second) << pin.first << "." << pin.second;
      EXPECT_TRUE(parts.contains(pin.first)) << pin.first;
      pins[row.at("net")].insert(pin);
    }
  }

  /// What else hangs on the Arduino's pin.
  std::set<Pin> beside(const std::string& pin) const {
    const auto net = net_of.find({"U1", pin});
    if (net == net_of.end()) return {};
    std::set<Pin> out = pins.at(net->second);
    out.erase({"U1", pin});
    return out;
  }

  std::map<std::string, Row> parts;
  std::map<Pin, std::string> net_of;
  std::map<std::string, std::set<Pin>> pins;
};

/// The Arduino's name for a bit of a port.
std::string arduino_pin(char port, int mask) {
  int bit = 0;
  while (mask >> bit != 1) ++bit;
  if (port == 'C') return fmt::format("A{}", bit);
  return fmt::format("D{}", port == 'B' ? bit + 8 : bit);
}

bool reaches_the_gate(const Circuit& circuit, const std::string& pin) {
  const std::set<Pin> beside = circuit.beside(pin);
  if (beside.size() != 1 || beside.begin()->second != "1") return false;
  const std::string resistor = beside.begin()->first;
  return circuit.parts.at(resistor).at("value") == "470 Ω" &&
         circuit.net_of.at({resistor, "2"}) == circuit.net_of.at({"Q1", "G"});
}

TEST(Wiring, LeadsEveryPinWhereTheFirmwareUsesIt) {
  const Circuit circuit("nano");
  std::set<Pin> rates;
  for (uint8_t i = 0; i < board::kCells; ++i) {
    const std::string amplifier = fmt::format("M{}", i);
    EXPECT_EQ(circuit.beside(arduino_pin('C', board::data_line(i))),
              (std::set<Pin>{{amplifier, "DT"}}));
    EXPECT_EQ(circuit.beside(arduino_pin('D', board::clock_line(i))),
              (std::set<Pin>{{amplifier, "SCK"}}));
    rates.insert({amplifier, "RATE"});
  }
  EXPECT_EQ(circuit.beside(arduino_pin('D', board::kCellRate)), rates);
  EXPECT_EQ(circuit.beside(arduino_pin('B', board::kButton0)), (std::set<Pin>{{"S1", "1"}}));
  EXPECT_EQ(circuit.beside(arduino_pin('B', board::kButton1)), (std::set<Pin>{{"S2", "1"}}));
  EXPECT_TRUE(reaches_the_gate(circuit, arduino_pin('B', board::kLedPulses)));
  EXPECT_TRUE(reaches_the_gate(circuit, arduino_pin('D', board::kLedSteady)));
  EXPECT_EQ(circuit.beside(arduino_pin('C', 1 << board::kFirstAdcPin)),
            (std::set<Pin>{{"X1", "1"}}));
  EXPECT_EQ(circuit.beside(arduino_pin('C', 2 << board::kFirstAdcPin)),
            (std::set<Pin>{{"X2", "1"}}));
  EXPECT_TRUE(circuit.beside(arduino_pin('B', board::kHostLamp)).empty());
}

TEST(Wiring, CommentsInTheFirmwareNameThePinOfTheirBit) {
  const std::string text = documents::text_of("firmware/board/atmega328p/pins.h");
  const std::regex line(R"(1 << P([BCD])(\d);\s*// ([AD]\d+))");
  int found = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it, ++found)
    EXPECT_EQ(arduino_pin((*it)[1].str()[0], 1 << std::stoi((*it)[2])), (*it)[3].str());
  EXPECT_EQ(found, 6);
}

/// "A0 A1", "D8, D12", "5V, GND".
std::vector<std::string> pins_in(const std::string& cell) {
  std::vector<std::string> out;
  const std::regex name(R"([A-Z]?\d+V?|GND)");
  for (std::sregex_iterator it(cell.begin(), cell.end(), name), end; it != end; ++it)
    out.push_back(it->str());
  return out;
}

TEST(Wiring, IsWhatTheFirmwaresTableSays) {
  const Circuit circuit("nano");
  std::set<std::string> named;
  for (const auto& row :
       documents::markdown_table(documents::text_of("firmware/README.md"), "| pin | what | to |")) {
    ASSERT_EQ(row.size(), 3u) << row[0];
    const std::vector<std::string> pins = pins_in(row[0]);
    for (std::size_t i = 0; i < pins.size(); ++i) {
      named.insert(pins[i]);
      const std::set<Pin> beside = circuit.beside(pins[i]);
      const std::string amplifier = fmt::format("M{}", i);
      SCOPED_TRACE(pins[i] + ": " + row[1] + " to " + row[2]);
      if (row[2].starts_with("DT")) {
        EXPECT_EQ(beside, (std::set<Pin>{{amplifier, "DT"}}));
      } else if (row[2].starts_with("SCK")) {
        EXPECT_EQ(beside, (std::set<Pin>{{amplifier, "SCK"}}));
      } else if (row[2].starts_with("RATE")) {
        EXPECT_EQ(beside.size(), 4u);
        for (const Pin& pin : beside) EXPECT_EQ(pin.second, "RATE");
      } else if (row[2].starts_with("470 Ω")) {
        EXPECT_TRUE(reaches_the_gate(circuit, pins[i]));
      } else if (row[1].starts_with("button")) {
        ASSERT_EQ(beside.size(), 1u);
        const std::string button = beside.begin()->first;
        EXPECT_EQ(circuit.parts.at(button).at("value"), fmt::format("button {}", i));
        EXPECT_EQ(circuit.net_of.at({button, "2"}), "GND");
      } else if (row[1].starts_with("ADC")) {
        ASSERT_EQ(beside.size(), 1u);
        EXPECT_EQ(circuit.parts.at(beside.begin()->first).at("kind"), "voltage");
      } else if (pins[i] == "5V" || pins[i] == "GND") {
        EXPECT_EQ(circuit.net_of.at({"U1", pins[i]}), pins[i]);
      } else {
        EXPECT_TRUE(beside.empty()) << "the board's own pin";
      }
    }
  }
  std::set<std::string> drawn;
  for (const auto& [pin, net] : circuit.net_of)
    if (pin.first == "U1") drawn.insert(pin.second);
  EXPECT_EQ(named, drawn);
}

TEST(Wiring, TurnsTheLedOffWithoutFirmware) {
  const Circuit circuit("nano");
  EXPECT_EQ(circuit.net_of.at({"R3", "1"}), circuit.net_of.at({"Q1", "G"}));
  EXPECT_EQ(circuit.net_of.at({"R3", "2"}), "GND");
  EXPECT_EQ(circuit.net_of.at({"Q1", "S"}), "GND");
  EXPECT_EQ(circuit.net_of.at({"R4", "1"}), "5V");
  EXPECT_EQ(circuit.net_of.at({"R4", "2"}), circuit.net_of.at({"L1", "A"}));
  EXPECT_EQ(circuit.net_of.at({"L1", "K"}), circuit.net_of.at({"Q1", "D"}));
}

TEST(Wiring, OfEveryCircuitHasALedThroughAResistor) {
  for (const std::string name : {"nano", "coin_cell", "camera_usb"}) {
    const Circuit circuit(name);
    const std::set<Pin>& plus = circuit.pins.at(circuit.net_of.at({"L1", "A"}));
    ASSERT_EQ(plus.size(), 2u) << name;
    EXPECT_TRUE(plus.begin()->first.starts_with("R") || plus.rbegin()->first.starts_with("R"));
    EXPECT_NE(circuit.net_of.at({"L1", "A"}), circuit.net_of.at({"L1", "K"})) << name;
  }
}

class WiringDrawing : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "no python3 here";
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    for (const char* name : {"draw.py", "symbols.py", "nets.csv", "parts.csv"})
      std::filesystem::copy_file(wiring_ + name, folder_ + name);
  }

  bool draw() const {
    return std::system(
               ("python3 -B " + folder_ + "draw.py " + folder_ + "out 2>/dev/null").c_str()) == 0;
  }

  void change(const std::string& name, const std::string& from, const std::string& to) const {
    std::ifstream in(folder_ + name);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream(folder_ + name) << text.replace(at, from.size(), to);
  }

  const std::string wiring_ = TAGWRENCH_SOURCE_DIR "/hardware/wiring/";
  const std::string folder_ = std::string(TAGWRENCH_SCRATCH_DIR "/wiring-") +
                              testing::UnitTest::GetInstance()->current_test_info()->name() + "/";
};

TEST_F(WiringDrawing, IsTheOneOfTheNetlist) {
  ASSERT_TRUE(draw());
  for (const std::string name : {"nano.svg", "no_board.svg"}) {
    std::ifstream drawn(folder_ + "out/" + name);
    const std::string text((std::istreambuf_iterator<char>(drawn)), {});
    EXPECT_TRUE(text == documents::text_of("hardware/wiring/" + name))
        << name << " is not what draw.py makes of nets.csv and parts.csv: run it";
  }
}

TEST_F(WiringDrawing, IsRefusedWhenAWireIsMissing) {
  change("nets.csv", "nano,gate,R3,1\n", "");
  EXPECT_FALSE(draw());
}

TEST_F(WiringDrawing, IsRefusedWhenAWireIsNotDrawn) {
  change("nets.csv", "nano,lamp,U1,D13\n", "nano,lamp,U1,D13\nnano,lamp,S1,3\n");
  EXPECT_FALSE(draw());
}

TEST_F(WiringDrawing, IsRefusedWhenWiresAreSwapped) {
  change("nets.csv", "nano,button_0,U1,D8\n", "nano,button_1,U1,D8\n");
  EXPECT_FALSE(draw());
}

}  // namespace
}  // namespace tagwrench

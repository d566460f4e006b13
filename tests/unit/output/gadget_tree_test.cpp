// Gadgets in a folder that behaves as configfs does: default groups come by themselves, and a
// folder goes only when nothing holds it.
#include "host/output/gadget_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>

#include "gadget_rig.h"
#include "host/core/config_error.h"
#include "host/output/hid_report.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using test::put_text;
using test::TemporaryTree;

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class FakeConfigfs : public GadgetFiles {
 public:
  int make_folder(const std::string& path) override {
    if (const int error = step("mkdir " + short_name(path))) return error;
    if (const int error = GadgetFiles::make_folder(path)) return error;
    const std::string parent = fs::path(path).parent_path().filename();
    if (parent == "usb_gadget") {
      for (const char* group : {"strings", "configs", "functions"})
        fs::create_directory(path + "/" + group);
      for (const char* attribute : {"UDC", "idVendor", "idProduct", "bcdUSB", "bcdDevice"})
        put_text(path + "/" + attribute, "");
    } else if (parent == "functions") {
      for (const char* attribute :
           {"protocol", "subclass", "report_length", "report_desc", "no_out_endpoint"})
        put_text(path + "/" + attribute, "");
    } else if (parent == "configs") {
      fs::create_directory(path + "/strings");
      for (const char* attribute : {"MaxPower", "bmAttributes"})
        put_text(path + "/" + attribute, "");
    } else {
      for (const char* attribute : {"manufacturer", "product", "serialnumber", "configuration"})
        put_text(path + "/" + attribute, "");
    }
    return 0;
  }

  int remove_folder(const std::string& path) override {
    if (const int error = step("rmdir " + short_name(path))) return error;
    if (!fs::exists(path)) return ENOENT;
    if (held(path)) return EBUSY;
    fs::remove_all(path);
    return 0;
  }

  int write(const std::string& path, std::string_view bytes) override {
    if (const int error = step("write " + short_name(path))) return error;
    if (!fs::exists(path)) return ENOENT;
    std::ofstream(path, std::ios::binary) << (bytes == "\n" ? std::string_view() : bytes);
    return 0;
  }

  int link(const std::string& target, const std::string& path) override {
    if (const int error = step("link " + short_name(path))) return error;
    return GadgetFiles::link(target, path);
  }

  int unlink(const std::string& path) override {
    if (const int error = step("unlink " + short_name(path))) return error;
    return GadgetFiles::unlink(path);
  }

  /// From this step on nothing happens any more, as if the power had gone.
  void crash(std::size_t step) {
    steps.clear();
    fail_at = step;
    dead_ = true;
  }
  void revive() {
    fail_at = static_cast<std::size_t>(-1);
    dead_ = false;
  }

  std::vector<std::string> steps;
  std::size_t fail_at = static_cast<std::size_t>(-1);
  int failure = EIO;

 private:
  int step(std::string what) {
    steps.push_back(std::move(what));
    const std::size_t now = steps.size() - 1;
    return now == fail_at || (dead_ && now > fail_at) ? failure : 0;
  }

  bool dead_ = false;

  static std::string short_name(const std::string& path) {
    const std::string root = "usb_gadget/";
    return path.substr(path.find(root) + root.size());
  }

  /// By a folder that somebody has made in a group of it, by a link in it or to it, by a
  /// controller.
  static bool held(const std::string& path) {
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.is_symlink()) return true;
      if (entry.is_directory() && !fs::is_empty(entry)) return true;
    }
    const fs::path gadget = fs::path(path).parent_path().parent_path();
    if (fs::path(path).parent_path().filename() == "functions") {
      for (const auto& entry : fs::recursive_directory_iterator(gadget / "configs")) {
        if (entry.is_symlink() && fs::read_symlink(entry) == path) return true;
      }
    }
    return !text_of(path + "/UDC").empty();
  }
};

class Gadget : public ::testing::Test {
 protected:
  Gadget() { fs::create_directories(root_); }

  GadgetSpec spec(GadgetFace face = GadgetFace::spacemouse) const {
    return {"sensor", face, face_id(face), false, "fe980000.usb"};
  }

  TemporaryTree folder_;
  std::string root_ = folder_ / "usb_gadget";
  std::string ours_ = root_ + "/tagwrench-sensor";
  FakeConfigfs files_;
  GadgetTree tree_{files_, root_};
};

TEST_F(Gadget, OfASpacemouseHasItsDescriptorIdsAndNames) {
  tree_.up(spec());
  const std::string function = ours_ + "/functions/hid.spacemouse";
  const auto descriptor = spacemouse_descriptor();
  EXPECT_EQ(text_of(function + "/report_desc"), std::string(descriptor.begin(), descriptor.end()));
  EXPECT_EQ(text_of(function + "/report_length"), "13");
  EXPECT_EQ(text_of(function + "/no_out_endpoint"), "1");
  EXPECT_EQ(text_of(ours_ + "/idVendor"), "0x256f");
  EXPECT_EQ(text_of(ours_ + "/idProduct"), "0xc62e");
  EXPECT_EQ(text_of(ours_ + "/strings/0x409/serialnumber"), "tagwrench-sensor");
  EXPECT_EQ(text_of(ours_ + "/strings/0x409/manufacturer"), "tagwrench");
  EXPECT_EQ(text_of(ours_ + "/strings/0x409/product"), "SpaceMouse");
  EXPECT_EQ(text_of(ours_ + "/configs/c.1/MaxPower"), "500");
  EXPECT_EQ(fs::read_symlink(ours_ + "/configs/c.1/hid.spacemouse"), function);
}

TEST_F(Gadget, OfTheWrenchSensorHasReportsOf64Bytes) {
  tree_.up(spec(GadgetFace::wrench));
  const auto descriptor = wrench_descriptor();
  EXPECT_EQ(text_of(ours_ + "/functions/hid.wrench/report_desc"),
            std::string(descriptor.begin(), descriptor.end()));
  EXPECT_EQ(text_of(ours_ + "/functions/hid.wrench/report_length"), "64");
  EXPECT_EQ(text_of(ours_ + "/idProduct"), "0x7a6e");
}

TEST_F(Gadget, WithASupplyOfItsOwnAsksNextToNothingOfThePort) {
  GadgetSpec own = spec();
  own.self_powered = true;
  tree_.up(own);
  EXPECT_EQ(text_of(ours_ + "/configs/c.1/MaxPower"), "2");
  EXPECT_EQ(text_of(ours_ + "/configs/c.1/bmAttributes"), "192");  // 0xc0
}

TEST_F(Gadget, IsOfferedToTheOtherComputerOnlyWhenItIsWhole) {
  tree_.up(spec());
  EXPECT_EQ(files_.steps.front(), "mkdir tagwrench-sensor");
  EXPECT_EQ(files_.steps.back(), "write tagwrench-sensor/UDC");
  EXPECT_EQ(files_.steps[files_.steps.size() - 2],
            "link tagwrench-sensor/configs/c.1/hid.spacemouse");
  EXPECT_EQ(std::count(files_.steps.begin(), files_.steps.end(), "write tagwrench-sensor/UDC"), 1);
}

TEST_F(Gadget, ThatFailsAtAnyStepLeavesNothing) {
  tree_.up(spec());
  const std::size_t steps = files_.steps.size();
  tree_.down("sensor");
  for (std::size_t i = 0; i < steps; ++i) {
    files_.steps.clear();
    files_.fail_at = i;
    EXPECT_THROW(tree_.up(spec()), ConfigError) << "step " << i;
    EXPECT_TRUE(fs::is_empty(root_)) << "step " << i << ": " << files_.steps[i];
  }
}

TEST_F(Gadget, ThatACrashLeftAtAnyStepIsMadeAnew) {
  tree_.up(spec(GadgetFace::wrench));
  const std::size_t steps = files_.steps.size();
  tree_.down("sensor");
  for (std::size_t i = 1; i < steps; ++i) {
    files_.crash(i);
    EXPECT_THROW(tree_.up(spec(GadgetFace::wrench)), ConfigError);
    ASSERT_TRUE(tree_.find("sensor")) << "step " << i;
    EXPECT_FALSE(tree_.find("sensor")->whole) << "step " << i;
    files_.revive();
    tree_.up(spec());
    ASSERT_TRUE(tree_.find("sensor"));
    EXPECT_TRUE(tree_.find("sensor")->whole) << "step " << i;
    EXPECT_EQ(files_.list(ours_ + "/functions"), std::vector<std::string>{"hid.spacemouse"});
    tree_.down("sensor");
    EXPECT_TRUE(fs::is_empty(root_)) << "step " << i;
  }
}

TEST_F(Gadget, IsTakenDownAgainAndAgain) {
  tree_.up(spec());
  tree_.down("sensor");
  EXPECT_TRUE(fs::is_empty(root_));
  files_.steps.clear();
  tree_.down("sensor");
  EXPECT_TRUE(files_.steps.empty());
}

TEST_F(Gadget, OfSomebodyElseIsNeverTouched) {
  put_text(root_ + "/g1/UDC", "fe980000.usb\n");
  put_text(root_ + "/tagwrench/UDC", "");  // no prefix of ours
  tree_.up(spec());
  tree_.down("sensor");
  for (const std::string& step : files_.steps)
    EXPECT_NE(step.find(" tagwrench-sensor"), step.npos) << step;
  EXPECT_EQ(text_of(root_ + "/g1/UDC"), "fe980000.usb\n");
  EXPECT_TRUE(fs::exists(root_ + "/tagwrench/UDC"));
}

TEST_F(Gadget, NamedToLeadOutOfItsFolderIsRefused) {
  for (const char* name : {"", "..", "../g1", "a/b", "a b", "123456789012345678901234567890123"}) {
    GadgetSpec bad = spec();
    bad.name = name;
    EXPECT_THROW(tree_.up(bad), ConfigError) << name;
    EXPECT_THROW(tree_.down(name), ConfigError) << name;
    EXPECT_THROW(tree_.find(name), ConfigError) << name;
  }
  EXPECT_TRUE(files_.steps.empty());
}

TEST_F(Gadget, WithoutRightsSaysSudoAndAForeignControllerSaysStatus) {
  const auto message = [this](std::size_t step, int error) -> std::string {
    files_.steps.clear();
    files_.fail_at = step;
    files_.failure = error;
    try {
      tree_.up(spec());
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "nothing";
  };
  tree_.up(spec());
  const std::size_t last = files_.steps.size() - 1;
  tree_.down("sensor");
  EXPECT_NE(message(0, EACCES).find("sudo tagwrench gadget up"), std::string::npos);
  EXPECT_NE(message(last, EBUSY).find("tagwrench gadget status"), std::string::npos);
}

TEST_F(Gadget, IsReadBackAsItWasMade) {
  EXPECT_FALSE(tree_.find("sensor"));
  tree_.up(spec(GadgetFace::wrench));
  const GadgetFound found = tree_.find("sensor").value();
  EXPECT_TRUE(found.whole);
  EXPECT_EQ(found.face, GadgetFace::wrench);
  EXPECT_EQ(found.id.vendor, 0x1209);
  EXPECT_EQ(found.id.product, 0x7a6e);
  EXPECT_EQ(found.udc, "fe980000.usb");
  EXPECT_EQ(found.serial, "tagwrench-sensor");
  EXPECT_EQ(found.name(), "sensor");
}

TEST_F(Gadget, TextsOfOthersAreShownWithoutWhatATerminalObeys) {
  put_text(root_ + "/g1/UDC", "\x1b[2Jx\nsecond");
  EXPECT_EQ(files_.line(root_ + "/g1/UDC"), "?[2Jx");
  put_text(root_ + "/g1/UDC", std::string(5000, 'a'));
  EXPECT_EQ(files_.line(root_ + "/g1/UDC").size(), 255u);
  EXPECT_EQ(files_.line(root_ + "/nothing"), "");
}

TEST(UsbId, IsFourHexDigitsTwice) {
  ASSERT_TRUE(parse_usb_id("256f:C62E"));
  EXPECT_EQ(parse_usb_id("256f:C62E")->product, 0xc62e);
  for (const char* bad :
       {"", "256f", "256f-c62e", "0x6f:c62e", "256f:c62", "256g:c62e", "256f:c62e0", "+56f:c62e"})
    EXPECT_FALSE(parse_usb_id(bad)) << bad;
}

}  // namespace
}  // namespace tagwrench

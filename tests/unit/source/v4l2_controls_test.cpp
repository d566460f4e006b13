#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <map>

#include "host/source/v4l2_settings.h"

namespace tagwrench {
namespace {

/// Behaves as UVC cameras do: a value is refused while its automatism runs, and jumps when that
/// stops.
class FakeCamera final : public ControlPort {
 public:
  struct Item {
    std::int32_t value = 0;
    ControlRange range{};
  };
  std::map<std::uint32_t, Item> items;
  std::vector<std::pair<std::uint32_t, std::int32_t>> writes;
  bool only_shutter_priority = false;

  std::optional<ControlRange> range(std::uint32_t id) override {
    const auto item = items.find(id);
    return item == items.end() ? std::nullopt : std::optional(item->second.range);
  }
  std::optional<std::int32_t> get(std::uint32_t id) override {
    const auto item = items.find(id);
    return item == items.end() ? std::nullopt : std::optional(item->second.value);
  }
  bool set(std::uint32_t id, std::int32_t value) override {
    const auto item = items.find(id);
    if (item == items.end() || !item->second.range.writable) return false;
    if (id == V4L2_CID_EXPOSURE_AUTO && only_shutter_priority && value == V4L2_EXPOSURE_MANUAL)
      return false;
    if (id == V4L2_CID_EXPOSURE_ABSOLUTE &&
        items[V4L2_CID_EXPOSURE_AUTO].value == V4L2_EXPOSURE_APERTURE_PRIORITY) {
      return false;
    }
    if (id == V4L2_CID_EXPOSURE_AUTO && value != item->second.value)
      items[V4L2_CID_EXPOSURE_ABSOLUTE].value = 5;
    item->second.value = value;
    writes.emplace_back(id, value);
    return true;
  }
};

void fill(FakeCamera& camera) {
  const ControlRange flag{0, 1, 1, true};
  camera.items = {
      {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {1, flag}},
      {V4L2_CID_EXPOSURE_AUTO, {V4L2_EXPOSURE_APERTURE_PRIORITY, {0, 3, 1, true}}},
      {V4L2_CID_EXPOSURE_ABSOLUTE, {156, {3, 2047, 1, true}}},
      {V4L2_CID_AUTO_WHITE_BALANCE, {1, flag}},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {4000, {2800, 6500, 10, true}}},
      {V4L2_CID_FOCUS_AUTO, {1, flag}},
      {V4L2_CID_FOCUS_ABSOLUTE, {30, {0, 250, 5, true}}},
      {V4L2_CID_POWER_LINE_FREQUENCY, {V4L2_CID_POWER_LINE_FREQUENCY_AUTO, {0, 3, 1, true}}},
      {V4L2_CID_SHARPNESS, {128, {0, 255, 1, false}}},  // read only
  };
}

std::map<std::uint32_t, std::int32_t> values(const FakeCamera& camera) {
  std::map<std::uint32_t, std::int32_t> out;
  for (const auto& [id, item] : camera.items) out[id] = item.value;
  return out;
}

TEST(ControlLock, KeepsWhatAutomaticExposureSettledOn) {
  FakeCamera camera;
  fill(camera);
  ControlLock lock;
  lock.remember(camera);
  EXPECT_TRUE(lock.needs_settling());
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_AUTO_PRIORITY].value, 0) << "before it settles";
  camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value = 300;  // it settles
  lock.lock(camera, 0);
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value, 300);
  EXPECT_EQ(camera.items[V4L2_CID_AUTO_WHITE_BALANCE].value, 0);
  EXPECT_EQ(camera.items[V4L2_CID_WHITE_BALANCE_TEMPERATURE].value, 4000);
  EXPECT_EQ(camera.items[V4L2_CID_FOCUS_AUTO].value, 0);
  EXPECT_EQ(camera.items[V4L2_CID_POWER_LINE_FREQUENCY].value,
            V4L2_CID_POWER_LINE_FREQUENCY_DISABLED);
}

TEST(ControlLock, RestoresEverything) {
  FakeCamera camera;
  fill(camera);
  const auto before = values(camera);
  ControlLock lock;
  lock.remember(camera);
  lock.lock(camera, 2000);
  EXPECT_NE(values(camera), before);
  camera.writes.clear();
  lock.restore(camera);
  EXPECT_EQ(camera.writes.front().first, std::uint32_t{V4L2_CID_EXPOSURE_ABSOLUTE})
      << "values before automatisms";
  auto after = values(camera);
  after[V4L2_CID_EXPOSURE_ABSOLUTE] = before.at(V4L2_CID_EXPOSURE_ABSOLUTE);  // automatic again
  EXPECT_EQ(after, before);
}

TEST(ControlLock, ExposureIsSetInUnitsOf100usAndWithinRange) {
  for (const auto& [exposure_us, expected] :
       {std::pair{2500, 25}, std::pair{100, 3}, std::pair{9000000, 2047}}) {
    FakeCamera camera;
    fill(camera);
    ControlLock lock;
    lock.remember(camera);
    lock.lock(camera, exposure_us);
    EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value, expected) << exposure_us;
  }
}

TEST(ControlLock, FallsBackToShutterPriority) {
  FakeCamera camera;
  fill(camera);
  camera.only_shutter_priority = true;
  ControlLock lock;
  lock.remember(camera);
  lock.lock(camera, 0);
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_SHUTTER_PRIORITY);
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value, 156);
}

TEST(ControlLock, WritesTheSameValuesIntoACameraThatWasAway) {
  FakeCamera camera;
  fill(camera);
  ControlLock lock;
  lock.remember(camera);
  lock.lock(camera, 0);
  const auto locked = values(camera);
  fill(camera);
  lock.relock(camera);
  EXPECT_EQ(values(camera), locked);
}

TEST(ControlLock, AbsentAndReadOnlyControlsAreListedAndNotTouched) {
  FakeCamera camera;
  fill(camera);
  ControlLock lock;
  lock.remember(camera);
  lock.lock(camera, 0);
  const std::string text = lock.description();
  EXPECT_EQ(camera.items[V4L2_CID_SHARPNESS].value, 128);
  const auto without = text.find("without");
  ASSERT_NE(without, std::string::npos) << text;
  EXPECT_GT(text.find("sharpness"), without) << text;
  EXPECT_GT(text.find("gain"), without) << text;
  EXPECT_LT(text.find("exposure"), without) << text;
}

TEST(ControlLock, ACameraWithoutControlsIsFine) {
  FakeCamera camera;
  ControlLock lock;
  lock.remember(camera);
  EXPECT_FALSE(lock.needs_settling());
  lock.lock(camera, 100);
  lock.restore(camera);
  EXPECT_TRUE(camera.writes.empty());
  EXPECT_EQ(lock.description(), "it has no controls to lock");
}

TEST(ControlLock, ALockedValueCanBeChangedAndIsThenTheLockedOne) {
  FakeCamera camera;
  fill(camera);
  ControlLock lock;
  EXPECT_FALSE(lock.change(camera, V4L2_CID_EXPOSURE_ABSOLUTE, 40)) << "nothing is locked yet";
  lock.remember(camera);
  lock.lock(camera, 2500);
  EXPECT_EQ(lock.locked(V4L2_CID_EXPOSURE_ABSOLUTE), 25);
  EXPECT_TRUE(lock.change(camera, V4L2_CID_EXPOSURE_ABSOLUTE, 40));
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value, 40);
  EXPECT_TRUE(lock.change(camera, V4L2_CID_EXPOSURE_ABSOLUTE, 1'000'000));
  EXPECT_EQ(lock.locked(V4L2_CID_EXPOSURE_ABSOLUTE), 2047) << "the camera's longest";
  EXPECT_FALSE(lock.change(camera, V4L2_CID_GAIN, 3)) << "this camera has no gain";
  EXPECT_EQ(lock.locked(V4L2_CID_GAIN), std::nullopt);

  camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value = 7;  // it was away
  lock.relock(camera);
  EXPECT_EQ(camera.items[V4L2_CID_EXPOSURE_ABSOLUTE].value, 2047);
}

}  // namespace
}  // namespace tagwrench

#include "host/output/spnav_protocol.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace tagwrench {
namespace {

enum Event : std::int32_t { kMotionEvent = 0, kPress = 1, kRelease = 2, kDeviceEvent = 3 };

/// Low half of a request's type.
enum Request : std::int32_t {
  kSetName = 0x1000,
  kSetSensitivity = 0x1001,
  kGetSensitivity = 0x1002,
  kSetEventMask = 0x1003,
  kGetEventMask = 0x1004,
  kDeviceName = 0x2000,
  kDevicePath = 0x2001,
  kAxes = 0x2002,
  kButtons = 0x2003,
  kUsbId = 0x2004,
  kDeviceType = 0x2005,
  kSetSerialPort = 0x3016,
};

constexpr std::uint32_t kTag = 0x7faa0000;
constexpr std::uint32_t kChangeVersion = 0x7faa5500;
constexpr int kNewestVersion = 1;
constexpr std::int32_t kFailed = -1;
constexpr std::int32_t kSpaceMouseWireless = 0x20c;  // libspnav's SPNAV_DEV_SMW
constexpr std::size_t kTextInRecord = 24;
constexpr std::int32_t kContinued = 0x10000;

std::int32_t device_type(const SpnavDevice& device) {
  return device.vendor == 0x256f && device.product == 0xc62e ? kSpaceMouseWireless : 0;
}

}  // namespace

Counts6 spnav_counts(const Vector6& motion) noexcept {
  return to_spnav_order(to_counts(motion, kSpnavFullScale_counts));
}

SpnavRecord spnav_motion(const Counts6& counts, float sensitivity,
                         std::int32_t period_ms) noexcept {
  SpnavRecord record{kMotionEvent};
  for (std::size_t i = 0; i < 6; ++i)
    record[i + 1] = static_cast<std::int32_t>(std::lround(counts[i] * sensitivity));
  record[7] = period_ms;
  return record;
}

SpnavRecord spnav_button(int button, bool pressed) noexcept {
  return {pressed ? kPress : kRelease, button, pressed ? 1 : 0};
}

SpnavRecord spnav_device(bool added, const SpnavDevice& device) noexcept {
  return {kDeviceEvent, added ? 0 : 1, 0, device_type(device), device.vendor, device.product};
}

std::span<const std::uint8_t> SpnavDialogue::take(Bytes bytes, const SpnavDevice* device,
                                                  std::string_view path) noexcept {
  const std::size_t count = std::min(bytes.size(), wanted());
  std::copy_n(bytes.begin(), count, input_.begin() + static_cast<std::ptrdiff_t>(held_));
  held_ += count;
  if (wanted() > 0) return {};
  held_ = 0;
  spoken_ = true;
  if (version_ == 0) return take_word();
  request_ = std::bit_cast<SpnavRecord>(input_);
  return answer(device, path);
}

/// Version 0: the request for another version, which is a NaN as a number, or a sensitivity.
std::span<const std::uint8_t> SpnavDialogue::take_word() noexcept {
  std::uint32_t word = 0;
  std::memcpy(&word, input_.data(), sizeof word);
  if ((word & 0xffffff00) != kChangeVersion) {
    set_sensitivity(std::bit_cast<float>(word));
    return {};
  }
  version_ = std::min(static_cast<int>(word & 0xff), kNewestVersion);
  if (version_ > 0) event_mask_ |= kDevice;
  answers_[0][0] = static_cast<std::int32_t>(kChangeVersion | static_cast<std::uint32_t>(version_));
  return {reinterpret_cast<const std::uint8_t*>(answers_.data()), sizeof word};
}

/// libspnav 1.0 sends half a double in place of a float, so that 1 arrives as 0 and 0.7 as 3e23.
/// Such numbers are nobody's request.
bool SpnavDialogue::set_sensitivity(float sensitivity) noexcept {
  constexpr float kMin = 1e-3F;
  constexpr float kMax = 1e3F;
  const float size = std::abs(sensitivity);
  if (!(size >= kMin && size <= kMax)) return false;
  sensitivity_ = sensitivity;
  return true;
}

std::span<const std::uint8_t> SpnavDialogue::answer(const SpnavDevice* device,
                                                    std::string_view path) noexcept {
  const auto type = static_cast<std::uint32_t>(request_[0]);
  const std::uint32_t tag = type & 0xffff0000;
  if (tag != kTag && tag != 0) return reply(kFailed);  // libspnav tags all but strings
  const auto request = static_cast<std::int32_t>(type & 0xffff);
  switch (request) {
    case kSetName:
    case kSetSerialPort:
      return {};  // libspnav waits for no answer to a text, and would take it for an event
    case kSetSensitivity:
      return reply(set_sensitivity(std::bit_cast<float>(request_[1])) ? 0 : kFailed);
    case kGetSensitivity: request_[1] = std::bit_cast<std::int32_t>(sensitivity_); return reply(0);
    case kSetEventMask: event_mask_ = static_cast<std::uint32_t>(request_[1]); return reply(0);
    case kGetEventMask: request_[1] = static_cast<std::int32_t>(event_mask_); return reply(0);
    default: break;
  }
  if (device == nullptr) return reply(kFailed);
  switch (request) {
    case kDeviceName:
      return reply_text({device->name.data(), ::strnlen(device->name.data(), device->name.size())});
    case kDevicePath: return reply_text(path);
    case kAxes: request_[1] = 6; break;
    case kButtons: request_[1] = kSpnavButtons; break;
    case kUsbId:
      request_[1] = device->vendor;
      request_[2] = device->product;
      break;
    case kDeviceType: request_[1] = device_type(*device); break;
    default: return reply(kFailed);  // settings of spacenavd; here a profile has them
  }
  return reply(0);
}

std::span<const std::uint8_t> SpnavDialogue::reply(std::int32_t status) noexcept {
  answers_[0] = request_;
  answers_[0][7] = status;
  return {reinterpret_cast<const std::uint8_t*>(answers_.data()), sizeof(SpnavRecord)};
}

/// 24 bytes a record; the last word counts those left, and marks all records but the first.
std::span<const std::uint8_t> SpnavDialogue::reply_text(std::string_view text) noexcept {
  text = text.substr(0, kMaxAnswers * kTextInRecord);
  if (text.empty()) return reply(kFailed);
  std::size_t records = 0;
  for (; !text.empty(); ++records) {
    SpnavRecord& record = answers_[records];
    record = {request_[0]};
    const std::size_t count = std::min(text.size(), kTextInRecord);
    std::memcpy(&record[1], text.data(), count);
    record[7] = static_cast<std::int32_t>(text.size()) | (records > 0 ? kContinued : 0);
    text.remove_prefix(count);
  }
  return {reinterpret_cast<const std::uint8_t*>(answers_.data()), records * sizeof(SpnavRecord)};
}

}  // namespace tagwrench

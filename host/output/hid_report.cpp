#include "host/output/hid_report.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "host/output/output.h"

namespace tagwrench {
namespace {

// Real devices claim +-1400 at unit cm, exponent -4; the kernel turns it into 250 counts/mm.
constexpr std::uint8_t kSpacemouseDescriptor[] = {
    0x05, 0x01,        // Usage Page (Generic Desktop)
    0x09, 0x08,        // Usage (Multi-axis Controller)
    0xa1, 0x01,        // Collection (Application)
    0xa1, 0x00,        //   Collection (Physical)
    0x85, 0x01,        //     Report ID (1)
    0x16, 0xa2, 0xfe,  //     Logical Minimum (-350)
    0x26, 0x5e, 0x01,  //     Logical Maximum (350)
    0x36, 0x88, 0xfa,  //     Physical Minimum (-1400)
    0x46, 0x78, 0x05,  //     Physical Maximum (1400)
    0x55, 0x0c,        //     Unit Exponent (-4)
    0x65, 0x11,        //     Unit (cm)
    0x09, 0x30,        //     Usage (X)
    0x09, 0x31,        //     Usage (Y)
    0x09, 0x32,        //     Usage (Z)
    0x09, 0x33,        //     Usage (RX)
    0x09, 0x34,        //     Usage (RY)
    0x09, 0x35,        //     Usage (RZ)
    0x75, 0x10,        //     Report Size (16)
    0x95, 0x06,        //     Report Count (6)
    0x81, 0x02,        //     Input (Data, Variable, Absolute)
    0xc0,              //   End Collection
    0xa1, 0x02,        //   Collection (Logical)
    0x85, 0x03,        //     Report ID (3)
    0x05, 0x09,        //     Usage Page (Button)
    0x19, 0x01,        //     Usage Minimum (1)
    0x29, 0x02,        //     Usage Maximum (2)
    0x15, 0x00,        //     Logical Minimum (0)
    0x25, 0x01,        //     Logical Maximum (1)
    0x35, 0x00,        //     Physical Minimum (0)
    0x45, 0x01,        //     Physical Maximum (1)
    0x75, 0x01,        //     Report Size (1)
    0x95, 0x02,        //     Report Count (2)
    0x81, 0x02,        //     Input (Data, Variable, Absolute)
    0x95, 0x0e,        //     Report Count (14)
    0x81, 0x03,        //     Input (Constant): padding
    0xc0,              //   End Collection
    0xa1, 0x02,        //   Collection (Logical)
    0x85, 0x04,        //     Report ID (4)
    0x05, 0x08,        //     Usage Page (LED)
    0x09, 0x4b,        //     Usage (Generic Indicator)
    0x15, 0x00,        //     Logical Minimum (0)
    0x25, 0x01,        //     Logical Maximum (1)
    0x95, 0x01,        //     Report Count (1)
    0x75, 0x01,        //     Report Size (1)
    0x91, 0x02,        //     Output (Data, Variable, Absolute)
    0x95, 0x01,        //     Report Count (1)
    0x75, 0x07,        //     Report Size (7)
    0x91, 0x03,        //     Output (Constant): padding
    0xc0,              //   End Collection
    0xc0,              // End Collection
};
static_assert(sizeof kSpacemouseDescriptor == 100);

constexpr std::int32_t kMax31 = std::numeric_limits<std::int32_t>::max();

/// Item prefixes of HID 1.11 section 6.2.2, the two size bits left zero.
enum Item : std::uint8_t {
  kInput = 0x80,
  kCollection = 0xa0,
  kEndCollection = 0xc0,
  kUsagePage = 0x04,
  kLogicalMinimum = 0x14,
  kLogicalMaximum = 0x24,
  kPhysicalMinimum = 0x34,
  kPhysicalMaximum = 0x44,
  kUnitExponent = 0x54,
  kUnit = 0x64,
  kReportSize = 0x74,
  kReportId = 0x84,
  kReportCount = 0x94,
  kUsage = 0x08,
};

constexpr std::int32_t kGenericDesktop = 0x01;
constexpr std::int32_t kVendorPage = 0xff00;

// Unit items (HID 1.11 section 6.2.2.7) and the exponent that turns one count into the wanted unit.
// HID's base units are cm, g and s, so that an SI unit with length^L mass^M has the exponent 2 L +
// 3 M: N 5, N m 7.
struct Unit {
  std::int32_t code;
  int exponent;
};
constexpr Unit kNone{0, 0};
constexpr Unit kMicronewton{0xe111, 5 - 6};
constexpr Unit kMicronewtonMetre{0xe121, 7 - 6};
constexpr Unit kSecond{0x1001, 0};
constexpr Unit kMicrosecond{0x1001, -6};

class DescriptorBuilder {
 public:
  /// An item whose data is a signed number, in the fewest bytes that hold it, 1, 2 or 4.
  void item(Item prefix, std::int32_t value) {
    const bool one = value >= -128 && value <= 127;
    const bool two = value >= -32768 && value <= 32767;
    put(prefix, static_cast<std::uint32_t>(value), one ? 1 : two ? 2 : 4);
  }

  /// An item whose data is a code and not a number: no sign bit to keep free.
  void code(Item prefix, std::uint32_t value) {
    put(prefix, value, value <= 0xff ? 1 : value <= 0xffff ? 2 : 4);
  }

  void end_collection() { bytes_.push_back(kEndCollection); }

  void fields(std::int32_t page, std::initializer_list<int> usages, int size_bits,
              std::int32_t lowest, std::int32_t highest, Unit unit) {
    code(kUsagePage, static_cast<std::uint32_t>(page));
    for (const int usage : usages) code(kUsage, static_cast<std::uint32_t>(usage));
    item(kLogicalMinimum, lowest);
    item(kLogicalMaximum, highest);
    item(kPhysicalMinimum, lowest);
    item(kPhysicalMaximum, highest);
    code(kUnit, static_cast<std::uint32_t>(unit.code));
    code(kUnitExponent, static_cast<std::uint32_t>(unit.exponent) & 0x0f);  // a signed nibble
    code(kReportSize, static_cast<std::uint32_t>(size_bits));
    code(kReportCount, static_cast<std::uint32_t>(usages.size()));
    code(kInput, 0x02);  // Data, Variable, Absolute
  }

  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void put(std::uint8_t prefix, std::uint32_t value, int size) {
    bytes_.push_back(static_cast<std::uint8_t>(prefix | (size == 4 ? 3 : size)));
    for (int i = 0; i < size; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }

  std::vector<std::uint8_t> bytes_;
};

/// Writes little-endian fields one after the other.
class ReportWriter {
 public:
  explicit ReportWriter(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
  void put(std::uint32_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      bytes_[at_++] = static_cast<std::uint8_t>(value >> (8 * i));
  }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// SI to millionths, rounded, within +-(2^31 - 1).
std::uint32_t micro(double value) {
  const double counts = std::clamp(std::round(value * 1e6), -double{kMax31}, double{kMax31});
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(counts));
}

}  // namespace

Counts6 to_counts(const Vector6& motion, int limit_counts) noexcept {
  Counts6 counts{};
  if (!motion.allFinite()) return counts;
  for (int i = 0; i < 6; ++i) {
    counts[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>(std::lround(std::clamp(motion[i], -1.0, 1.0) * limit_counts));
  }
  return counts;
}

ShownMotion shown_motion(const Sample& sample, int limit_counts) noexcept {
  if (!carries_numbers(shown_status(sample))) return {};
  return {to_counts(sample.deflection, limit_counts), sample.buttons};
}

std::span<const std::uint8_t> spacemouse_descriptor() noexcept { return kSpacemouseDescriptor; }

SpacemouseButtonReport spacemouse_button_report(std::uint32_t pressed) noexcept {
  constexpr std::uint32_t kThere = (1U << kSpacemouseButtons) - 1;
  return {kSpacemouseButtonReportId, static_cast<std::uint8_t>(pressed & kThere), 0};
}

SpacemouseReport spacemouse_report(const Counts6& counts) noexcept {
  SpacemouseReport report{};
  ReportWriter out(report);
  out.put(kSpacemouseMotionReportId, 1);
  for (const std::int16_t count : counts) out.put(static_cast<std::uint16_t>(count), 2);
  return report;
}

Counts6 to_spnav_order(const Counts6& hid) noexcept {
  const auto minus = [](std::int16_t v) { return static_cast<std::int16_t>(-v); };
  return {hid[0], minus(hid[2]), minus(hid[1]), hid[3], minus(hid[5]), minus(hid[4])};
}

Counts6 dithered(const Counts6& wanted, const Counts6& last) noexcept {
  if (wanted != last) return wanted;
  Counts6 sent = wanted;
  auto& largest = *std::max_element(sent.begin(), sent.end(),
                                    [](int a, int b) { return std::abs(a) < std::abs(b); });
  if (largest == 0) return sent;
  const int sign = largest > 0 ? 1 : -1;
  const int step = std::abs(largest) > 1 ? -sign : sign;  // from one count the only way is out
  largest = static_cast<std::int16_t>(largest + step);
  return sent;
}

std::vector<std::uint8_t> wrench_descriptor() {
  DescriptorBuilder d;
  d.code(kUsagePage, kVendorPage);
  d.code(kUsage, 0x10);
  d.code(kCollection, 0x01);  // Application
  d.code(kReportId, kWrenchReportId);
  d.fields(kGenericDesktop, {0x30, 0x31, 0x32}, 32, -kMax31, kMax31, kMicronewton);
  d.fields(kGenericDesktop, {0x33, 0x34, 0x35}, 32, -kMax31, kMax31, kMicronewtonMetre);
  d.fields(kVendorPage, {0x21, 0x22, 0x23}, 32, 0, kMax31, kMicronewton);
  d.fields(kVendorPage, {0x24, 0x25, 0x26}, 32, 0, kMax31, kMicronewtonMetre);
  d.fields(kVendorPage, {0x31}, 32, 0, kMax31, kSecond);
  d.fields(kVendorPage, {0x32}, 32, 0, 999'999, kMicrosecond);
  d.fields(kVendorPage, {0x33}, 32, 0, kMax31, kNone);
  d.fields(kVendorPage, {0x34}, 16, 0, 0xffff, kNone);
  d.fields(kVendorPage, {0x35}, 8, 0, static_cast<int>(Status::saturated), kNone);
  d.end_collection();
  return d.take();
}

WrenchReport wrench_report(const Sample& sample) noexcept {
  const Status status = shown_status(sample);
  const bool numbers = carries_numbers(status);
  const auto capture_us =
      std::chrono::duration_cast<std::chrono::microseconds>(sample.capture_time.time_since_epoch())
          .count();
  const auto time_us = static_cast<std::uint64_t>(std::max<std::int64_t>(capture_us, 0));

  WrenchReport report{};
  ReportWriter out(report);
  out.put(kWrenchReportId, 1);
  for (int i = 0; i < 6; ++i) out.put(numbers ? micro(sample.wrench[i]) : 0, 4);
  for (int i = 0; i < 6; ++i)
    out.put(numbers ? micro(std::max(sample.wrench_sigma[i], 0.0)) : 0, 4);
  out.put(static_cast<std::uint32_t>(std::min<std::uint64_t>(time_us / 1'000'000, kMax31)), 4);
  out.put(static_cast<std::uint32_t>(time_us % 1'000'000), 4);
  out.put(static_cast<std::uint32_t>(sample.sequence & kMax31), 4);
  out.put(std::min<std::uint32_t>(sample.dropped, 0xffff), 2);
  out.put(static_cast<std::uint32_t>(status), 1);
  return report;
}

WrenchReport neutral_wrench_report() noexcept {
  Sample lost;
  lost.status = Status::lost;
  return wrench_report(lost);
}

}  // namespace tagwrench

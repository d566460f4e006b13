// What a program without any of our code gets out of the two HID devices: it finds them with hidapi
// and knows nothing but their report descriptors and the usages of the HID usage tables.
//
//   hid_client MOTION_VID:PID WRENCH_VID:PID
//
// Waits until both are there, runs until it is killed, and prints
//   device VID:PID USAGE_PAGE:USAGE PATH NAME
//   motion TIME_ns X Y Z RX RY RZ                                   counts
//   wrench TIME_ns SEQUENCE STATUS CAPTURE_ns FX FY FZ MX MY MZ SIGMA_FX ... SIGMA_MZ      N and N
//   m lost VID:PID
// `led 0` or `led 1` on standard input writes the LED report 04 00 or 04 01.
#include <hidapi.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cwchar>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "tests/kernel/guest/lines.h"
#include "tests/unit/output/hid_parser.h"

namespace tagwrench::rig {
namespace {

constexpr std::uint32_t kAxisX = 0x00010030;  // Generic Desktop X; Y Z RX RY RZ follow
constexpr std::uint32_t kSequence = 0xff000033;
constexpr std::uint32_t kStatus = 0xff000035;

std::string hex(unsigned short number) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04x", number);
  return text.data();
}

std::vector<std::uint8_t> descriptor_of(const std::string& hidraw_path) {
  const std::string node = std::filesystem::path(hidraw_path).filename();
  std::ifstream in("/sys/class/hidraw/" + node + "/device/report_descriptor", std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Device {
 public:
  /// Waits for the device.
  explicit Device(std::string id) : id_(std::move(id)) {
    // Watched before looking, so that no node comes unseen; udev gives permission after the node is
    // made.
    const UniqueFd nodes(::inotify_init1(IN_CLOEXEC));
    if (::inotify_add_watch(nodes.get(), "/dev", IN_CREATE | IN_ATTRIB) < 0)
      fail("cannot watch /dev");
    std::array<char, 4096> events;
    while (!find()) {
      if (::read(nodes.get(), events.data(), events.size()) < 0) fail("cannot watch /dev");
    }
    layout_ = test::parse_hid(descriptor_of(path_));
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() { hid_close(handle_); }

  /// The next report, empty if none comes within the time.
  std::span<const std::uint8_t> read(int patience_ms) {
    const int size = hid_read_timeout(handle_, report_.data(), report_.size(), patience_ms);
    if (size < 0) {
      std::printf("lost %s\n", id_.c_str());
      std::exit(0);
    }
    return {report_.data(), static_cast<std::size_t>(size)};
  }

  void write(std::span<const std::uint8_t> report) {
    if (hid_write(handle_, report.data(), report.size()) < 0) fail(id_ + ": hid_write failed");
  }

  const test::HidDescriptor& layout() const { return layout_; }

 private:
  bool find() {
    hid_device_info* all = hid_enumerate(0, 0);
    for (const hid_device_info* d = all; d != nullptr; d = d->next) {
      if (hex(d->vendor_id) + ":" + hex(d->product_id) == id_) open(*d);
    }
    hid_free_enumeration(all);
    return handle_ != nullptr;
  }

  void open(const hid_device_info& info) {
    if (handle_ != nullptr) return;
    handle_ = hid_open_path(info.path);
    if (handle_ == nullptr) {
      std::fprintf(stderr, "%s: cannot open\n", info.path);
      return;
    }
    path_ = info.path;
    std::printf("device %s %04x:%04x %s %ls\n", id_.c_str(), info.usage_page, info.usage, info.path,
                info.product_string != nullptr ? info.product_string : L"");
  }

  std::string id_;
  std::string path_;
  hid_device* handle_ = nullptr;
  test::HidDescriptor layout_;
  std::array<std::uint8_t, 256> report_{};
};

/// The field of a usage; its absence is the device's fault.
test::HidField need(const test::HidDescriptor& layout, std::uint32_t usage) {
  const auto field = layout.find(usage);
  if (!field) fail("the descriptor lacks usage " + std::to_string(usage));
  return *field;
}

class MotionReader {
 public:
  explicit MotionReader(const test::HidDescriptor& layout) {
    for (std::uint32_t i = 0; i < 6; ++i) axes_.push_back(need(layout, kAxisX + i));
  }

  void print(std::span<const std::uint8_t> report) const {
    if (report.empty() || report[0] != axes_[0].report_id) return;
    std::printf("motion %lld", static_cast<long long>(now_ns()));
    for (const test::HidField& axis : axes_) {
      std::printf(" %lld", static_cast<long long>(axis.raw(report)));
    }
    std::printf("\n");
  }

 private:
  std::vector<test::HidField> axes_;
};

/// Fields are told by unit (which of them are forces, torques, times) and by axis usage, not by
/// their place.
class WrenchReader {
 public:
  explicit WrenchReader(const test::HidDescriptor& layout)
      : sequence_(need(layout, kSequence)),
        status_(need(layout, kStatus)),
        times_(layout.with(test::kSecond)) {
    for (const test::Dimension dimension : {test::kNewton, test::kNewtonMetre}) {
      for (const test::HidField& field : layout.with(dimension)) {
        const bool axis = field.usage >= kAxisX && field.usage < kAxisX + 6;
        (axis ? wrench_ : sigma_).push_back(field);
      }
    }
    if (wrench_.size() != 6 || sigma_.size() != 6 || times_.empty()) {
      fail("the descriptor does not carry six quantities in N and N m, six sigmas and a time");
    }
  }

  void print(std::span<const std::uint8_t> report) const {
    if (report.empty() || report[0] != status_.report_id) return;
    std::int64_t capture_ns =
        0;  // rounded part by part: their sum in seconds has not enough digits
    for (const test::HidField& part : times_) capture_ns += std::llround(part.si(report) * 1e9);
    std::printf("wrench %lld %lld %lld %lld", static_cast<long long>(now_ns()),
                static_cast<long long>(sequence_.raw(report)),
                static_cast<long long>(status_.raw(report)), static_cast<long long>(capture_ns));
    for (const test::HidField& field : wrench_) std::printf(" %.9g", field.si(report));
    for (const test::HidField& field : sigma_) std::printf(" %.9g", field.si(report));
    std::printf("\n");
  }

 private:
  test::HidField sequence_;
  test::HidField status_;
  std::vector<test::HidField> times_;
  std::vector<test::HidField> wrench_;
  std::vector<test::HidField> sigma_;
};

[[noreturn]] void watch(const std::string& motion_id, const std::string& wrench_id) {
  Device motion(motion_id);
  Device wrench(wrench_id);
  const MotionReader motion_reader(motion.layout());
  const WrenchReader wrench_reader(wrench.layout());
  Commands commands;
  std::puts("ready");
  for (;;) {
    motion_reader.print(motion.read(2));
    wrench_reader.print(wrench.read(2));
    while (const auto command = commands.next()) {
      if (*command != "led 0" && *command != "led 1") fail("cannot do: " + *command);
      const std::array<std::uint8_t, 2> report{4, static_cast<std::uint8_t>(command->back() - '0')};
      motion.write(report);
    }
  }
}

}  // namespace
}  // namespace tagwrench::rig

int main(int argc, char** argv) {
  if (argc != 3) tagwrench::rig::fail("usage: hid_client MOTION_VID:PID WRENCH_VID:PID");
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (hid_init() != 0) tagwrench::rig::fail("hidapi does not start");
  tagwrench::rig::watch(argv[1], argv[2]);
}

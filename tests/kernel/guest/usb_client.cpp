// Another computer's program that knows USB and nothing of HID: plain libusb on the interrupt pipe.
//
//   usb_client VID:PID
//
// Waits until the device is there, takes its first interface, and prints
//   device VID:PID MANUFACTURER|PRODUCT|SERIAL|REPORT_LENGTH|CURRENT_mA
//   in TIME_ns HEX                         one line for a report
//   lost
// and starts again after a loss. On standard input: `hold` asks for no more reports, as a computer
// that sleeps does; `go` asks again; `led 0`, `led 1` and `nonsense` write output reports by the
// control pipe.
#include <libusb.h>

#include <array>
#include <span>

#include "tests/kernel/guest/lines.h"

namespace tagwrench::rig {
namespace {

constexpr unsigned kPatience_ms = 20;
constexpr std::uint8_t kToInterface = 0x21;  // USB 2.0, table 9-2: class, interface, outward
constexpr std::uint8_t kSetReport = 0x09;
constexpr std::uint16_t kOutput = 0x0200;

/// Until such a device is there.
void wait_for_device(libusb_context* context, std::uint16_t vendor, std::uint16_t product) {
  bool there = false;
  const libusb_hotplug_callback_fn came = [](libusb_context*, libusb_device*, libusb_hotplug_event,
                                             void* flag) {
    *static_cast<bool*>(flag) = true;
    return 1;  // once is enough
  };
  if (libusb_hotplug_register_callback(context, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED,
                                       LIBUSB_HOTPLUG_ENUMERATE, vendor, product,
                                       LIBUSB_HOTPLUG_MATCH_ANY, came, &there, nullptr) != 0)
    fail("libusb does not tell of devices that come");
  while (!there) libusb_handle_events(context);
}

class Device {
 public:
  Device(libusb_context* context, std::uint16_t vendor, std::uint16_t product) {
    while ((handle_ = libusb_open_device_with_vid_pid(context, vendor, product)) == nullptr)
      wait_for_device(context, vendor, product);
    libusb_set_auto_detach_kernel_driver(handle_, 1);
    taken_ = find_pipe() && libusb_claim_interface(handle_, 0) == 0;
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() {
    if (taken_) libusb_release_interface(handle_, 0);
    libusb_close(handle_);
  }

  bool taken() const { return taken_; }

  void introduce(const char* id) {
    libusb_device_descriptor d{};
    libusb_get_device_descriptor(libusb_get_device(handle_), &d);
    std::printf("device %s %s|%s|%s|%d|%d\n", id, text(d.iManufacturer).c_str(),
                text(d.iProduct).c_str(), text(d.iSerialNumber).c_str(), longest_, current_ma_);
  }

  /// False: it is gone.
  bool read() {
    std::array<unsigned char, 256> report;
    int size = 0;
    const int status =
        libusb_interrupt_transfer(handle_, pipe_, report.data(), longest_, &size, kPatience_ms);
    if (size > 0) {
      std::printf("in %lld ", static_cast<long long>(now_ns()));
      for (int i = 0; i < size; ++i) std::printf("%02x", report[static_cast<std::size_t>(i)]);
      std::printf("\n");
    }
    return status == 0 || status == LIBUSB_ERROR_TIMEOUT;
  }

  void write(std::span<unsigned char> report) {
    const int status = libusb_control_transfer(
        handle_, kToInterface, kSetReport, static_cast<std::uint16_t>(kOutput | report[0]), 0,
        report.data(), static_cast<std::uint16_t>(report.size()), 1000);
    std::printf("wrote %zu %s\n", report.size(), status >= 0 ? "ok" : libusb_error_name(status));
  }

 private:
  bool find_pipe() {
    libusb_config_descriptor* configuration = nullptr;
    if (libusb_get_active_config_descriptor(libusb_get_device(handle_), &configuration) != 0)
      return false;
    current_ma_ = configuration->MaxPower * 2;
    const libusb_interface_descriptor& face = configuration->interface[0].altsetting[0];
    for (int i = 0; i < face.bNumEndpoints; ++i) {
      const libusb_endpoint_descriptor& pipe = face.endpoint[i];
      if ((pipe.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) continue;
      pipe_ = pipe.bEndpointAddress;
      longest_ = pipe.wMaxPacketSize;
    }
    libusb_free_config_descriptor(configuration);
    return longest_ > 0;
  }

  std::string text(std::uint8_t index) {
    std::array<unsigned char, 128> bytes{};
    const int size = libusb_get_string_descriptor_ascii(handle_, index, bytes.data(), bytes.size());
    return {bytes.begin(), bytes.begin() + std::max(size, 0)};
  }

  libusb_device_handle* handle_ = nullptr;
  bool taken_ = false;
  unsigned char pipe_ = 0;
  int longest_ = 0;
  int current_ma_ = 0;
};

void write_nonsense(Device& device) {
  std::array<unsigned char, 200> bytes;
  bytes.fill(0xff);
  device.write(bytes);
  device.write({bytes.data(), 1});
  bytes[0] = 4;  // the LED's report, far too long
  device.write(bytes);
  device.write({bytes.data(), 1});
}

/// Until it is gone.
void serve(Device& device, Commands& commands, bool& asking) {
  while (true) {
    while (const auto command = commands.next()) {
      if (*command == "hold") asking = false;
      if (*command == "go") asking = true;
      if (*command == "nonsense") write_nonsense(device);
      if (command->starts_with("led ")) {
        std::array<unsigned char, 2> report{4, static_cast<unsigned char>(command->back() - '0')};
        device.write(report);
      }
      std::printf("did %s\n", command->c_str());
    }
    if (!asking) {
      commands.wait();
    } else if (!device.read()) {
      return;
    }
  }
}

}  // namespace
}  // namespace tagwrench::rig

int main(int argc, char** argv) {
  namespace rig = tagwrench::rig;
  unsigned vendor = 0, product = 0;
  if (argc != 2 || std::sscanf(argv[1], "%4x:%4x", &vendor, &product) != 2)
    rig::fail("usage: usb_client VID:PID");
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  libusb_context* context = nullptr;
  if (libusb_init(&context) != 0) rig::fail("libusb does not start");
  rig::Commands commands;
  bool asking = true;
  while (true) {
    rig::Device device(context, static_cast<std::uint16_t>(vendor),
                       static_cast<std::uint16_t>(product));
    if (!device.taken()) continue;
    device.introduce(argv[1]);
    rig::serve(device, commands, asking);
    std::puts("lost");
  }
}

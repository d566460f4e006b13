#include "fake_hidapi.h"

#include <fmt/format.h>
#include <hidapi.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tests/cli/bridge.h"

struct hid_device_ {
  std::shared_ptr<tagwrench::test::FakeHid> fake;
};

namespace tagwrench::test {
namespace {

std::vector<std::shared_ptr<FakeHid>>& fake_hids() {
  static std::vector<std::shared_ptr<FakeHid>> hids;
  return hids;
}

std::string ascii(const std::wstring& text) { return {text.begin(), text.end()}; }

/// What the kernel shows of a device that no USB port is behind.
void write_sysfs(const FakeHid& hid) {
  const std::string device =
      hidraw_class() + "/" + hid.path.substr(hid.path.rfind('/') + 1) + "/device";
  std::filesystem::create_directories(device);
  write_file(device + "/uevent",
             fmt::format("DRIVER=hid-generic\nHID_ID=0003:{:08X}:{:08X}\nHID_NAME={}\n"
                         "HID_PHYS=\nHID_UNIQ={}\nMODALIAS=hid:b0003g0001\n",
                         hid.vendor, hid.product, ascii(hid.name), ascii(hid.serial)));
  // Usage Page (2 bytes), Usage (1 byte), Collection (Application), End Collection
  const char descriptor[] = {'\x06',
                             static_cast<char>(hid.usage_page),
                             static_cast<char>(hid.usage_page >> 8),
                             '\x09',
                             static_cast<char>(hid.usage),
                             '\xa1',
                             '\x01',
                             '\xc0'};
  write_file(device + "/report_descriptor", {descriptor, sizeof descriptor});
}

}  // namespace

const std::string& hidraw_class() {
  static const TemporaryFolder folder;
  static const std::string path = folder.path();
  return path;
}

std::shared_ptr<FakeHid> plug(FakeHid hid) {
  write_sysfs(hid);
  fake_hids().push_back(std::make_shared<FakeHid>(std::move(hid)));
  return fake_hids().back();
}

void unplug_all() {
  fake_hids().clear();
  for (const auto& entry : std::filesystem::directory_iterator(hidraw_class()))
    std::filesystem::remove_all(entry);
}

}  // namespace tagwrench::test

using tagwrench::test::fake_hids;
using tagwrench::test::FakeHid;

// Like the real one: a list in allocated memory, one entry for each device.
hid_device_info* hid_enumerate(unsigned short vendor, unsigned short product) {
  hid_device_info* first = nullptr;
  hid_device_info** end = &first;
  for (const auto& hid : fake_hids()) {
    if ((vendor != 0 && vendor != hid->vendor) || (product != 0 && product != hid->product))
      continue;
    *end = new hid_device_info{};
    (*end)->path = hid->half_gone ? nullptr : ::strdup(hid->path.c_str());
    (*end)->vendor_id = hid->vendor;
    (*end)->product_id = hid->product;
    (*end)->serial_number = ::wcsdup(hid->serial.c_str());
    (*end)->product_string = ::wcsdup(hid->name.c_str());
    (*end)->usage_page = hid->usage_page;
    (*end)->usage = hid->usage;
    end = &(*end)->next;
  }
  return first;
}

void hid_free_enumeration(hid_device_info* all) {
  while (all != nullptr) {
    hid_device_info* next = all->next;
    std::free(all->path);
    std::free(all->serial_number);
    std::free(all->product_string);
    delete all;
    all = next;
  }
}

hid_device* hid_open_path(const char* path) {
  const auto found = std::find_if(fake_hids().begin(), fake_hids().end(),
                                  [&](const auto& hid) { return hid->path == path; });
  if (found == fake_hids().end() || !(*found)->opens) return nullptr;
  return new hid_device_{*found};
}

void hid_close(hid_device* device) { delete device; }

int hid_read_timeout(hid_device* device, unsigned char* data, size_t length, int) {
  FakeHid& hid = *device->fake;
  if (hid.reports.empty() && hid.idle) hid.idle();
  if (hid.reports.empty()) {
    if (hid.interrupted) {
      hid.interrupted = false;
      errno = EINTR;
      return -1;
    }
    return hid.gone ? -1 : 0;
  }
  const std::vector<std::uint8_t> report = hid.reports.front();
  hid.reports.pop_front();
  const std::size_t size = std::min(length, report.size());
  if (size > 0) std::memcpy(data, report.data(), size);
  return static_cast<int>(size);
}

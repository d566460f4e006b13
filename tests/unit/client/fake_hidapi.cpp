#include "fake_hidapi.h"

#include <hidapi.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

struct hid_device_ {
  std::shared_ptr<tagwrench::test::FakeHid> fake;
};

namespace tagwrench::test {

std::vector<std::shared_ptr<FakeHid>>& fake_hids() {
  static std::vector<std::shared_ptr<FakeHid>> hids;
  return hids;
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
    (*end)->path = ::strdup(hid->path.c_str());
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

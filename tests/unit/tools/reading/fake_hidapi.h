// Another hidapi under the library: devices made of queues. They are in a folder like
// /sys/class/hidraw, too.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tagwrench::test {

struct FakeHid {
  std::string path;
  std::uint16_t vendor = 0x1209;
  std::uint16_t product = 0x7a6e;
  std::wstring serial = L"tagwrench-0";
  std::wstring name = L"tagwrench wrench sensor";
  std::uint16_t usage_page = 0xff00;
  std::uint16_t usage = 0x10;
  bool opens = true;
  bool half_gone = false;  ///< listed without a path
  bool gone = false;
  bool interrupted = false;  ///< the next empty read ends as by a signal
  std::deque<std::vector<std::uint8_t>> reports = {};
  /// Called when a read finds no report, once for each such read.
  std::function<void()> idle = {};
};

std::shared_ptr<FakeHid> plug(FakeHid hid);

/// All of them, and the folder's.
void unplug_all();

/// Made at the first call; it goes with the program.
const std::string& hidraw_class();

}  // namespace tagwrench::test

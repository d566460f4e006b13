// Another hidapi under the library: devices made of queues.
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
  bool gone = false;
  bool interrupted = false;  ///< the next empty read ends as by a signal
  std::deque<std::vector<std::uint8_t>> reports = {};
  /// Called when a read finds no report, once for each such read.
  std::function<void()> idle = {};
};

/// The devices that are plugged in. Emptied by FakeHidTest.
std::vector<std::shared_ptr<FakeHid>>& fake_hids();

inline std::shared_ptr<FakeHid> plug(FakeHid hid) {
  fake_hids().push_back(std::make_shared<FakeHid>(std::move(hid)));
  return fake_hids().back();
}

}  // namespace tagwrench::test

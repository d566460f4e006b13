// Both ends of the spnav socket within the benchmark: its daemon, and a program that reads events.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/output/spnav_daemon.h"

namespace tagwrench::bench {

/// The daemon, in a thread instead of a process.
class HidHolder {
 public:
  explicit HidHolder(const std::string& path);
  ~HidHolder();
  HidHolder(const HidHolder&) = delete;
  HidHolder& operator=(const HidHolder&) = delete;
  double cpu_seconds() const;  ///< so far

 private:
  UniqueFd stop_;
  UniqueFd stopped_;
  std::thread thread_;
};

struct SpnavEvent {
  TimePoint time{};
  std::array<std::int32_t, 6> motion{};
  bool zero() const { return motion == std::array<std::int32_t, 6>{}; }
};

/// Connects as libspnav does, version 1 of the protocol.
UniqueFd connect_as_program(const std::string& path);

/// Reads motion events until the daemon ends.
class SpnavListener {
 public:
  explicit SpnavListener(const std::string& path);
  ~SpnavListener();
  SpnavListener(const SpnavListener&) = delete;
  SpnavListener& operator=(const SpnavListener&) = delete;
  /// What has come so far; ends the listening.
  const std::vector<SpnavEvent>& events();

 private:
  void listen();

  UniqueFd socket_;
  std::vector<SpnavEvent> events_;
  std::thread thread_;
};

}  // namespace tagwrench::bench

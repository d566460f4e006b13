// Six numbers a datagram to another program, as opentrack's input "UDP over network" takes them: 48
// bytes, six little-endian doubles x, y, z in cm and yaw, pitch, roll in degrees
// (https://github.com/opentrack/opentrack, tracker-udp; its usual port is 4242).
//
// Full deflection is 10 cm and 45 degrees. x is to the right, y up and z toward the user; yaw turns
// about y, pitch about x and roll about z, each by the right hand: left, up, and counter-clockwise
// as the user sees it. The receiver states no signs; its mapping can turn each of them round.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"

namespace tagwrench {

inline constexpr double kUdpFull_cm = 10;
inline constexpr double kUdpFull_deg = 45;

/// x, y, z, yaw, pitch, roll.
using UdpDatagram = std::array<std::uint8_t, 48>;
UdpDatagram udp_datagram(const Vector6& deflection) noexcept;

/// A datagram for every move; zeros without numbers. Whether somebody listens does not matter.
class UdpOutput : public Output {
 public:
  /// `place`: HOST:PORT, where HOST is a name, an IPv4 address or an IPv6 address in brackets; the
  /// name is looked up now. Throws ConfigError.
  explicit UdpOutput(const std::string& place);
  /// Sends zeros.
  ~UdpOutput() override { put(UdpDatagram{}); }

  SendStatus move(const Sample& sample) noexcept override {
    return put(carries_numbers(shown_status(sample)) ? udp_datagram(sample.deflection)
                                                     : UdpDatagram{});
  }
  std::string failure() const override;

  void add_to(std::vector<WatchdogDevice>& devices) const {
    const UdpDatagram zeros{};
    devices.push_back({socket_.get(), {{zeros.begin(), zeros.end()}}, {}});
  }

 private:
  SendStatus put(const UdpDatagram& datagram) noexcept;

  std::string place_;
  UniqueFd socket_;
  int error_ = 0;
};

}  // namespace tagwrench

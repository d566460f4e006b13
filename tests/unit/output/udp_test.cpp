// What a receiver of datagrams gets: a socket here stands for opentrack.
#include "host/output/udp.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <bit>

#include "host/core/config_error.h"

namespace tagwrench::test {
namespace {

using Numbers = std::array<double, 6>;

class Receiver {
 public:
  explicit Receiver(int family = AF_INET) : socket_(::socket(family, SOCK_DGRAM, 0)) {
    sockaddr_storage any{};
    any.ss_family = static_cast<sa_family_t>(family);
    socklen_t size = family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
    bound_ = ::bind(socket_.get(), reinterpret_cast<sockaddr*>(&any), size) == 0 &&
             ::getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&any), &size) == 0;
    port_ = ntohs(reinterpret_cast<sockaddr_in*>(&any)->sin_port);  // the same place in both
  }
  bool bound() const { return bound_; }
  std::string port() const { return std::to_string(port_); }

  /// Of the next datagram; nothing if there is none, or one of another size.
  std::optional<Numbers> next() const {
    std::array<std::uint8_t, 100> bytes{};
    if (::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT) != 48) return {};
    Numbers numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      std::uint64_t bits = 0;
      for (std::size_t byte = 8; byte-- > 0;) bits = bits << 8 | bytes[8 * i + byte];
      numbers[i] = std::bit_cast<double>(bits);
    }
    return numbers;
  }

 private:
  UniqueFd socket_;
  bool bound_ = false;
  int port_ = 0;
};

Sample pushed(const Vector6& deflection) {
  Sample sample;
  sample.status = Status::ok;
  sample.deflection = deflection;
  return sample;
}

Vector6 full(int axis) { return Vector6::Unit(axis); }

std::string refusal(const std::string& place) {
  try {
    const UdpOutput output(place);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

TEST(UdpOutput, FullDeflectionIsTenCentimetresAndFortyFiveDegrees) {
  const Receiver receiver;
  UdpOutput output("127.0.0.1:" + receiver.port());
  const Numbers expected[6] = {
      {10, 0, 0, 0, 0, 0},   // right
      {0, 0, 10, 0, 0, 0},   // toward the user
      {0, -10, 0, 0, 0, 0},  // down
      {0, 0, 0, 0, 45, 0},   // about right: pitch
      {0, 0, 0, 0, 0, 45},   // about what points toward the user: roll
      {0, 0, 0, -45, 0, 0},  // about down: yaw the other way
  };
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_EQ(output.move(pushed(full(axis))), SendStatus::ok);
    EXPECT_EQ(receiver.next(), expected[axis]) << "axis " << axis;
  }
}

TEST(UdpOutput, WithoutNumbersItIsZeros) {
  const Receiver receiver;
  UdpOutput output("localhost:" + receiver.port());
  Sample lost = pushed(full(0));
  lost.status = Status::lost;
  output.move(lost);
  EXPECT_EQ(receiver.next(), Numbers{});
  Sample unusable = pushed(full(0));
  unusable.deflection[1] = std::numeric_limits<double>::quiet_NaN();
  output.move(unusable);
  EXPECT_EQ(receiver.next(), Numbers{});
}

TEST(UdpOutput, ItEndsWithZeros) {
  const Receiver receiver;
  {
    UdpOutput output("127.0.0.1:" + receiver.port());
    output.move(pushed(full(2)));
    EXPECT_NE(receiver.next(), Numbers{});
  }
  EXPECT_EQ(receiver.next(), Numbers{});
}

TEST(UdpOutput, TheWatchdogCanSendZeros) {
  const Receiver receiver;
  UdpOutput output("127.0.0.1:" + receiver.port());
  std::vector<WatchdogDevice> devices;
  output.add_to(devices);
  ASSERT_EQ(devices.size(), 1u);
  ASSERT_EQ(devices[0].neutral.size(), 1u);
  const std::vector<std::uint8_t>& bytes = devices[0].neutral[0];
  ASSERT_EQ(::write(devices[0].fd, bytes.data(), bytes.size()), 48);
  EXPECT_EQ(receiver.next(), Numbers{});
}

TEST(UdpOutput, SendsToIPv6) {
  const Receiver receiver(AF_INET6);
  if (!receiver.bound()) GTEST_SKIP() << "this machine has no IPv6";
  UdpOutput output("[::1]:" + receiver.port());
  output.move(pushed(full(0)));
  EXPECT_TRUE(receiver.next());
}

TEST(UdpOutput, NobodyListeningIsNoFailure) {
  std::string port;
  {
    const Receiver gone;
    port = gone.port();
  }
  UdpOutput output("127.0.0.1:" + port);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(output.move(pushed(full(0))), SendStatus::ok);
}

TEST(UdpOutput, APlaceThatIsNoneIsRefusedWithARemedy) {
  for (const std::string place : {"localhost", ":4242", "localhost:", "localhost:0",
                                  "localhost:70000", "localhost:4e2", "::1:4242", "[]:4242"})
    EXPECT_NE(refusal(place).find("--output udp:" + place + ": is no HOST:PORT; use"),
              std::string::npos)
        << refusal(place);
  EXPECT_NE(refusal("no-such-host.invalid:4242").find("cannot be looked up"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench::test

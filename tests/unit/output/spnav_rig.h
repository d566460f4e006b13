// What the tests of the spnav socket have in common: a program that is connected to it, and a
// bridge by hand. Nothing here is shared with the code under test but the layout of the bridge's
// messages.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/spnav_daemon.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::test {

constexpr int kSpnavPatience_ms = 20'000;  // of a busy machine
using Words = std::array<std::int32_t, 8>;

class SpnavFolder {
 public:
  SpnavFolder() = default;
  SpnavFolder(const SpnavFolder&) = delete;
  SpnavFolder& operator=(const SpnavFolder&) = delete;

  std::string socket() const { return path_ + "/spnav.sock"; }
  const std::string& path() const { return path_; }

 private:
  test::TemporaryFolder temporary_;
  std::string path_ = temporary_.path();
};

inline sockaddr_un unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

inline bool readable(int fd, int patience_ms = kSpnavPatience_ms) {
  pollfd entry{fd, POLLIN, 0};
  return ::poll(&entry, 1, patience_ms) > 0;
}

/// A program on the socket, as old as version 0 or speaking version 1.
class SpnavProgramByHand {
 public:
  explicit SpnavProgramByHand(const std::string& path, int version = 1) {
    fd_.reset(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const sockaddr_un address = unix_address(path);
    if (::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("connect " + path + ": " + std::strerror(errno));
    if (version == 0) return;
    const std::uint32_t request = 0x7faa5501;
    say(&request, sizeof request);
    std::uint32_t answer = 0;
    EXPECT_TRUE(hear(&answer, sizeof answer));
    EXPECT_EQ(answer, request);
  }

  void say(const void* bytes, std::size_t count) {
    EXPECT_EQ(::send(fd_.get(), bytes, count, MSG_NOSIGNAL), static_cast<ssize_t>(count));
  }

  /// The next record; nothing if the server has closed or is silent for too long.
  std::optional<Words> next_record(int patience_ms = kSpnavPatience_ms) {
    Words words{};
    if (!hear(words.data(), sizeof words, patience_ms)) return {};
    return words;
  }
  /// The same, but passes over the coming of the device.
  std::optional<Words> next(int patience_ms = kSpnavPatience_ms) {
    auto words = next_record(patience_ms);
    if (words && (*words)[0] == 3) return next_record(patience_ms);
    return words;
  }

  /// The first record that fits; what comes before is passed over.
  std::optional<Words> wait_for(const std::function<bool(const Words&)>& fits) {
    while (const auto words = next()) {
      if (fits(*words)) return words;
    }
    return {};
  }
  bool wait_for_motion(std::array<std::int32_t, 6> six) {
    return wait_for([&](const Words& w) {
             return w[0] == 0 && std::equal(six.begin(), six.end(), w.begin() + 1);
           })
        .has_value();
  }
  bool wait_for_zero() { return wait_for_motion({}); }
  bool wait_for_type(std::int32_t type) {
    return wait_for([&](const Words& w) { return w[0] == type; }).has_value();
  }

  /// Whether the server has hung up, for which it has some time.
  bool closed() {
    char byte;
    return readable(fd_.get()) && ::recv(fd_.get(), &byte, 1, MSG_PEEK) <= 0;
  }
  int fd() const { return fd_.get(); }

 private:
  bool hear(void* into, std::size_t count, int patience_ms = kSpnavPatience_ms) {
    auto* bytes = static_cast<char*>(into);
    while (count > 0) {
      if (!readable(fd_.get(), patience_ms)) return false;
      const ssize_t got = ::recv(fd_.get(), bytes, count, 0);
      if (got <= 0) return false;
      bytes += got;
      count -= static_cast<std::size_t>(got);
    }
    return true;
  }

  UniqueFd fd_;
};

/// A daemon in a thread of the test.
class DaemonThread {
 public:
  explicit DaemonThread(const std::string& path, SpnavDaemonOptions options = {}) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw std::runtime_error("socketpair");
    stop_.reset(ends[0]);
    stopped_.reset(ends[1]);
    std::optional<SpnavSockets> sockets = listen_spnav(path);
    if (!sockets) throw std::runtime_error("a daemon is there already");
    thread_ = std::thread([options, stop = stopped_.get(), own = std::move(*sockets)]() mutable {
      run_spnav_daemon(std::move(own), options, stop);
    });
  }
  DaemonThread(const DaemonThread&) = delete;
  DaemonThread& operator=(const DaemonThread&) = delete;
  ~DaemonThread() { stop(); }

  void stop() {
    stop_.reset();
    wait();
  }
  void wait() {
    if (thread_.joinable()) thread_.join();
  }

 private:
  UniqueFd stop_;
  UniqueFd stopped_;
  std::thread thread_;
};

/// A bridge that says what a test wants it to say.
class BridgeByHand {
 public:
  explicit BridgeByHand(const std::string& path) : link_(connect_spnav_bridge(path)) {
    if (!link_) throw std::runtime_error("no daemon at " + path);
    greeting_ = hear<SpnavGreeting>();
    if (greeting_.refused != 0) return;
    SpnavHello hello;
    hello.device.vendor = 0x256f;
    hello.device.product = 0xc62e;
    std::string("a puck with a name of thirty-nine bytes").copy(hello.device.name.data(), 63);
    EXPECT_TRUE(send_spnav(link_.get(), hello));
  }

  const SpnavGreeting& greeting() const { return greeting_; }
  int fd() const { return link_.get(); }
  void leave() { link_.reset(); }

  void show(const Counts6& motion, std::uint32_t buttons = 0, std::uint32_t valid_ms = 1000) {
    SpnavUpdate update;
    update.state.motion = motion;
    update.state.buttons = buttons;
    update.valid_ms = valid_ms;
    while (!send_spnav(link_.get(), update)) {  // the daemon has the same two processors
      ASSERT_EQ(errno, EAGAIN);
      pollfd entry{link_.get(), POLLOUT, 0};
      ASSERT_EQ(::poll(&entry, 1, kSpnavPatience_ms), 1);
    }
  }

  template <typename Message>
  Message hear() {
    std::array<std::uint8_t, kSpnavLongestMessage> buffer;
    EXPECT_TRUE(readable(link_.get()));
    const SpnavReceived received = receive_spnav(link_.get(), buffer);
    const auto message = spnav_message<Message>(received.bytes);
    EXPECT_TRUE(message.has_value());
    return message.value_or(Message{});
  }

 private:
  UniqueFd link_;
  SpnavGreeting greeting_;
};

}  // namespace tagwrench::test

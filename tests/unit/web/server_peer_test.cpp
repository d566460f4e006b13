// Who is at the other end of a connection within this machine.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>

#include "host/core/os/unique_fd.h"
#include "host/web/server/peer_user.h"
#include "host/web/server/web_server.h"

namespace tagwrench {
namespace {

constexpr uid_t kStranger = 12345;

sockaddr_in6 address_at(const char* number, std::uint16_t port) {
  sockaddr_in6 at{};
  at.sin6_family = AF_INET6;
  at.sin6_port = htons(port);
  ::inet_pton(AF_INET6, number, &at.sin6_addr);
  return at;
}

/// A connection to a listener of its own at an IPv6 number; "::ffff:127.0.0.1" is IPv4's.
struct Connected {
  explicit Connected(const char* number) {
    const UniqueFd listener(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in6 at = address_at(number, 0);
    socklen_t size = sizeof at;
    auto* const generic = reinterpret_cast<sockaddr*>(&at);
    there = !!listener && ::bind(listener.get(), generic, size) == 0 &&
            ::listen(listener.get(), 1) == 0 && ::getsockname(listener.get(), generic, &size) == 0;
    if (!there) return;
    client.reset(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
    there = ::connect(client.get(), generic, size) == 0;
    server.reset(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }
  bool there = false;
  UniqueFd client, server;
};

TEST(WebPeer, IsTheUserWhoseProgramHoldsTheOtherEnd) {
  for (const char* number : {"::1", "::ffff:127.0.0.1"}) {
    const Connected pair(number);
    if (!pair.there) GTEST_SKIP() << number << " is not to be had here";
    EXPECT_EQ(peer_user(pair.server.get()), ::geteuid()) << number;
    EXPECT_EQ(peer_user(pair.client.get()), ::geteuid()) << number;
    EXPECT_EQ(user_in_table(pair.server.get()), ::geteuid()) << number << ", by the table";
    EXPECT_EQ(user_in_table(pair.client.get()), ::geteuid()) << number << ", by the table";
  }
}

TEST(WebPeer, ThatHasClosedItsEndIsNobodyAndNotRoot) {
  Connected pair("::ffff:127.0.0.1");
  ASSERT_TRUE(pair.there);
  pair.client.reset();
  EXPECT_EQ(peer_user(pair.server.get()), std::nullopt);
  EXPECT_EQ(user_in_table(pair.server.get()), std::nullopt);
}

TEST(WebPeer, OfWhatIsNoConnectionIsNobody) {
  const UniqueFd alone(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(peer_user(alone.get()), std::nullopt);
  EXPECT_EQ(peer_user(-1), std::nullopt);
}

TEST(WebPeer, RootAndWeOurselvesAreOurUser) {
  EXPECT_TRUE(is_our_user(0));
  EXPECT_TRUE(is_our_user(::geteuid()));
  EXPECT_FALSE(is_our_user(::geteuid() + 1));
  EXPECT_FALSE(is_our_user(std::nullopt));
  EXPECT_FALSE(is_our_user(65534)) << "whom a namespace hides";
}

/// What a program of `user` hears who sends `text`, until the server has done. Empty: it could not
/// connect.
std::string heard_by(uid_t user, std::uint16_t port, const std::string& text) {
  std::array<int, 2> pipe{};
  if (::pipe(pipe.data()) != 0) return {};
  const pid_t child = ::fork();
  if (child == 0) {  // nothing but system calls: the server has a thread
    sockaddr_in6 at = address_at("::ffff:127.0.0.1", port);
    if (user != ::geteuid() && ::setresuid(user, user, user) != 0) ::_exit(1);
    const int socket = ::socket(AF_INET6, SOCK_STREAM, 0);
    if (::connect(socket, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0) ::_exit(1);
    if (::write(socket, text.data(), text.size()) < 0) ::_exit(1);
    std::array<char, 4096> bytes;
    for (ssize_t got; (got = ::read(socket, bytes.data(), bytes.size())) > 0;)
      if (::write(pipe[1], bytes.data(), static_cast<std::size_t>(got)) < 0) ::_exit(1);
    ::_exit(0);
  }
  ::close(pipe[1]);
  std::string heard;
  std::array<char, 4096> bytes;
  for (ssize_t got; (got = ::read(pipe[0], bytes.data(), bytes.size())) > 0;)
    heard.append(bytes.data(), static_cast<std::size_t>(got));
  ::close(pipe[0]);
  ::waitpid(child, nullptr, 0);
  return heard;
}

class Silent final : public PageRequestHandler {
  void handle(PageRequest) override {}
};

TEST(WebPeer, AnotherUserOfTheMachineHearsNothingButARefusal) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be another user for a while";
  WebOptions options;
  options.port = 0;
  WebServer server(options);
  Silent handler;
  server.start(handler);
  for (const char* path : {"/", "/ws", "/files/recordings/push.twr"}) {
    const std::string request = std::string("GET ") + path +
                                " HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
                                "Connection: close\r\n\r\n";
    const std::string heard = heard_by(kStranger, server.port(), request);
    EXPECT_TRUE(heard.starts_with("HTTP/1.1 403 ")) << path << ": " << heard;
    EXPECT_NE(heard.find("another user's"), std::string::npos) << heard;
    const std::string owner = heard_by(::geteuid(), server.port(), request);
    EXPECT_FALSE(owner.empty());
    EXPECT_EQ(owner.find("another user's"), std::string::npos) << owner;
  }
  server.stop();
}

}  // namespace
}  // namespace tagwrench

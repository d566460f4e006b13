#include "host/motion/control_socket.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <filesystem>
#include <future>

#include "host/core/config_error.h"
#include "tests/unit/motion/profile_folder.h"

namespace tagwrench {
namespace {

using Kind = ControlRequest::Kind;

TEST(ControlRequestText, IsReadWithBlanksAroundItsWords) {
  EXPECT_EQ(parse_request("zero").kind, Kind::zero);
  EXPECT_EQ(parse_request(" next\n").kind, Kind::next_profile);
  EXPECT_EQ(parse_request("status").kind, Kind::status);
  EXPECT_EQ(parse_request("profile  my game ").kind, Kind::profile);
  EXPECT_EQ(parse_request("profile  my game ").name, "my game");
  EXPECT_EQ(parse_request("window Org.Blender ").name, "Org.Blender");
  EXPECT_EQ(parse_request("window").kind, Kind::window);
  EXPECT_EQ(parse_request("show").kind, Kind::show);
  EXPECT_EQ(parse_request("live").kind, Kind::live);
  EXPECT_EQ(parse_request("keep").kind, Kind::keep);
  EXPECT_EQ(parse_request("revert").kind, Kind::revert);
  const ControlRequest attempt = parse_request("try my game\nlock: none\n# end\n");
  EXPECT_EQ(attempt.kind, Kind::attempt);
  EXPECT_EQ(attempt.name, "my game");
  EXPECT_EQ(attempt.text, "lock: none\n# end");
  for (const char* nonsense : {"", " ", "zer", "zero 1", "profile", "Profile x", "try", "try\nx: 1",
                               "live now", "profile a\nb", "next\n\nx"})
    EXPECT_EQ(parse_request(nonsense).kind, Kind::unknown) << nonsense;
}

class ControlSocketTest : public test::ProfileFolder {
 protected:
  /// What the asker gets while `server` grants what comes with `line`.
  std::string asked(ControlSocket& server, const std::string& request, const std::string& line) {
    auto answer = std::async(std::launch::async, [&] { return ask(path("control"), request); });
    pollfd waiting{server.fd(), POLLIN, 0};
    EXPECT_EQ(::poll(&waiting, 1, 10'000), 1) << "no request came";
    last_ = server.next().kind;
    server.answer(line);
    return answer.get();
  }
  Kind last_ = Kind::none;
};

TEST_F(ControlSocketTest, ARequestIsAnsweredToWhoHadIt) {
  ControlSocket server(path("control"));
  EXPECT_EQ(server.next().kind, Kind::none);
  EXPECT_EQ(asked(server, "zero", "ok: soon\n"), "ok: soon\n");
  EXPECT_EQ(last_, Kind::zero);
  EXPECT_EQ(asked(server, std::string(ControlSocket::kMaxRequest + 1, 'z'), "error\n"), "error\n");
  EXPECT_EQ(last_, Kind::unknown);
  EXPECT_EQ(server.next().kind, Kind::none);
}

TEST_F(ControlSocketTest, ASecondOneAtThePlaceIsRefusedAndLeavesTheFirst) {
  ControlSocket server(path("control"));
  EXPECT_THROW(ControlSocket{path("control")}, ConfigError);
  EXPECT_EQ(asked(server, "status", "ok: here\n"), "ok: here\n");
}

TEST_F(ControlSocketTest, AFileThatAKilledOneLeftIsReplacedAndGoesAtTheEnd) {
  const std::string kept = path("kept");
  {
    ControlSocket killed(path("control"));
    std::filesystem::create_hard_link(path("control"), kept);
  }
  std::filesystem::rename(kept, path("control"));
  {
    ControlSocket server(path("control"));
    EXPECT_EQ(asked(server, "next", "ok: game\n"), "ok: game\n");
  }
  EXPECT_FALSE(std::filesystem::exists(path("control")));
}

TEST_F(ControlSocketTest, WithoutASensorTheAskerIsTold) {
  EXPECT_THROW(ask(path("control"), "zero"), ConfigError);
}

}  // namespace
}  // namespace tagwrench

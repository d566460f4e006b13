#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "host/core/os/unique_fd.h"
#include "host/motion/focus_watch.h"
#include "host/motion/profile_manager.h"
#include "host/sensor/sensor_config.h"
#include "tests/unit/motion/profile_folder.h"

namespace tagwrench {
namespace {

constexpr const char* kCadEvent =
    R"({"change":"focus","container":{"id":6,"app_id":"org.freecad.FreeCAD","focused":true}})";

std::string window_event(const std::string& json) { return i3_message(I3Type::window_event, json); }

std::optional<Focus> focus_of(const std::string& json, I3Type type = I3Type::window_event) {
  return focus_in({static_cast<std::uint32_t>(type), json});
}

TEST(I3Message, IsFramedAsI3IpcDescribesIt) {
  // i3-ipc(7): the magic string, 4 bytes of length, 4 bytes of type; a little-endian machine.
  EXPECT_EQ(i3_message(I3Type::subscribe, "[]"), std::string("i3-ipc\2\0\0\0\2\0\0\0[]", 16));
}

TEST(I3Stream, CutsMessagesHoweverTheyCome) {
  const std::string both = window_event(kCadEvent) + i3_message(I3Type::tree, "");
  for (std::size_t piece = 1; piece < both.size(); piece += 7) {
    I3Stream stream;
    std::vector<I3Message> got;
    for (std::size_t at = 0; at < both.size(); at += piece) {
      ASSERT_TRUE(stream.put(std::string_view(both).substr(at, piece)));
      while (auto message = stream.next()) got.push_back(*message);
    }
    ASSERT_EQ(got.size(), 2U) << "in pieces of " << piece;
    EXPECT_EQ(got[0].type, 0x80000003U);
    EXPECT_EQ(got[0].payload, kCadEvent);
    EXPECT_EQ(got[1].payload, "");
  }
}

TEST(I3Stream, PassesOverWhatIsTooLongAndKeepsNothingOfIt) {
  I3Stream stream;
  std::string head = i3_message(I3Type::tree, "");
  const std::uint32_t size = I3Stream::kMax + 1;
  std::memcpy(head.data() + 6, &size, sizeof size);
  ASSERT_TRUE(stream.put(head));
  const auto empty = stream.next();
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->payload, "");
  const std::string part(65536, 'x');
  for (std::uint32_t left = size; left > 0;) {
    const std::size_t now = std::min<std::size_t>(left, part.size());
    ASSERT_TRUE(stream.put(std::string_view(part).substr(0, now)));
    EXPECT_FALSE(stream.next());
    left -= static_cast<std::uint32_t>(now);
  }
  ASSERT_TRUE(stream.put(window_event(kCadEvent)));
  const auto next = stream.next();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->payload, kCadEvent);
}

TEST(I3Stream, WhatIsNoIpcIsRefused) {
  I3Stream stream;
  EXPECT_FALSE(stream.put("HTTP/1.1 400"));
}

TEST(I3Focus, IsTheApplicationOrTheClassInLowerCase) {
  EXPECT_EQ(focus_of(kCadEvent)->program, "org.freecad.freecad");
  EXPECT_EQ(focus_of(R"({"change":"focus","container":{"app_id":null,)"
                     R"("window_properties":{"class":"Blender"}}})")
                ->program,
            "blender");
  EXPECT_EQ(focus_of(R"({"change":"focus","container":{}})")->program, "");
  const auto tree =
      focus_of(R"({"focused":false,"nodes":[{"nodes":[{"focused":false,"app_id":"mail"}]},)"
               R"({"floating_nodes":[{"focused":true,"app_id":"Game"}]}]})",
               I3Type::tree);
  ASSERT_TRUE(tree);
  EXPECT_TRUE(tree->told);
  EXPECT_EQ(tree->program, "game");
}

TEST(I3Focus, IsNotInOtherEventsNorInNonsense) {
  for (const std::string& json :
       {std::string(R"({"change":"title","container":{"app_id":"x"}})"), std::string("{"),
        std::string("[]"), std::string(R"({"change":"focus"})"), std::string(R"({"change":7})"),
        std::string(R"({"change":"focus","container":[]})"), std::string("\xff\xfe"),
        std::string()})
    EXPECT_FALSE(focus_of(json)) << json;
  EXPECT_FALSE(focus_of(std::string(100'000, '['), I3Type::tree)) << "however deep";
  std::string deep;
  for (int i = 0; i < 20'000; ++i) deep += R"({"nodes":[)";
  deep += R"({"focused":true,"app_id":"deep"})";
  for (int i = 0; i < 20'000; ++i) deep += "]}";
  EXPECT_EQ(focus_of(deep, I3Type::tree)->program, "deep");
  EXPECT_LE(
      focus_of(R"({"change":"focus","container":{"app_id":")" + std::string(5000, 'a') + R"("}})")
          ->program.size(),
      256U);
}

/// A compositor's place, and what it hears and says there.
class I3Desktop : public test::ProfileFolder {
 protected:
  I3Desktop() : listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path("sway.sock").c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              0);
    EXPECT_EQ(::listen(listener_.get(), 4), 0);
    ::setenv("SWAYSOCK", path("sway.sock").c_str(), 1);
  }
  ~I3Desktop() override { ::unsetenv("SWAYSOCK"); }

  void meet() { peer_.reset(::accept(listener_.get(), nullptr, nullptr)); }
  void say(const std::string& bytes) {
    ASSERT_EQ(::send(peer_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Lets the desk do what it is woken for until it has that profile.
  static bool comes_to(ProfileManager& profiles, const std::string& name) {
    for (pollfd waiting{profiles.poll_fd(), POLLIN, 0};
         profiles.profile().name != name && ::poll(&waiting, 1, 10'000) == 1;)
      profiles.service();
    return profiles.profile().name == name;
  }

  UniqueFd listener_;
  UniqueFd peer_;
};

TEST_F(I3Desktop, IsAskedForItsWindowsAndFollowed) {
  ProfileManager profiles(ProfileFiles({"game", "cad"}, default_profile(sensor_)), {},
                          FocusWatch::open());
  meet();
  const std::string expected =
      i3_message(I3Type::subscribe, R"(["window"])") + i3_message(I3Type::tree, "");
  std::string asked(expected.size(), '\0');
  ASSERT_EQ(::recv(peer_.get(), asked.data(), asked.size(), MSG_WAITALL),
            static_cast<ssize_t>(asked.size()));
  EXPECT_EQ(asked, expected);
  say(i3_message(I3Type::subscribe, R"({"success": true})"));
  say(i3_message(I3Type::tree, R"({"nodes":[{"focused":true,"app_id":"Blender"}]})"));
  EXPECT_TRUE(comes_to(profiles, "cad"));
  EXPECT_EQ(profiles.take_status_line(), "profile: cad (blender)");
  say(window_event(R"({"change":"focus","container":{"app_id":"mail"}})"));
  EXPECT_TRUE(comes_to(profiles, "game")) << "the first, for a program that none names";
  const std::string cad = window_event(kCadEvent);
  say(cad.substr(0, 20));
  say(cad.substr(20));
  EXPECT_TRUE(comes_to(profiles, "cad"));
}

TEST_F(I3Desktop, OneThatEndsDoesNotKeepTheDeskAwake) {
  ProfileManager profiles(ProfileFiles({"game", "cad"}, default_profile(sensor_)), {},
                          FocusWatch::open());
  meet();
  say(window_event(kCadEvent));
  ASSERT_TRUE(comes_to(profiles, "cad"));
  peer_.reset();
  pollfd waiting{profiles.poll_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&waiting, 1, 10'000), 1);
  profiles.service();
  EXPECT_EQ(::poll(&waiting, 1, 0), 0) << "it would spin";
  EXPECT_EQ(profiles.profile().name, "cad");
}

TEST_F(I3Desktop, OneThatTalksNonsenseIsLeft) {
  ProfileManager profiles(ProfileFiles({"game", "cad"}, default_profile(sensor_)), {},
                          FocusWatch::open());
  meet();
  say("\x16\x03\x01 is not i3");
  pollfd waiting{profiles.poll_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&waiting, 1, 10'000), 1);
  profiles.service();
  char byte = 0;
  ssize_t size = 0;
  do size = ::recv(peer_.get(), &byte, 1, MSG_DONTWAIT);  // what it had asked
  while (size > 0);
  EXPECT_TRUE(size == 0 || errno == ECONNRESET) << "the connection is open";
  EXPECT_EQ(::poll(&waiting, 1, 0), 0);
}

TEST_F(I3Desktop, WithoutItTheNextOneIsAsked) {
  listener_.reset();
  for (const char* other : {"SWAYSOCK", "I3SOCK", "WAYLAND_DISPLAY", "DISPLAY"}) ::unsetenv(other);
  EXPECT_FALSE(FocusWatch::open());
}

}  // namespace
}  // namespace tagwrench

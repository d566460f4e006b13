#include "host/motion/profile_manager.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <filesystem>
#include <future>

#include "host/sensor/sensor_config.h"
#include "tests/unit/motion/profile_folder.h"

namespace tagwrench {
namespace {

class ProfileManagerTest : public test::ProfileFolder {
 protected:
  /// Lets the desk do what it is woken for.
  static std::string status_line(ProfileManager& profiles) {
    pollfd waiting{profiles.poll_fd(), POLLIN, 0};
    EXPECT_EQ(::poll(&waiting, 1, 10'000), 1) << "it is not woken";
    profiles.service();
    return profiles.take_status_line();
  }
  std::string request(ProfileManager& profiles, const std::string& text) {
    auto answer = std::async(std::launch::async, [&] { return ask(path("control"), text); });
    news_ = status_line(profiles);
    return answer.get();
  }
  /// Motion in x of a push of 0.3 N that has lasted.
  static double push(ProfileManager& profiles) {
    Sample sample;
    sample.status = Status::ok;
    sample.wrench_sigma.setConstant(1e-6);
    for (int i = 0; i < 100; ++i) {
      time_ += std::chrono::milliseconds(20);
      sample.capture_time = TimePoint(time_);
      sample.wrench[0] = i < 20 ? 0 : 0.3;
      profiles.shape(sample);
    }
    return sample.deflection[0];
  }
  std::string news_;
  inline static Duration time_{};
};

TEST_F(ProfileManagerTest, RequestsAreGrantedAndAnswered) {
  ProfileManager profiles(ProfileFiles({"cad", "game"}, default_profile(sensor_)),
                          ControlSocket(path("control")), {});
  EXPECT_EQ(request(profiles, "status"), "ok: profile cad of cad game\n");
  EXPECT_EQ(request(profiles, "next"), "ok: game\n");
  EXPECT_EQ(news_, "profile: game (as asked)");
  EXPECT_EQ(profiles.profile().name, "game");
  EXPECT_EQ(request(profiles, "profile cad"), "ok: cad\n");
  EXPECT_EQ(request(profiles, "profile chess"), "error: no profile 'chess'; there are cad, game\n");
  EXPECT_EQ(profiles.profile().name, "cad");
  EXPECT_FALSE(profiles.take_zero());
  EXPECT_EQ(request(profiles, "zero").substr(0, 3), "ok:");
  EXPECT_TRUE(profiles.take_zero());
  EXPECT_FALSE(profiles.take_zero()) << "asked once";
  EXPECT_EQ(request(profiles, "dance").substr(0, 6), "error:");
}

TEST_F(ProfileManagerTest, AFloodOfRequestsIsHeardBetweenPicturesAFewAtATime) {
  ProfileManager profiles(ProfileFiles({"cad", "game"}, default_profile(sensor_)),
                          ControlSocket(path("control")), {});
  const UniqueFd flood(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path("control").copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::connect(flood.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  for (int i = 0; i < 9; ++i) ASSERT_EQ(::send(flood.get(), "next", 4, 0), 4);
  profiles.service();
  EXPECT_EQ(profiles.profile().name, "cad") << "eight of nine are heard";
  profiles.service();
  EXPECT_EQ(profiles.profile().name, "game") << "and none is lost";
}

TEST_F(ProfileManagerTest, ASavedProfileIsInForceAtOnce) {
  write("mine.yaml", "rate_hz: 50\ntranslation: 1\n");
  ProfileManager profiles(ProfileFiles({path("mine.yaml")}, default_profile(sensor_)), {}, {});
  const double before = push(profiles);
  EXPECT_GT(before, 0.1);
  EXPECT_EQ(profiles.period(), std::chrono::milliseconds(20));
  write("mine.yaml", "rate_hz: 0\ntranslation: 0.5\n");
  EXPECT_EQ(status_line(profiles), "profile mine: read again");
  EXPECT_NEAR(push(profiles), before / 2, 1e-3);
  EXPECT_EQ(profiles.period(), Duration::zero());
  write("mine.yaml", "translation: [\n");
  EXPECT_NE(status_line(profiles).find("the earlier profile stays"), std::string::npos);
  EXPECT_NEAR(push(profiles), before / 2, 1e-3);
}

TEST_F(ProfileManagerTest, AProfileBehindALinkIsReadAgainWhereItLies) {
  std::filesystem::create_directory(path("dots"));
  write("dots/mine.yaml", "rate_hz: 50\n");
  std::filesystem::create_symlink("dots/mine.yaml", path("mine.yaml"));
  ProfileManager profiles(ProfileFiles({path("mine.yaml")}, default_profile(sensor_)), {}, {});
  write("dots/mine.yaml", "rate_hz: 100\n");
  EXPECT_EQ(status_line(profiles), "profile mine: read again");
  EXPECT_EQ(profiles.period(), std::chrono::milliseconds(10));
}

TEST_F(ProfileManagerTest, APipeInTheProfilesPlaceIsNotWaitedFor) {
  write("mine.yaml", "rate_hz: 50\n");
  ProfileManager profiles(ProfileFiles({path("mine.yaml")}, default_profile(sensor_)), {}, {});
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::filesystem::rename(path("pipe"), path("mine.yaml"));
  EXPECT_EQ(status_line(profiles), "") << "and what was in force stays";
  EXPECT_EQ(profiles.period(), std::chrono::milliseconds(20));
}

TEST_F(ProfileManagerTest, NothingWakesOneThatCannotChange) {
  ProfileManager profiles(default_profile(sensor_));
  pollfd waiting{profiles.poll_fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&waiting, 1, 0), 0);
}

}  // namespace
}  // namespace tagwrench

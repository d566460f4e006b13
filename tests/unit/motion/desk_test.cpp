#include "host/motion/desk.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <filesystem>
#include <future>

#include "host/sensor/default_profile.h"
#include "tests/unit/motion/desk_folder.h"

namespace tagwrench {
namespace {

class DeskTest : public test::DeskFolder {
 protected:
  /// Lets the desk do what it is woken for.
  static std::string news(Desk& desk) {
    pollfd waiting{desk.poll_fd(), POLLIN, 0};
    EXPECT_EQ(::poll(&waiting, 1, 10'000), 1) << "it is not woken";
    desk.service();
    return desk.take_news();
  }
  std::string wish(Desk& desk, const std::string& text) {
    auto answer = std::async(std::launch::async, [&] { return ask(path("control"), text); });
    news_ = news(desk);
    return answer.get();
  }
  /// Motion in x of a push of 0.3 N that has lasted.
  static double push(Desk& desk) {
    Sample sample;
    sample.status = Status::ok;
    sample.wrench_sigma.setConstant(1e-6);
    for (int i = 0; i < 100; ++i) {
      time_ += std::chrono::milliseconds(20);
      sample.capture_time = TimePoint(time_);
      sample.wrench[0] = i < 20 ? 0 : 0.3;
      desk.shape(sample);
    }
    return sample.motion[0];
  }
  std::string news_;
  inline static Duration time_{};
};

TEST_F(DeskTest, WishesAreGrantedAndAnswered) {
  Desk desk(ProfileFiles({"cad", "game"}, default_profile(sensor_)), ControlSocket(path("control")),
            {});
  EXPECT_EQ(wish(desk, "status"), "ok: profile cad of cad game\n");
  EXPECT_EQ(wish(desk, "next"), "ok: game\n");
  EXPECT_EQ(news_, "profile: game (as asked)");
  EXPECT_EQ(desk.profile().name, "game");
  EXPECT_EQ(wish(desk, "profile cad"), "ok: cad\n");
  EXPECT_EQ(wish(desk, "profile chess"), "error: no profile 'chess'; there are cad, game\n");
  EXPECT_EQ(desk.profile().name, "cad");
  EXPECT_FALSE(desk.take_zero());
  EXPECT_EQ(wish(desk, "zero").substr(0, 3), "ok:");
  EXPECT_TRUE(desk.take_zero());
  EXPECT_FALSE(desk.take_zero()) << "asked once";
  EXPECT_EQ(wish(desk, "dance").substr(0, 6), "error:");
}

TEST_F(DeskTest, AFloodOfWishesIsHeardBetweenPicturesAFewAtATime) {
  Desk desk(ProfileFiles({"cad", "game"}, default_profile(sensor_)), ControlSocket(path("control")),
            {});
  const UniqueFd flood(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path("control").copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::connect(flood.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  for (int i = 0; i < 9; ++i) ASSERT_EQ(::send(flood.get(), "next", 4, 0), 4);
  desk.service();
  EXPECT_EQ(desk.profile().name, "cad") << "eight of nine are heard";
  desk.service();
  EXPECT_EQ(desk.profile().name, "game") << "and none is lost";
}

TEST_F(DeskTest, ASavedProfileIsInForceAtOnce) {
  write("mine.yaml", "rate_hz: 50\ntranslation: 1\n");
  Desk desk(ProfileFiles({path("mine.yaml")}, default_profile(sensor_)), {}, {});
  const double before = push(desk);
  EXPECT_GT(before, 0.1);
  EXPECT_EQ(desk.period(), std::chrono::milliseconds(20));
  write("mine.yaml", "rate_hz: 0\ntranslation: 0.5\n");
  EXPECT_EQ(news(desk), "profile mine: read again");
  EXPECT_NEAR(push(desk), before / 2, 1e-3);
  EXPECT_EQ(desk.period(), Duration::zero());
  write("mine.yaml", "translation: [\n");
  EXPECT_NE(news(desk).find("the earlier profile stays"), std::string::npos);
  EXPECT_NEAR(push(desk), before / 2, 1e-3);
}

TEST_F(DeskTest, AProfileBehindALinkIsReadAgainWhereItLies) {
  std::filesystem::create_directory(path("dots"));
  write("dots/mine.yaml", "rate_hz: 50\n");
  std::filesystem::create_symlink("dots/mine.yaml", path("mine.yaml"));
  Desk desk(ProfileFiles({path("mine.yaml")}, default_profile(sensor_)), {}, {});
  write("dots/mine.yaml", "rate_hz: 100\n");
  EXPECT_EQ(news(desk), "profile mine: read again");
  EXPECT_EQ(desk.period(), std::chrono::milliseconds(10));
}

TEST_F(DeskTest, APipeInTheProfilesPlaceIsNotWaitedFor) {
  write("mine.yaml", "rate_hz: 50\n");
  Desk desk(ProfileFiles({path("mine.yaml")}, default_profile(sensor_)), {}, {});
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::filesystem::rename(path("pipe"), path("mine.yaml"));
  EXPECT_EQ(news(desk), "") << "and what was in force stays";
  EXPECT_EQ(desk.period(), std::chrono::milliseconds(20));
}

TEST_F(DeskTest, NothingWakesOneThatCannotChange) {
  Desk desk(default_profile(sensor_));
  pollfd waiting{desk.poll_fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&waiting, 1, 0), 0);
}

}  // namespace
}  // namespace tagwrench

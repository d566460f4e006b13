#include "host/board/board_link.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "board_model.h"
#include "host/core/config_error.h"
#include "pty.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

/// The model answers on a pseudo-terminal behind a stable link, as udev makes them.
class BoardLinkTest : public ::testing::Test {
 protected:
  BoardLinkTest() : clock(1, {}, 0), board(clock) {
    port = (folder / "usb-board").string();
    plug();
  }

  void plug() {
    device.open();
    fs::remove(port);
    fs::create_symlink(device.path(), port);
  }
  void unplug() {
    device.unplug();
    fs::remove(port);
  }
  double now() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }

  /// Serves both ends until `done`, event by event; false if that takes more than 20 s.
  bool serve(BoardLink& link, const std::function<bool()>& done) {
    const double end = now() + 20;
    while (!done()) {
      if (now() > end) return false;
      pollfd fds[2] = {{link.poll_fd(), POLLIN, 0}, {device.fd(), POLLIN, 0}};
      ::poll(fds, 2, 100);
      if (device.fd() >= 0) {
        board.take(device.read(), now());
        if (const auto out = board.take_out(); !out.empty()) device.write(out);
      }
      if (fds[0].revents != 0) link.service();
      for (BoardEvent item; link.next(item);) news.push_back(item.kind);
    }
    return true;
  }
  bool told(BoardEvent::Kind kind) const {
    return std::find(news.begin(), news.end(), kind) != news.end();
  }

  SyntheticLink clock;
  BoardModel board;
  Pty device;
  tagwrench::test::TemporaryFolder folder;
  std::string port;
  std::vector<BoardEvent::Kind> news;
};

TEST_F(BoardLinkTest, ABoardOnAPortBecomesReady) {
  BoardLink link(port, new_session());
  EXPECT_TRUE(serve(link, [&] { return link.session().state() == BoardState::ready; }));
  EXPECT_TRUE(told(BoardEvent::Kind::connected));
}

TEST_F(BoardLinkTest, UnpluggedAndPluggedInAgainItGoesOnByItself) {
  BoardLink link(port, new_session());
  Led led{};
  led.mode = LedMode::steady;
  led.level_permille = 100;
  link.session().set_led(led);
  ASSERT_TRUE(serve(link, [&] { return !board.leds.empty(); }));
  for (int i = 0; i < 3; ++i) {
    unplug();
    ASSERT_TRUE(serve(link, [&] { return !link.plugged(); })) << i;
    EXPECT_EQ(link.session().state(), BoardState::waiting);
    plug();
    board.restart(100 + static_cast<std::uint32_t>(i), now());  // its power was gone
    board.leds.clear();
    ASSERT_TRUE(serve(link, [&] { return !board.leds.empty() && board.configured; })) << i;
  }
  EXPECT_EQ(std::count(news.begin(), news.end(), BoardEvent::Kind::unplugged), 3);
  EXPECT_EQ(std::count(news.begin(), news.end(), BoardEvent::Kind::plugged), 3);
  EXPECT_EQ(link.session().counters().restarts, 3u);
}

TEST_F(BoardLinkTest, ATerminalThatGotTheSameNumberIsLeftAlone) {
  BoardLink link(port, new_session());
  ASSERT_TRUE(serve(link, [&] { return link.session().state() == BoardState::ready; }));
  const std::string number = device.path();
  device.unplug();  // the link stays, as after a crash
  ASSERT_TRUE(serve(link, [&] { return !link.plugged(); }));
  std::vector<Pty> lower(8);  // the lowest free number is given first
  for (Pty& other : lower) {
    if (other.path() == number) std::swap(device, other);
  }
  if (device.path() != number) GTEST_SKIP() << number << " was taken by another program";
  const double end = now() + 1.2;
  serve(link, [&] { return now() > end; });
  EXPECT_FALSE(link.plugged()) << "it belongs to somebody else now";
  plug();
  EXPECT_TRUE(serve(link, [&] { return link.plugged(); }));
}

TEST_F(BoardLinkTest, NothingThatAnswersIsSaid) {
  BoardLink link(port, new_session());
  const double end = now() + 0.3;
  serve(link, [&] {
    board.answers = false;
    return now() > end;
  });
  EXPECT_NE(link.why_no_board().find("nothing answers"), std::string::npos);
  EXPECT_NE(link.why_no_board().find(port), std::string::npos);
}

TEST_F(BoardLinkTest, AnotherDeviceIsSaidWithWhatItSent) {
  BoardLink link(port, new_session());
  device.write("\x1b[31mGRBL 1.1\r\n");
  serve(link, [&] { return link.session().counters().bytes > 10; });
  const std::string why = link.why_no_board();
  EXPECT_NE(why.find("GRBL"), std::string::npos) << why;
  EXPECT_EQ(why.find('\x1b'), std::string::npos) << "no control codes to the terminal";
  EXPECT_NE(why.find("500000 baud"), std::string::npos) << why;
}

TEST_F(BoardLinkTest, APortThatIsNotThereIsRefused) {
  unplug();
  EXPECT_THROW(BoardLink(port, new_session()), ConfigError);
}

TEST(NewSessionTest, SessionsAndIdsDiffer) {
  const BoardSessionOptions a = new_session();
  const BoardSessionOptions b = new_session();
  EXPECT_NE(a.session, b.session);
  EXPECT_NE(a.session, 0u);
  EXPECT_EQ(a.new_id.count, kIdBytes);
  EXPECT_FALSE(
      std::equal(std::begin(a.new_id.bytes), std::end(a.new_id.bytes), std::begin(b.new_id.bytes)));
}

}  // namespace
}  // namespace tagwrench::link

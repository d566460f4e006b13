// The focus as an X server tells it, with this test in the window manager's place.
#include "host/motion/focus_watch.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xcb/xcb.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "host/core/os/unique_fd.h"
#include "host/motion/profile_manager.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench {
namespace {

class Focus : public testing::Test {
 protected:
  void SetUp() override {
    // Not the desktop of whoever runs this.
    for (const char* other : {"SWAYSOCK", "I3SOCK", "WAYLAND_DISPLAY"}) ::unsetenv(other);
    ::setenv("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nowhere", 1);
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const UniqueFd said(ends[0]);
    server_ = ::fork();
    if (server_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGTERM);
      ::dup2(ends[1], 3);
      ::dup2(::open("/dev/null", O_WRONLY), 2);
      ::execlp("Xvfb", "Xvfb", "-displayfd", "3", "-noreset", "-nolisten", "tcp", nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    char number[16] = {};
    if (::read(said.get(), number, sizeof number - 1) <= 0)
      GTEST_SKIP() << "no X server: install xvfb";
    number[std::strcspn(number, "\n")] = '\0';
    ::setenv("DISPLAY", (":" + std::string(number)).c_str(), 1);
    x_ = xcb_connect(nullptr, nullptr);
    root_ = xcb_setup_roots_iterator(xcb_get_setup(x_)).data->root;
    constexpr const char* kName = "_NET_ACTIVE_WINDOW";
    const auto asked =
        xcb_intern_atom(x_, 0, static_cast<std::uint16_t>(std::strlen(kName)), kName);
    xcb_intern_atom_reply_t* reply = xcb_intern_atom_reply(x_, asked, nullptr);
    ASSERT_NE(reply, nullptr);
    active_ = reply->atom;
    std::free(reply);
  }
  void TearDown() override {
    if (x_ != nullptr) xcb_disconnect(x_);
    if (server_ > 0) {
      ::kill(server_, SIGTERM);
      ::waitpid(server_, nullptr, 0);
    }
  }

  xcb_window_t window(const std::string& classes) {
    const xcb_window_t made = xcb_generate_id(x_);
    xcb_create_window(x_, XCB_COPY_FROM_PARENT, made, root_, 0, 0, 10, 10, 0,
                      XCB_WINDOW_CLASS_INPUT_OUTPUT, XCB_COPY_FROM_PARENT, 0, nullptr);
    xcb_change_property(x_, XCB_PROP_MODE_REPLACE, made, XCB_ATOM_WM_CLASS, XCB_ATOM_STRING, 8,
                        static_cast<std::uint32_t>(classes.size()), classes.data());
    return made;
  }
  void focus(xcb_window_t window) {
    xcb_change_property(x_, XCB_PROP_MODE_REPLACE, root_, active_, XCB_ATOM_WINDOW, 32, 1, &window);
    xcb_flush(x_);
  }
  static std::string next(FocusWatch& watch) {
    for (pollfd waiting{watch.fd(), POLLIN, 0}; ::poll(&waiting, 1, 10'000) == 1;) {
      if (const auto focus = watch.changed()) return focus->told ? focus->program : "unknown";
    }
    return "nothing";
  }

  pid_t server_ = -1;
  xcb_connection_t* x_ = nullptr;
  xcb_window_t root_ = 0;
  xcb_atom_t active_ = 0;
};

TEST_F(Focus, IsToldByTheClassOfTheWindowInLowerCase) {
  using std::string_literals::operator""s;
  const xcb_window_t cad = window("freecad\0FreeCAD\0"s);
  const xcb_window_t game = window("x\0Doom\0"s);
  const xcb_window_t nobody = window("half"s);
  focus(cad);
  auto watch = FocusWatch::open();
  ASSERT_TRUE(watch);
  EXPECT_EQ(next(*watch), "freecad") << "where it is at the start";
  focus(game);
  EXPECT_EQ(next(*watch), "doom");
  focus(nobody);
  EXPECT_EQ(next(*watch), "");
}

TEST_F(Focus, ChoosesTheProfileThatNamesTheProgramElseTheFirst) {
  using std::string_literals::operator""s;
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the test's sensor");
  focus(window("freecad\0FreeCAD\0"s));
  ProfileManager profiles(ProfileFiles({"game", "cad"}, default_profile(sensor)), {},
                          FocusWatch::open());
  const auto in_force_is = [&](const std::string& name) {
    for (pollfd waiting{profiles.poll_fd(), POLLIN, 0};
         profiles.profile().name != name && ::poll(&waiting, 1, 10'000) == 1;)
      profiles.service();
    return profiles.profile().name == name;
  };
  EXPECT_TRUE(in_force_is("cad"));
  EXPECT_EQ(profiles.take_status_line(), "profile: cad (freecad)");
  focus(window("mail\0Mail\0"s));
  EXPECT_TRUE(in_force_is("game")) << "the first, for a program that none names";
}

TEST_F(Focus, AWindowThatIsGoneHasNoClass) {
  using std::string_literals::operator""s;
  const xcb_window_t gone = window("a\0A\0"s);
  xcb_destroy_window(x_, gone);
  auto watch = FocusWatch::open();
  ASSERT_TRUE(watch);
  focus(gone);
  EXPECT_EQ(next(*watch), "");
}

TEST_F(Focus, BesideWaylandNoWindowOfX11MeansOneOfWayland) {
  using std::string_literals::operator""s;
  ::setenv("WAYLAND_DISPLAY", "wayland-0", 1);
  auto watch = FocusWatch::open();
  ::unsetenv("WAYLAND_DISPLAY");
  ASSERT_TRUE(watch);
  const xcb_window_t cad = window("freecad\0FreeCAD\0"s);
  focus(cad);
  EXPECT_EQ(next(*watch), "freecad");
  focus(XCB_WINDOW_NONE);
  EXPECT_EQ(next(*watch), "unknown");
  focus(cad);
  EXPECT_EQ(next(*watch), "freecad");
}

TEST_F(Focus, AnXServerThatEndsDoesNotKeepTheDeskAwake) {
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the test's sensor");
  ProfileManager profiles(ProfileFiles({"game", "cad"}, default_profile(sensor)), {},
                          FocusWatch::open());
  xcb_disconnect(std::exchange(x_, nullptr));
  ::kill(server_, SIGKILL);
  ::waitpid(std::exchange(server_, -1), nullptr, 0);
  pollfd waiting{profiles.poll_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&waiting, 1, 10'000), 1);
  profiles.service();
  profiles.service();  // the first has taken what was said before the end
  EXPECT_EQ(::poll(&waiting, 1, 0), 0) << "it would spin";
}

TEST_F(Focus, WithoutAnXServerThereIsNone) {
  ::setenv("DISPLAY", ":7654", 1);
  EXPECT_FALSE(FocusWatch::open());
  ::unsetenv("DISPLAY");
  EXPECT_FALSE(FocusWatch::open());
}

}  // namespace
}  // namespace tagwrench

// A profile on trial, and who chooses the profile where no desktop tells the focus.
#include <gtest/gtest.h>
#include <poll.h>

#include <future>

#include "host/motion/profile_manager.h"
#include "host/sensor/sensor_config.h"
#include "tests/unit/motion/profile_folder.h"

namespace tagwrench {
namespace {

class Trial : public test::ProfileFolder {
 protected:
  Trial() {
    write("mine.yaml", "translation: 1\n");
    profiles_.emplace(ProfileFiles({path("mine.yaml"), "cad"}, default_profile(sensor_)),
                      ControlSocket(path("control")), nullptr);
  }
  std::string asks(ControlClient& client, const std::string& request) {
    auto answer = std::async(std::launch::async, [&] { return client.ask(request); });
    while (answer.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
      if (woken(50)) profiles_->service();
    return answer.get();
  }
  bool woken(int patience_ms) const {
    pollfd waiting{profiles_->poll_fd(), POLLIN, 0};
    return ::poll(&waiting, 1, patience_ms) == 1;
  }
  double translation() const { return profiles_->profile().shaping.translation; }

  /// Motion in x of a push of 0.3 N that has lasted.
  double push() {
    Sample sample;
    sample.status = Status::ok;
    sample.wrench_sigma.setConstant(1e-6);
    for (int i = 0; i < 100; ++i) {
      time_ += std::chrono::milliseconds(20);
      sample.capture_time = TimePoint(time_);
      sample.wrench[0] = i < 20 ? 0 : 0.3;
      profiles_->shape(sample);
    }
    return sample.deflection[0];
  }

  std::optional<ProfileManager> profiles_;
  Duration time_{};
};

TEST_F(Trial, IsInForceAtOnceUntilItIsTakenBack) {
  ControlClient page(path("control"));
  const double before = push();
  ASSERT_GT(before, 0.1);
  const std::string answer = asks(page, "try mine\ntranslation: 0.25\nlock: rotation\n");
  EXPECT_TRUE(answer.starts_with("ok: " + path("mine.yaml") + "\nname: \"mine\"\n")) << answer;
  EXPECT_NE(answer.find("\ntranslation: 0.25\n"), std::string::npos) << answer;
  EXPECT_EQ(translation(), 0.25);
  EXPECT_EQ(profiles_->profile().shaping.lock, Lock::rotation);
  EXPECT_NEAR(push(), before / 4, 1e-3);
  EXPECT_TRUE(parse_live(asks(page, "live"))->on_trial);
  EXPECT_EQ(asks(page, "revert"), "ok: mine\n");
  EXPECT_EQ(translation(), 1);
  EXPECT_NEAR(push(), before, 1e-3);
  EXPECT_FALSE(parse_live(asks(page, "live"))->on_trial);
}

TEST_F(Trial, IsReadBesideTheFrameLoop) {
  ControlClient page(path("control"));
  auto answer =
      std::async(std::launch::async, [&] { return page.ask("try mine\nrotation: 0.5\n"); });
  ASSERT_TRUE(woken(10'000));
  profiles_->service();  // takes the text, and does not read it
  EXPECT_EQ(profiles_->profile().shaping.rotation, 1);
  ASSERT_TRUE(woken(10'000));
  profiles_->service();
  EXPECT_TRUE(answer.get().starts_with("ok:"));
  EXPECT_EQ(profiles_->profile().shaping.rotation, 0.5);
}

TEST_F(Trial, ASecondTextWaitsUntilTheFirstHasBeenTaken) {
  TrialReader reader;
  TrialReader::Text text{"a", 0, "mine", "", "rotation: 0.5\n", default_profile(sensor_)};
  EXPECT_TRUE(reader.read(text));
  EXPECT_FALSE(reader.read(text));
  pollfd waiting{reader.fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&waiting, 1, 10'000), 1);
  EXPECT_FALSE(reader.read(text)) << "or what was read would be lost";
  EXPECT_EQ(reader.take()->read->shaping.rotation, 0.5);
  EXPECT_FALSE(reader.take());
  EXPECT_TRUE(reader.read(text));
}

TEST_F(Trial, OfAMistakeChangesNothingAndSaysTheLine) {
  ControlClient page(path("control"));
  asks(page, "try mine\ntranslation: 0.25\n");
  const std::string answer = asks(page, "try mine\nrotation: 1\ntranslation: [\n");
  EXPECT_TRUE(answer.starts_with("error: " + path("mine.yaml") + ":")) << answer;
  EXPECT_EQ(translation(), 0.25);
  EXPECT_TRUE(asks(page, "try nobody\n").starts_with("error: no profile 'nobody'"));
  EXPECT_TRUE(asks(page, "try mine\n" + std::string(20'000, '#')).starts_with("error:"));
  EXPECT_EQ(translation(), 0.25);
}

TEST_F(Trial, EndsWhenWhoTriesIsHeardOfNoMore) {
  {
    ControlClient killed(path("control"));
    asks(killed, "try mine\ntranslation: 0.25\n");
  }
  pollfd waiting{profiles_->poll_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&waiting, 1, 60'000), 1);
  profiles_->service();
  EXPECT_EQ(translation(), 1);
  EXPECT_EQ(profiles_->take_status_line(),
            "profile mine: who tried it has gone, what was saved is in force again");
  EXPECT_EQ(::poll(&waiting, 1, 0), 0);
}

TEST_F(Trial, OutlivesTheChoiceOfAnotherProfileWhichComesAfterIt) {
  ControlClient page(path("control"));
  asks(page, "try mine\ntranslation: 0.25\n");
  EXPECT_EQ(asks(page, "profile cad"), "ok: cad\n");
  EXPECT_EQ(profiles_->take_status_line(), "profile: cad (as asked), which ends a trial");
  EXPECT_EQ(translation(), 0.25);
  write("mine.yaml", "translation: 0.5\n");
  pollfd waiting{profiles_->poll_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&waiting, 1, 10'000), 1);
  profiles_->service();
  EXPECT_EQ(translation(), 0.25);
  EXPECT_EQ(asks(page, "revert"), "ok: cad\n");
  EXPECT_EQ(asks(page, "profile mine"), "ok: mine\n");
  EXPECT_EQ(translation(), 0.5) << "what was saved meanwhile";
}

TEST_F(Trial, IsOfOneAtATime) {
  ControlClient first(path("control"));
  ControlClient second(path("control"));
  asks(first, "try mine\ntranslation: 0.25\n");
  EXPECT_TRUE(asks(second, "try mine\ntranslation: 4\n").starts_with("error: another"));
  EXPECT_TRUE(asks(second, "revert").starts_with("error:"));
  EXPECT_TRUE(asks(second, "keep").starts_with("error:"));
  EXPECT_FALSE(parse_live(asks(second, "live"))->on_trial);
  EXPECT_EQ(translation(), 0.25);
}

TEST_F(Trial, ThatIsKeptStaysWhenItEnds) {
  ControlClient page(path("control"));
  asks(page, "try cad\nname: other\ntranslation: 0.25\n");
  EXPECT_EQ(asks(page, "keep"), "ok: cad\n");
  EXPECT_EQ(asks(page, "revert"), "ok: mine\n");
  EXPECT_EQ(asks(page, "profile cad"), "ok: cad\n") << "under its own name";
  EXPECT_EQ(translation(), 0.25);
}

TEST_F(Trial, ShowsAProfileWithAllThatItLeavesOut) {
  ControlClient page(path("control"));
  const std::string cad = asks(page, "show cad");
  EXPECT_TRUE(cad.starts_with("ok: \nname: \"cad\"\n")) << cad;
  const Profile read =
      parse_profile(cad.substr(cad.find('\n') + 1), "answer", default_profile(sensor_));
  EXPECT_EQ(read.shaping, load_profile("cad", default_profile(sensor_)).shaping);
  EXPECT_TRUE(asks(page, "show").starts_with("ok: " + path("mine.yaml") + "\n")) << "in force";
}

TEST_F(Trial, LiveTellsWhatWasShapedLast) {
  Sample sample;
  sample.status = Status::saturated;
  sample.wrench[2] = -3;
  profiles_->shape(sample);
  ControlClient watcher(path("control"));
  const auto now = parse_live(asks(watcher, "live"));
  ASSERT_TRUE(now);
  EXPECT_EQ(now->status, Status::saturated);
  EXPECT_EQ(now->wrench, sample.wrench);
  EXPECT_EQ(now->motion, sample.deflection);
}

TEST_F(Trial, AScriptThatTellsTheWindowChoosesTheProfile) {
  ControlClient script(path("control"));
  EXPECT_EQ(asks(script, "window org.freecad.FreeCAD"), "ok: cad\n");
  EXPECT_EQ(profiles_->take_status_line(), "profile: cad (org.freecad.FreeCAD)");
  EXPECT_EQ(asks(script, "window mail"), "ok: mine\n") << "the first";
}

TEST_F(Trial, TheProgramThatConnectedLastChoosesWhereNobodyTellsTheWindow) {
  std::string last;
  profiles_->follow_programs([&] { return std::string_view(last); });
  const auto in_force_with = [&](const std::string& program) {
    last = program;
    Sample sample;
    profiles_->shape(sample);
    return profiles_->profile().name;
  };
  EXPECT_EQ(in_force_with(""), "mine");
  EXPECT_EQ(in_force_with("FreeCAD"), "cad");
  EXPECT_EQ(profiles_->take_status_line(), "profile: cad (FreeCAD)");
  EXPECT_EQ(in_force_with("spnavcfg"), "mine");
  ControlClient script(path("control"));
  asks(script, "window blender");
  EXPECT_EQ(in_force_with("other"), "cad") << "the window wins";
  asks(script, "window");
  EXPECT_EQ(profiles_->profile().name, "mine") << "nobody tells any more: it is for the program";
  EXPECT_EQ(in_force_with("blender"), "cad");
  EXPECT_EQ(in_force_with(""), "mine") << "none is connected: as before the first";
}

}  // namespace
}  // namespace tagwrench

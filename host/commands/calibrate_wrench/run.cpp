#include "host/commands/calibrate_wrench/run.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "host/commands/calibrate_wrench/simulated_person.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kLiveEvery = std::chrono::milliseconds(200);
constexpr int kPatience_ms = 200;

double clock_seconds(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

ReferenceSample to_sample(const ReferenceReading& reading) {
  ReferenceSample out;
  out.time = clock_seconds(reading.time);
  for (int i = 0; i < 6; ++i) {
    out.value[i] = reading.value[static_cast<std::size_t>(i)];
    out.sigma[i] = reading.sigma[static_cast<std::size_t>(i)];
  }
  out.saturated = reading.saturated;
  return out;
}

/// Lines for people on standard error; where that is a terminal, one of them lives.
class Telling {
 public:
  void line(const std::string& text) {
    wipe();
    log_info(text);
  }
  void live(const WrenchGuide& guide) {
    if (!terminal_ || Clock::now() - shown_ < kLiveEvery) return;
    shown_ = Clock::now();
    wipe();
    std::string text = guide.live();
    winsize size{};  // a line that wraps could not be wiped
    if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1)
      text.resize(std::min<std::size_t>(text.size(), size.ws_col - 1u));
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
    open_ = true;
  }
  void wipe() {
    constexpr std::string_view kWipe = "\r\x1b[K";
    if (open_) [[maybe_unused]]
      const ssize_t written = ::write(STDERR_FILENO, kWipe.data(), kWipe.size());
    open_ = false;
  }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0;
  bool open_ = false;
  TimePoint shown_{};
};

/// Single keys from the terminal, or from a program that presses them. Where standard input is a
/// terminal: keys come without Return, and are not shown. Everything is put back at the end.
class Keys {
 public:
  /// `program`: standard input is a pipe, a byte a key.
  explicit Keys(bool program) noexcept {
    if (program) {
      there_ = true;
      return;
    }
    // A program in the background would be stopped for touching the terminal.
    if (::isatty(STDIN_FILENO) == 0 || ::tcgetpgrp(STDIN_FILENO) != ::getpgrp()) return;
    if (::tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    there_ = changed_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
  }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  ~Keys() {
    if (changed_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }

  bool there() const noexcept { return there_; }
  /// -1 where there are no keys.
  int poll_fd() const noexcept { return there_ ? STDIN_FILENO : -1; }
  /// The next key; 0 if none was pressed. Never blocks.
  char next() noexcept {
    if (!there_) return 0;
    pollfd entry{STDIN_FILENO, POLLIN, 0};
    char key = 0;
    if (::poll(&entry, 1, 0) <= 0) return 0;
    if (::read(STDIN_FILENO, &key, 1) == 1) return key;
    there_ = changed_ = false;  // the terminal, or the program, is gone
    return 0;
  }

 private:
  bool there_ = false;
  bool changed_ = false;  ///< the terminal
  termios before_{};
};

class Runner {
 public:
  Runner(const GuideRun& run, WrenchGuide& guide)
      : run_(run),
        guide_(guide),
        source_(*run.at->input.source),
        tracker_(run.at->input.sensor.camera, run.at->input.sensor.target,
                 run.at->input.sensor.rest),
        keys_(run.events->on()) {
    if (run.at->bench)
      person_.emplace(*run.at->bench, *run.plan, run.at->input.sensor.wrench.range);
  }

  GuideEnd run() {
    if (keys_.there() && !run_.events->on())
      log_info("keys: s skips a step, r does the last one again, q stops");
    while (!end_ && !guide_.done()) {
      speak();
      wait();
      take_keys();
      take_readings();
      if (!end_) take_frame();
      keep();
    }
    speak();
    tell_.wipe();
    if (const std::string bad = source_.unusable(); !bad.empty()) log_info(bad);
    return guide_.failed() ? GuideEnd::failed : end_.value_or(GuideEnd::done);
  }

 private:
  void wait() {
    if (termination_requested()) end_ = GuideEnd::stopped;
    if (source_.poll_fd() < 0) return;
    std::array<pollfd, 4> fds{
        {{source_.poll_fd(), POLLIN, 0},
         {run_.stop->get(), POLLIN, 0},
         {run_.reference != nullptr ? run_.reference->poll_fd() : -1, POLLIN, 0},
         {keys_.poll_fd(), POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), kPatience_ms);
    ready_ = fds[0].revents != 0;
  }

  void take_keys() {
    for (char key; (key = keys_.next()) != 0;) {
      if (guide_.done()) return;
      if (key == 's') guide_.skip();
      if (key == 'r') guide_.redo();
      if (key == 'q') end_ = GuideEnd::stopped;
    }
  }

  void take_readings() {
    if (run_.reference == nullptr) return;
    run_.reference->service();
    for (ReferenceReading reading; run_.reference->next(reading);) {
      if (run_.recorder != nullptr) run_.recorder->reading(reading, run_.plan->cell_channel);
      guide_.reading(to_sample(reading));
    }
    if (const std::string trouble = run_.reference->trouble(); !trouble.empty()) say(trouble);
  }

  void take_frame() {
    if (source_.poll_fd() >= 0 && !ready_) return;
    Frame frame;
    switch (source_.read(frame)) {
      case ReadStatus::frame: break;
      case ReadStatus::end: end_ = GuideEnd::ended; return;
      case ReadStatus::disconnected:
        tell_event(record::EventKind::disconnected, source_.detail());
        return;
      case ReadStatus::reconnected:
        tell_event(record::EventKind::reconnected, source_.detail());
        return;
      default: return;
    }
    const Region decoded = frame.readable();
    Track track = tracker_.track(frame);
    if (track.needs_whole_frame && source_.complete(frame)) track = tracker_.track(frame);
    source_.want(track.wanted);
    if (run_.recorder != nullptr) run_.recorder->frame(frame, decoded, source_.raw(), track);
    const bool news = track.diagnostic != last_diagnostic_ || is_trouble(track.diagnostic);
    if (track.diagnostic != Diagnostic::none && news)
      say(diagnostic_text(track.diagnostic, track.details));
    if (track.diagnostic != Diagnostic::none) last_diagnostic_ = track.diagnostic;
    const double time = clock_seconds(frame.capture_time);
    if (!first_time_) first_time_ = time;
    if (run_.seconds && time - *first_time_ > *run_.seconds) {
      end_ = GuideEnd::stopped;
      return;
    }
    if (person_) person_->look_at(guide_);
    guide_.frame(time, track);
    if (!guide_.done()) tell_.live(guide_);
    tell_events(frame, track);
  }

  void tell_events(const Frame& frame, const Track& track) {
    if (!run_.events->on()) return;
    const std::size_t done = guide_.records().size() + guide_.skipped().size();
    const Vector6 covered = guide_.coverage().covered();
    run_.events->progress(static_cast<double>(done) /
                          static_cast<double>(std::max<std::size_t>(1, run_.plan->steps.size())));
    run_.events->coverage({{"axes", std::vector<double>(covered.begin(), covered.end())}});
    run_.events->picture(frame.image, {track.corners.data(), track.corner_count});
    if (!guide_.done()) run_.events->live(guide_.live());
  }

  void speak() {
    for (GuideLine line; guide_.next(line);) {
      const bool warning = line.kind == GuideLine::Kind::warning;
      if (warning && run_.events->on())
        run_.events->line("warning", line.text);
      else
        say((line.kind == GuideLine::Kind::task ? "> " : "") + line.text);
    }
  }

  /// What people are told is in the recording too.
  void say(const std::string& line) { tell_event(record::EventKind::note, line); }
  void tell_event(record::EventKind kind, const std::string& line) {
    tell_.line(line);
    if (run_.recorder != nullptr) run_.recorder->event(kind, line);
  }

  /// What was accepted is not lost, whatever comes.
  void keep() {
    if (run_.recorder != nullptr) {
      run_.recorder->follow(guide_.records());
      if (const std::string trouble = run_.recorder->trouble(); !trouble.empty())
        tell_.line(trouble + "; the calibration goes on, the recording has ended");
    }
    if (guide_.records().size() == kept_ && guide_.skipped().size() == skipped_) return;
    kept_ = guide_.records().size();
    skipped_ = guide_.skipped().size();
    if (kept_ > 0) save_progress(run_.progress, run_.of, {guide_.records(), guide_.skipped()});
  }

  const GuideRun& run_;
  WrenchGuide& guide_;
  FrameSource& source_;
  Tracker tracker_;
  Keys keys_;
  Telling tell_;
  std::optional<SimulatedPerson> person_;
  std::optional<GuideEnd> end_;
  std::optional<double> first_time_;
  Diagnostic last_diagnostic_ = Diagnostic::none;
  bool ready_ = true;
  std::size_t kept_ = 0;
  std::size_t skipped_ = 0;
};

}  // namespace

GuideEnd run_guide(const GuideRun& run, WrenchGuide& guide) { return Runner(run, guide).run(); }

}  // namespace tagwrench

#include "host/commands/calibrate_wrench/run.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "host/commands/calibrate_wrench/simulated_person.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
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

constexpr const char* kGainSigma = "reference_gain_sigma";
constexpr std::pair<const char*, std::string RecordedCalibration::*> kTexts[] = {
    {"plan", &RecordedCalibration::plan},
    {"plan_yaml", &RecordedCalibration::plan_yaml},
    {"reference", &RecordedCalibration::reference},
    {"notes", &RecordedCalibration::notes}};

/// Exact but for the rounding of the seconds, far less than the time between frames.
TimePoint time_point(double seconds) {
  return TimePoint(Duration(static_cast<Duration::rep>(std::llround(seconds * 1e9))));
}

constexpr Duration kRounding = std::chrono::microseconds(1);  // of marks
constexpr int kMaxZeros = 100'000;
constexpr double kMaxNumber = 1e12;

[[noreturn]] void damaged(const record::RecordingReader& recording, const std::string& what) {
  throw ConfigError("recording:{}: {}; calibrate anew", recording.path().string(), what);
}

/// A reading with the number that orders it among the marks.
struct NumberedReading {
  std::int64_t id = 0;
  ReferenceSample sample;
};

std::vector<NumberedReading> read_readings(record::RecordingReader& recording,
                                           const WrenchPlan& plan) {
  const int axes = plan.reference == ReferenceKind::six_axis ? 6 : 1;
  std::vector<NumberedReading> out;
  if (plan.reference == ReferenceKind::masses) return out;
  for (record::ReferenceRecord row; recording.next(row);) {
    if (row.axes != axes || (axes == 1 && row.channel != plan.cell_channel)) continue;
    NumberedReading reading{row.id, {clock_seconds(row.time), {}, {}, row.saturated}};
    reading.sample.value.setZero();
    reading.sample.sigma.setZero();
    bool numbers = true;
    for (int i = 0; i < axes; ++i) {
      const auto at = static_cast<std::size_t>(i);
      reading.sample.value[i] = row.value[at];
      reading.sample.sigma[i] = row.sigma[at];
      numbers = numbers && std::abs(row.value[at]) < kMaxNumber && row.sigma[at] >= 0 &&
                row.sigma[at] < kMaxNumber;
    }
    if (!numbers) damaged(recording, "a reading of the reference is not in newtons");
    out.push_back(reading);
  }
  return out;
}

/// As the guide takes them.
void add_readings(const std::vector<NumberedReading>& readings, bool hold, std::int64_t id,
                  StepRecord& record) {
  const double from = record.frames.front().time;
  const double to = record.frames.back().time;
  for (const NumberedReading& reading : readings) {
    const double time = reading.sample.time;
    const bool within = hold ? time >= from && time <= to : time > from - kReadingsBeforeTaking;
    if (within && reading.id < id) record.readings.push_back(reading.sample);
  }
}

void track_frames(Input& input, const std::vector<AcceptedStep>& steps,
                  std::vector<StepRecord>& records) {
  FrameSource& source = *input.source;
  Tracker tracker = make_tracker(input.sensor);
  Frame frame;
  for (ReadStatus status; (status = source.read(frame)) != ReadStatus::end;) {
    if (status != ReadStatus::frame) continue;
    Track track = tracker.track(frame);
    if (track.needs_whole_frame && source.complete(frame)) track = tracker.track(frame);
    source.want(track.wanted);
    if (track.status != Status::ok) continue;
    const TimePoint time = frame.capture_time;
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (time >= steps[i].from - kRounding && time <= steps[i].to + kRounding)
        records[i].frames.push_back({clock_seconds(time), track.displacement, track.covariance});
  }
  if (const std::string bad = source.unusable(); !bad.empty()) log_info(bad);
}

}  // namespace

GuideEnd run_guide(const GuideRun& run, WrenchGuide& guide) { return Runner(run, guide).run(); }

void put_into(record::Head& head, const RecordedCalibration& calibration) {
  for (const auto& [key, text] : kTexts) head.more.emplace_back(key, calibration.*text);
  head.more.emplace_back(kGainSigma, fmt::format("{}", calibration.gain_sigma));
}

RecordedCalibration calibration_in(const record::Head& head) {
  RecordedCalibration out;
  for (const auto& [key, value] : head.more) {
    for (const auto& [name, text] : kTexts)
      if (key == name) out.*text = value;
    if (key != kGainSigma) continue;
    const double number = command_line::to_number(value).value_or(0);
    out.gain_sigma = number >= 0 && number < 1 ? number : 0;
  }
  return out;
}

void CalibrationRecorder::frame(const Frame& frame, const Region& decoded, const RawFrame& raw,
                                const Track& track) noexcept {
  latest_ = frame.capture_time;
  writer_.frame(frame, decoded, raw);
  writer_.track(track);
}

void CalibrationRecorder::reading(const ReferenceReading& reading, int channel) noexcept {
  record::ReferenceRecord row;
  row.time = reading.time;
  row.time_sigma = reading.time_sigma;
  row.channel = channel;
  row.axes = reading.axes;
  for (std::size_t i = 0; i < std::min<std::size_t>(reading.axes, 6); ++i) {
    row.value[i] = reading.value[i];
    row.sigma[i] = reading.sigma[i];
  }
  row.saturated = reading.saturated;
  writer_.reference(row);
}

void CalibrationRecorder::follow(const std::vector<StepRecord>& records) {
  std::vector<Marked> now;
  for (const StepRecord& record : records)
    now.push_back(
        {record.step, record.zero, record.frames.front().time, record.frames.back().time});
  const auto [lost, fresh] = std::mismatch(marked_.begin(), marked_.end(), now.begin(), now.end());
  for (auto old = marked_.end(); old != lost;) {
    --old;
    writer_.withdraw(old->step, time_point(old->from));
  }
  for (auto m = fresh; m != now.end(); ++m) {
    writer_.mark(m->step, true, time_point(m->from), m->zero);
    writer_.mark(m->step, false, time_point(m->to));
  }
  marked_ = std::move(now);
}

std::string CalibrationRecorder::trouble() {
  if (told_ || !writer_.state().failed) return {};
  told_ = true;
  return writer_.failure();
}

std::vector<AcceptedStep> accepted_steps(record::RecordingReader& recording,
                                         const WrenchPlan& plan) {
  std::vector<AcceptedStep> steps;
  for (const record::Mark& mark : recording.marks()) {
    if (static_cast<std::size_t>(mark.step) >= plan.steps.size())
      damaged(recording, fmt::format("its step {} is not in the plan", mark.step + 1));
    if (mark.begin) {
      if (mark.zero < 0 || mark.zero > kMaxZeros) damaged(recording, "its marks are damaged");
      steps.push_back({mark.step, mark.zero, mark.time, mark.time, 0});
      continue;
    }
    if (steps.empty() || steps.back().step != mark.step || steps.back().id != 0 ||
        mark.time < steps.back().from)
      damaged(recording, "its marks are damaged");
    steps.back().to = mark.time;
    steps.back().id = mark.id;
  }
  if (!steps.empty() && steps.back().id == 0) steps.pop_back();  // cut off there
  if (steps.empty()) {
    throw ConfigError(
        "recording:{}: holds no step of a calibration; record one with `tagwrench calibrate wrench "
        "--record FILE`",
        recording.path().string());
  }
  if (!zeros_fit(steps, plan)) damaged(recording, "its loads have no rest to count from");
  return steps;
}

std::vector<StepRecord> replay_steps(Input& input, record::RecordingReader& readings,
                                     const std::vector<AcceptedStep>& steps,
                                     const WrenchPlan& plan) {
  std::vector<StepRecord> records;
  for (const AcceptedStep& step : steps) records.push_back({step.step, step.zero, {}, {}});
  const std::vector<NumberedReading> all = read_readings(readings, plan);
  track_frames(input, steps, records);
  for (std::size_t i = 0; i < records.size(); ++i) {
    StepRecord& record = records[i];
    if (record.frames.size() < 2) {
      damaged(readings, fmt::format("{} has no frames in which --sensor's tags can be tracked",
                                    describe(plan, record.step)));
    }
    const StepKind kind = plan.steps[static_cast<std::size_t>(record.step)].kind;
    add_readings(all, kind == StepKind::rest || kind == StepKind::mass, steps[i].id, record);
    if (plan.reference != ReferenceKind::masses && record.readings.empty())
      damaged(readings,
              fmt::format("{} has no readings of the reference", describe(plan, record.step)));
  }
  return records;
}

std::string not_recorded(const std::vector<AcceptedStep>& steps, const WrenchPlan& plan) {
  std::string out;
  for (int s = 0; s < static_cast<int>(plan.steps.size()); ++s) {
    const bool there =
        std::any_of(steps.begin(), steps.end(), [s](const AcceptedStep& a) { return a.step == s; });
    if (!there) out += (out.empty() ? "" : ", ") + describe(plan, s);
  }
  return out;
}

}  // namespace tagwrench

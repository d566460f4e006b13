#include "host/app/pipeline.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <exception>
#include <utility>

#include "host/core/log.h"
#include "host/tracker/diagnostic_text.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

// A frame is missing when it is this late. With the watchdog's delay both stay below 80 ms, the
// time after which robot teleoperation programs take a silent device for gone.
constexpr Duration kGrace = milliseconds(40);
constexpr Duration kWatchdogGrace = milliseconds(60);
// A camera that slows down in dim light is late, not lost; slower than this it is lost.
constexpr Duration kSlowestInterval = milliseconds(250);
constexpr std::size_t kOthers = 3;  // source, stop, profiles

}  // namespace

Pipeline::Pipeline(FrameSource& source, Tracker& tracker, WrenchEstimator& wrench,
                   ProfileManager& profiles, std::vector<Output*> outputs, Watchdog& watchdog,
                   int stop_fd, FrameLog* log)
    : source_(source),
      tracker_(tracker),
      wrench_(wrench),
      profiles_(profiles),
      outputs_(std::move(outputs)),
      polled_(outputs_.size() + kOthers),
      watchdog_(watchdog),
      stop_fd_(stop_fd),
      log_(log),
      intervals_{source.format().period, source.format().period, source.format().period},
      interval_(source.format().period) {}

/// The life of a frame.
void Pipeline::step(Frame& frame) noexcept {
  const Region decoded = frame.readable();
  Track track = tracker_.track(frame);  // pixels -> displacement of the platform
  if (track.needs_whole_frame && source_.complete(frame)) track = tracker_.track(frame);
  source_.want(track.wanted);
  Sample sample{.sequence = frame.sequence,
                .capture_time = frame.capture_time,
                .latency_origin = frame.latency_origin,
                .dropped = frame.dropped};
  wrench_.estimate(track, sample);  // displacement -> newtons
  sample.buttons = pressed();
  sample.touched = frame.touched || sample.buttons != 0;
  follow_zero(sample, wrench_.noise(track));  // less what reads untouched
  profiles_.shape(sample);                    // newtons -> motion and buttons of an input device
  send(sample, frame.recorded_latency);       // to every output
  if (log_ != nullptr) log_->frame({frame, decoded, source_.raw(), track, sample});
  ++report_.frames;
  report_.dropped += sample.dropped;
  if (carries_numbers(sample.status)) ++report_.with_numbers;
  say_diagnostic(track);
}

RunReport Pipeline::run(const RunLimits& limits) {
  start_ = last_arrival_ = std::chrono::steady_clock::now();
  while (!end_) {
    if (limits.frames && report_.frames >= *limits.frames) break;
    if (limits.time && std::chrono::steady_clock::now() - start_ >= *limits.time) break;
    wait(wake_time(limits));
    const bool came = source_ready_ && read_source();
    const TimePoint now = std::chrono::steady_clock::now();
    if (!came && now >= missing_at()) send_neutral({});
    if (now >= next_move_) move_on(now);
  }
  watchdog_.stand_down();
  report_.end = end_.value_or(RunReport::End::limit);
  report_.elapsed = std::chrono::steady_clock::now() - start_;
  return report_;
}

TimePoint Pipeline::wake_time(const RunLimits& limits) const noexcept {
  const TimePoint wake = std::min(missing_at(), next_move_);
  return limits.time ? std::min(wake, start_ + *limits.time) : wake;
}

/// When the next frame is so late that it is missing: never, if all is neutral already or the
/// source has no clock.
TimePoint Pipeline::missing_at() const noexcept {
  if (neutral_ || source_.poll_fd() < 0) return TimePoint::max();
  return last_arrival_ + interval_ + kGrace;
}

/// Blocks until the source, an output's client or a stop wants attention, or the time has come.
void Pipeline::wait(TimePoint until) noexcept {
  std::vector<pollfd>& fds = polled_;
  const int source_fd = source_.poll_fd();
  fds[0] = {source_fd, POLLIN, 0};
  fds[1] = {stop_fd_, POLLIN, 0};
  fds[2] = {profiles_.poll_fd(), POLLIN, 0};
  for (std::size_t i = 0; i < outputs_.size(); ++i)
    fds[i + kOthers] = {outputs_[i]->poll_fd(), POLLIN, 0};

  timespec timeout{};
  const bool endless = until == TimePoint::max() && source_fd >= 0;
  if (source_fd >= 0 && !endless) {
    const TimePoint now = std::chrono::steady_clock::now();
    const Duration left = until > now ? until - now : Duration::zero();
    timeout.tv_sec = left.count() / 1'000'000'000;
    timeout.tv_nsec = left.count() % 1'000'000'000;
  }
  const int ready = ::ppoll(fds.data(), fds.size(), endless ? nullptr : &timeout, nullptr);
  source_ready_ = source_fd < 0 || (ready > 0 && fds[0].revents != 0);
  if (ready <= 0) return;
  if (fds[1].revents != 0) end_ = RunReport::End::interrupted;
  if (fds[2].revents != 0) profiles_.service();
  if (const std::string status_line = profiles_.take_status_line(); !status_line.empty())
    say(status_line);
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    if (fds[i + kOthers].revents == 0) continue;
    if (const std::string_view status_line = outputs_[i]->service(); !status_line.empty())
      say(status_line);
  }
}

/// Takes what the source has; false if that was no frame.
bool Pipeline::read_source() noexcept {
  Frame frame;
  switch (source_.read(frame)) {
    case ReadStatus::frame:
      note_arrival(std::chrono::steady_clock::now());
      if (!neutral_) guard();  // or a slow search for the tags would look like a hang
      step(frame);
      return true;
    case ReadStatus::nothing:
      return false;
    case ReadStatus::missing:
      send_neutral(frame.recorded_latency);
      return false;
    case ReadStatus::disconnected:
      send_neutral({});
      say(source_.detail());
      if (log_ != nullptr) log_->disconnected(source_.detail());
      return false;
    case ReadStatus::reconnected:
      say(source_.detail());
      if (log_ != nullptr) log_->reconnected(source_.detail());
      return false;
    case ReadStatus::end:
      end_ = RunReport::End::source_ended;
      return false;
  }
  return false;
}

/// The median of three intervals: one hiccup does not delay the next neutral, a camera that slows
/// down is believed.
void Pipeline::note_arrival(TimePoint now) noexcept {
  intervals_ = {intervals_[1], intervals_[2], now - last_arrival_};
  last_arrival_ = now;
  std::array<Duration, 3> sorted = intervals_;
  std::sort(sorted.begin(), sorted.end());
  const Duration period = source_.format().period;
  interval_ = std::clamp(sorted[1], period, std::max(period, kSlowestInterval));
}

void Pipeline::send(Sample& sample, std::optional<Duration> recorded_latency) noexcept {
  sample.output_time = recorded_latency ? sample.latency_origin + *recorded_latency
                                        : std::chrono::steady_clock::now();
  if (carries_numbers(sample.status)) guard();
  for (Output* output : outputs_) note(output->send(sample), *output);
  last_sample_ = sample;
  neutral_ = !carries_numbers(sample.status);
  const bool steady = profiles_.period() > Duration::zero() && source_.poll_fd() >= 0;
  if (neutral_ || !steady) {
    next_move_ = TimePoint::max();
    move(sample);
  } else if (next_move_ == TimePoint::max()) {
    next_move_ = TimePoint::min();  // at once, and from then on by the clock
  }
  if (neutral_) watchdog_.stand_down();
}

void Pipeline::move(const Sample& sample) noexcept {
  for (Output* output : outputs_) note(output->move(sample), *output);
}

/// Between frames devices move on, to where the motion is by now.
void Pipeline::move_on(TimePoint now) noexcept {
  const Duration period = profiles_.period();
  next_move_ = next_move_ == TimePoint::min() || now - next_move_ > period ? now + period
                                                                           : next_move_ + period;
  Sample sample = last_sample_;
  profiles_.move_on(sample, sample.capture_time + (now - sample.latency_origin));
  move(sample);
}

void Pipeline::note(SendStatus status, const Output& output) noexcept {
  if (status == SendStatus::skipped) ++report_.skipped;
  if (status != SendStatus::failed || end_) return;
  report_.failure = output.failure();
  end_ = RunReport::End::output_failed;
}

std::uint32_t Pipeline::pressed() const noexcept {
  std::uint32_t buttons = 0;
  for (Output* output : outputs_) buttons |= output->pressed();
  return buttons;
}

void Pipeline::follow_zero(Sample& sample, const Vector6& noise) noexcept {
  if (zero_ == nullptr) return;
  if (profiles_.take_zero()) zero_->ask();
  if (source_.poll_fd() >= 0 && sleep_.woke(time_asleep())) zero_->wake();
  zero_->follow(sample, noise);
  if (const std::string_view line = zero_text(zero_->take_answer()); !line.empty()) say(line);
}

/// If the loop should hang from here on, the watchdog sends neutral.
void Pipeline::guard() noexcept { watchdog_.expect_by(last_arrival_ + interval_ + kWatchdogGrace); }

/// The frame that should have come did not: one sample that says so, with zeros.
void Pipeline::send_neutral(std::optional<Duration> recorded_latency) noexcept {
  if (neutral_) return;
  Sample sample{.sequence = last_sample_.sequence,
                .capture_time = last_sample_.capture_time,
                .latency_origin = last_sample_.latency_origin,
                .status = Status::lost};
  profiles_.shape(sample);  // or it would go on from before the gap
  send(sample, recorded_latency);
  if (log_ != nullptr) log_->missing(sample);
}

/// What was wrong is not, once the target is held.
void Pipeline::say_diagnostic(const Track& track) noexcept {
  if (track.status == Status::ok && trouble_shown_) {
    trouble_shown_ = false;
    for (Output* output : outputs_) output->notice({});
  }
  // The tracker itself sees to it that troubles are not said too often.
  const bool trouble = is_trouble(track.diagnostic);
  if (track.diagnostic == Diagnostic::none || (track.diagnostic == last_diagnostic_ && !trouble))
    return;
  last_diagnostic_ = track.diagnostic;
  try {
    const std::string line = diagnostic_text(track.diagnostic, track.details);
    if (track.status != Status::ok && track.diagnostic != Diagnostic::rest_learned)
      report_.trouble = line;
    trouble_shown_ = trouble_shown_ || (trouble && track.status != Status::ok);
    say(line);
  } catch (const std::exception&) {
    return;  // out of memory: unsaid
  }
}

void Pipeline::say(std::string_view line) noexcept {
  bool shown = false;
  for (Output* output : outputs_) shown = output->notice(line) || shown;
  if (!shown) log_info(line);
}

}  // namespace tagwrench

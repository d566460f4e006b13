#include "host/app/pipeline.h"

#include <algorithm>
#include <utility>

#include "host/core/log.h"

namespace tagwrench {
namespace {

constexpr std::size_t kOthers = 3;  // source, stop, profiles

TimePoint clock_now() noexcept { return std::chrono::steady_clock::now(); }

/// When the outputs get it; of a recording that is replayed, when they got it.
void stamp(Sample& sample, std::optional<Duration> recorded_latency) noexcept {
  sample.output_time = recorded_latency ? sample.latency_origin + *recorded_latency : clock_now();
}

using std::chrono::milliseconds;

// A frame is missing when it is this late. With the watchdog's delay both stay below 80 ms, the
// time after which robot teleoperation programs take a silent device for gone.
constexpr Duration kGrace = milliseconds(40);
constexpr Duration kWatchdogGrace = milliseconds(60);
// A camera that slows down in dim light is late, not lost; slower than this it is lost.
constexpr Duration kSlowestInterval = milliseconds(250);

}  // namespace

Pipeline::Pipeline(FrameSource& source, Tracker& tracker, WrenchEstimator& wrench,
                   ProfileManager& profiles, std::vector<Output*> outputs, Watchdog& watchdog,
                   int stop_fd, FrameLog* log)
    : source_(source),
      tracker_(tracker),
      wrench_(wrench),
      profiles_(profiles),
      outputs_(std::move(outputs)),
      stop_fd_(stop_fd),
      log_(log),
      frames_(watchdog, source.format().period),
      polled_(outputs_.size() + kOthers) {}

/// The life of a frame, and what goes on between frames.
RunReport Pipeline::run(const RunLimits& limits) noexcept {
  const TimePoint start = clock_now();
  const TimePoint limit = limits.time ? start + *limits.time : TimePoint::max();
  frames_.begin(start);
  while (!end_ && (!limits.frames || report_.frames < *limits.frames) && clock_now() < limit) {
    wait(std::min({missing_at(), scheduler_.next(), limit}));
    Frame frame;
    const ReadStatus status = source_ready_ ? source_.read(frame) : ReadStatus::nothing;
    if (status == ReadStatus::frame) {
      frames_.frame_came(clock_now(), source_.format().period);
      if (!neutral_) frames_.arm();  // or a slow search for the tags would look like a hang
      const Region decoded = frame.readable();
      Track track = tracker_.track(frame);  // pixels -> displacement of the platform
      if (track.needs_whole_frame && source_.complete(frame)) track = tracker_.track(frame);
      source_.want(track.wanted);

      Sample sample{.sequence = frame.sequence,
                    .capture_time = frame.capture_time,
                    .latency_origin = frame.latency_origin,
                    .dropped = frame.dropped};
      wrench_.estimate(track, sample);  // displacement -> newtons
      for (const Output* output : outputs_) sample.buttons |= output->pressed();
      sample.touched = frame.touched || sample.buttons != 0;
      follow_zero(sample, wrench_.noise(track));  // less what reads untouched
      profiles_.shape(sample);  // newtons -> motion and buttons of an input device

      stamp(sample, frame.recorded_latency);
      const bool numbers = carries_numbers(sample.status);
      if (numbers) frames_.arm();
      for (Output* output : outputs_) note(output->send(sample), *output);
      last_sample_ = sample;
      neutral_ = !numbers;

      const TimePoint now = clock_now();
      const auto move =
          scheduler_.sample(numbers, live() ? profiles_.period() : Duration::zero(), now);
      if (move != OutputScheduler::Move::none) {  // or their clock's turn comes between frames
        const Sample shown = move == OutputScheduler::Move::on ? moved_on(now) : sample;
        for (Output* output : outputs_) note(output->move(shown), *output);
      }
      if (!numbers) frames_.stand_down();

      if (log_ != nullptr) log_->frame({frame, decoded, source_.raw(), track, sample});
      ++report_.frames;
      report_.dropped += sample.dropped;
      if (numbers) ++report_.with_numbers;
      lines_.say_diagnostic(track);
    } else {
      change(status, frame.recorded_latency);
    }
    if (const TimePoint now = clock_now(); scheduler_.due(now, profiles_.period())) {
      const Sample shown = moved_on(now);
      for (Output* output : outputs_) note(output->move(shown), *output);
    }
  }
  frames_.stand_down();
  report_.end = end_.value_or(RunReport::End::limit);
  report_.trouble = lines_.trouble();
  report_.elapsed = clock_now() - start;
  return report_;
}

/// The frame that should have come did not: one sample that says so, with zeros.
void Pipeline::miss(std::optional<Duration> recorded_latency) noexcept {
  if (neutral_) return;
  Sample sample{.sequence = last_sample_.sequence,
                .capture_time = last_sample_.capture_time,
                .latency_origin = last_sample_.latency_origin,
                .status = Status::lost};
  profiles_.shape(sample);  // or it would go on from before the gap
  stamp(sample, recorded_latency);
  for (Output* output : outputs_) note(output->send(sample), *output);
  scheduler_.sample(/*numbers=*/false, {}, {});
  for (Output* output : outputs_) note(output->move(sample), *output);
  frames_.stand_down();
  last_sample_ = sample;
  neutral_ = true;
  if (log_ != nullptr) log_->missing(sample);
}

/// What the source had that was no frame.
void Pipeline::change(ReadStatus status, std::optional<Duration> recorded_latency) noexcept {
  if (status == ReadStatus::missing) miss(recorded_latency);
  if (status == ReadStatus::disconnected) miss({});
  if (status == ReadStatus::disconnected || status == ReadStatus::reconnected)
    lines_.say(source_.detail());
  if (log_ != nullptr && status == ReadStatus::disconnected) log_->disconnected(source_.detail());
  if (log_ != nullptr && status == ReadStatus::reconnected) log_->reconnected(source_.detail());
  if (status == ReadStatus::end) end_ = RunReport::End::source_ended;
  if (clock_now() >= missing_at()) miss({});
}

/// Never, if all is neutral already or the source has no clock.
TimePoint Pipeline::missing_at() const noexcept {
  return neutral_ || !live() ? TimePoint::max() : frames_.missing_at();
}

/// Blocks until the source, an output's client or a stop wants attention, or the time has come.
void Pipeline::wait(TimePoint until) noexcept {
  const int source_fd = source_.poll_fd();
  polled_[0] = {source_fd, POLLIN, 0};
  polled_[1] = {stop_fd_, POLLIN, 0};
  polled_[2] = {profiles_.poll_fd(), POLLIN, 0};
  for (std::size_t i = 0; i < outputs_.size(); ++i)
    polled_[i + kOthers] = {outputs_[i]->poll_fd(), POLLIN, 0};

  timespec timeout{};
  const bool endless = until == TimePoint::max() && source_fd >= 0;
  if (source_fd >= 0 && !endless) {
    const TimePoint now = clock_now();
    const Duration left = until > now ? until - now : Duration::zero();
    timeout.tv_sec = left.count() / 1'000'000'000;
    timeout.tv_nsec = left.count() % 1'000'000'000;
  }
  const int ready = ::ppoll(polled_.data(), polled_.size(), endless ? nullptr : &timeout, nullptr);
  source_ready_ = source_fd < 0 || (ready > 0 && polled_[0].revents != 0);
  if (ready <= 0) return;
  if (polled_[1].revents != 0) end_ = RunReport::End::interrupted;
  if (polled_[2].revents != 0) profiles_.service();
  lines_.say(profiles_.take_status_line());
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    if (polled_[i + kOthers].revents == 0) continue;
    lines_.say(outputs_[i]->service());
  }
}

void Pipeline::follow_zero(Sample& sample, const Vector6& noise) noexcept {
  if (zero_ == nullptr) return;
  if (profiles_.take_zero()) zero_->ask();
  if (live() && sleep_.woke(time_asleep())) zero_->wake();
  zero_->follow(sample, noise);
  lines_.say(zero_text(zero_->take_answer()));
}

/// What devices show by now: between frames they move on, to where the motion is.
Sample Pipeline::moved_on(TimePoint now) noexcept {
  Sample sample = last_sample_;
  profiles_.move_on(sample, sample.capture_time + (now - sample.latency_origin));
  return sample;
}

void Pipeline::note(SendStatus status, const Output& output) noexcept {
  if (status == SendStatus::skipped) ++report_.skipped;
  if (status != SendStatus::failed || end_) return;
  report_.failure = output.failure();
  end_ = RunReport::End::output_failed;
}

FrameWatch::FrameWatch(Watchdog& watchdog, Duration period) noexcept
    : watchdog_(watchdog), intervals_{period, period, period}, interval_(period) {}

void FrameWatch::frame_came(TimePoint now, Duration period) noexcept {
  intervals_ = {intervals_[1], intervals_[2], now - last_arrival_};
  last_arrival_ = now;
  std::array<Duration, 3> sorted = intervals_;
  std::sort(sorted.begin(), sorted.end());
  interval_ = std::clamp(sorted[1], period, std::max(period, kSlowestInterval));
}

TimePoint FrameWatch::missing_at() const noexcept { return last_arrival_ + interval_ + kGrace; }

void FrameWatch::arm() noexcept { watchdog_.expect_by(last_arrival_ + interval_ + kWatchdogGrace); }

OutputScheduler::Move OutputScheduler::sample(bool numbers, Duration period,
                                              TimePoint now) noexcept {
  if (!numbers || period <= Duration::zero()) {
    next_ = TimePoint::max();
    return Move::with_sample;
  }
  if (next_ == TimePoint::max()) next_ = now;  // at once, and from then on by the clock
  return due(now, period) ? Move::on : Move::none;
}

void StatusLines::say(std::string_view line) noexcept {
  if (line.empty()) return;
  bool shown = false;
  for (Output* output : outputs_) shown = output->notice(line) || shown;
  if (!shown) log_info(line);
}

void StatusLines::say_diagnostic(const Track& track) noexcept {
  if (track.status == Status::ok && trouble_shown_) {
    trouble_shown_ = false;
    for (Output* output : outputs_) output->notice({});
  }
  // The tracker itself sees to it that troubles are not said too often.
  const bool trouble = is_trouble(track.diagnostic);
  if (track.diagnostic == Diagnostic::none || (track.diagnostic == last_diagnostic_ && !trouble))
    return;
  last_diagnostic_ = track.diagnostic;
  const std::string line = diagnostic_text(track.diagnostic, track.details);
  if (track.status != Status::ok && track.diagnostic != Diagnostic::rest_learned) trouble_ = line;
  trouble_shown_ = trouble_shown_ || (trouble && track.status != Status::ok);
  say(line);
}

}  // namespace tagwrench

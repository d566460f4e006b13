#include "host/web/bridge/web_bridge.h"

#include <poll.h>

#include <algorithm>
#include <exception>
#include <future>
#include <sstream>
#include <utility>

#include "host/core/axis_names.h"
#include "host/core/log.h"
#include "host/motion/control_socket.h"
#include "host/tracker/tracker.h"
#include "host/web/server/live_feed.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kTick{500};
constexpr unsigned kTicksBetweenLooks = 4;  // at cameras and programs
constexpr unsigned kTicksBetweenTrials = 2;
constexpr std::string_view kProfileNews = "profile";

/// Full scale per axis, as samples have it: what the calibration vouches for, else what the
/// sensor's shaping takes for full.
Vector6 shown_range(const SensorConfig& sensor) {
  const WrenchEstimator wrench(sensor.wrench);
  Vector6 range = range_through(wrench.tool(), sensor.wrench.range);
  for (int i = 0; i < 6; ++i)
    if (!(range[i] > 0 && range[i] < kUnknownRange)) range[i] = 1.5 * sensor.shaping.full_scale[i];
  return range;
}

/// The message. Throws ConfigError if the calibration cannot be read.
json hello_of(const RunFacts& facts, const std::string& recordings) {
  const SensorConfig& sensor = facts.sensor;
  json calibrated = nullptr;
  json from_springs = json::array();
  if (!sensor.calibration.empty() && !sensor.wrench_from.date.empty())
    calibrated = sensor.wrench_from.date;
  std::istringstream completed(sensor.completed_axes);
  for (std::string axis; completed >> axis;) from_springs.push_back(axis);
  if (sensor.calibration.empty())
    for (const char* axis : kWrenchAxes) from_springs.push_back(axis);
  const Vector6 range = shown_range(sensor);
  json mounting = json::array();  // row by row
  for (int i = 0; i < 9; ++i) mounting.push_back(sensor.shaping.hid_R_camera(i / 3, i % 3));
  json cells = json::array();
  for (int i = 0; facts.board && i < 4; ++i) cells.push_back(i);
  return {{"type", "hello"},
          {"protocol", 1},
          {"version", TAGWRENCH_VERSION},
          {"name", facts.name},
          {"source", facts.format.description},
          {"sensor", facts.place.sensor.empty() ? "built in" : facts.place.sensor},
          {"camera",
           {{"width", facts.format.width},
            {"height", facts.format.height},
            {"mirrored", sensor.camera.mirrored}}},
          {"range_n", {range[0], range[1], range[2]}},
          {"range_nm", {range[3], range[4], range[5]}},
          {"hid_R_camera", mounting},
          {"calibrated", calibrated},
          {"axes_from_springs", from_springs},
          {"folder", recordings},
          {"can",
           {{"camera_settings", !facts.camera_device.empty()},
            {"led", facts.board},
            {"cells", cells},
            {"profiles", facts.profiles},
            {"record", facts.head.has_value()},
            {"jobs", possible_jobs(facts.place)}}}};
}

}  // namespace

WebBridge::WebBridge(const WebBridgeOptions& options, int stop)
    : own_profiles_(options.own_profiles),
      recordings_(options.recordings),
      server_(options.server),
      control_(stop),
      stop_(stop),
      resume_(make_event()) {
  if (!recordings_.path().empty()) server_.serve_folder("/files/recordings/", recordings_.path());
  Jobs::Hooks hooks;
  hooks.want_camera = [this] { control_.want_camera(); };
  hooks.give_back_camera = [this] { give_back_camera(); };
  hooks.tell = [this](const json& job) { server_.send_all({{"type", "job"}, {"job", job}}); };
  hooks.show = [this](const JobPicture& picture) { show(picture); };
  hooks.changed = [this] { send_state(); };
  jobs_.emplace(server_.context(), options.program, std::move(hooks));
  server_.watch_pictures([this](const ImageView& picture) {
    if (!figures_) return;
    const SeenNow seen = views_.seen.get();
    figures_->look(picture, {seen.corners.data(), seen.corner_count});
  });
}

WebBridge::~WebBridge() {
  if (started_) {
    in_server([this] {  // all that belongs to its thread
      ticker_.reset();
      jobs_.reset();
      profiles_.reset();
    });
    server_.stop();  // from here on nobody asks
  }
  if (ender_.joinable()) ender_.join();
}

void WebBridge::start() {
  server_.start(*this);
  started_ = true;
  in_server([this] {
    ticker_.emplace(server_.context());
    tick();
  });
}

void WebBridge::in_server(std::function<void()> work) {
  std::promise<void> done;
  server_.post([&] {
    try {
      work();
      done.set_value();
    } catch (...) {
      done.set_exception(std::current_exception());
    }
  });
  done.get_future().get();
}

std::unique_ptr<WebOutput> WebBridge::begin_run(const RunFacts& facts, WebOutput::Parts parts) {
  const json hello = hello_of(facts, recordings_.path().string());
  // Before anybody knows of the run: what is wished of it from then on waits for its loop.
  clear_event(resume_);
  control_.open();
  in_server([&] {
    facts_ = facts;
    failure_.clear();
    running_ = true;
    figures_.emplace(facts.sensor.camera, facts.sensor.target);
    profile_ = nullptr;
    trial_.reset();
    trying_.reset();
    programs_.clear();
    profiles_.reset();
    camera_.reset();
    controls_ = json::array();
    if (facts.profiles) profiles_.emplace(server_.context(), control_path(facts.name));
    if (!facts.camera_device.empty()) camera_.emplace(facts.camera_device);
    if (!facts.place.sensor.empty()) {
      const std::string folder = certificate_folder(facts.place);
      for (const char* kind : {"html", "pdf", "json"}) {
        const std::string file = std::string("certificate.") + kind;
        server_.serve_file("/files/" + file, std::filesystem::path(folder) / file);
      }
    }
    server_.set_hello(hello);
    // The desk answers once the loop turns.
    if (profiles_) read_profile();
    look_around();
    send_state();
  });
  parts.feed = &server_.feed();
  parts.control = &control_;
  parts.views = &views_;
  parts.news = [this](std::string line, std::vector<std::string> programs) {
    server_.post([this, line = std::move(line), programs = std::move(programs)]() mutable {
      heard(std::move(line), std::move(programs));
    });
  };
  return std::make_unique<WebOutput>(std::move(parts));
}

void WebBridge::end_run() {
  control_.close();
  in_server([this] {
    running_ = false;
    trial_.reset();
    if (recording_) end_recording([](const RunRecording::Ending&) {});
    send_state();
  });
}

bool WebBridge::wait_to_resume(Beside beside) {
  std::vector<pollfd> fds = {{resume_.get(), POLLIN, 0}, {stop_, POLLIN, 0}};
  for (const Output* output : beside) fds.push_back({output->poll_fd(), POLLIN, 0});
  while (true) {
    if (::poll(fds.data(), fds.size(), -1) <= 0) continue;
    if (fds[1].revents != 0) return false;
    for (std::size_t i = 0; i < beside.size(); ++i)
      if (fds[i + 2].revents != 0) beside[i]->service();
    if (fds[0].revents == 0) continue;
    clear_event(resume_);
    return true;
  }
}

bool WebBridge::lend_camera(Beside beside) {
  clear_event(resume_);
  in_server([this] {
    camera_free_ = true;
    control_.camera_given();
    jobs_->camera_free();
  });
  return wait_to_resume(beside);
}

bool WebBridge::wait_after(const std::string& failure, Beside beside) {
  control_.close();
  clear_event(resume_);
  in_server([&] {
    running_ = false;
    camera_free_ = true;
    failure_ = failure;
    control_.camera_given();
    if (jobs_->holds_camera()) jobs_->camera_free();  // it waited for that run
    say(failure);
    send_state();
  });
  return wait_to_resume(beside);
}

void WebBridge::page_came(std::uint64_t page) {
  pages_.insert(page);
  if (!jobs_) return;  // about to end
  server_.send(page, state());
  look_around();
}

void WebBridge::page_gone(std::uint64_t page) {
  pages_.erase(page);
  if (!trial_ || trial_->page != page) return;
  trial_.reset();
  if (profiles_) profiles_->ask("revert", [this](const ControlAnswer&) { read_profile(); });
}

void WebBridge::heard(std::string line, std::vector<std::string> programs) {
  const bool changed = programs != programs_;
  programs_ = std::move(programs);
  if (!line.empty()) say(line);
  if (line.starts_with(kProfileNews)) read_profile();
  if (changed) send_state();
}

void WebBridge::show(const JobPicture& picture) {
  const json header = {{"seq", 0},
                       {"t_ns", 0},
                       {"width", picture.width},
                       {"height", picture.height},
                       {"tags", picture.tags},
                       {"status", "ok"}};
  server_.send_picture(picture_message(header, picture.jpeg));
}

/// What the desk has in force, as pages see it.
void WebBridge::read_profile() {
  if (!profiles_) return;
  profiles_->ask("status", [this](const ControlAnswer& status) {
    constexpr std::string_view kHead = "profile ";
    constexpr std::string_view kOf = " of ";
    const std::size_t of = status.text.find(kOf);
    if (!status.ok || !status.text.starts_with(kHead) || of == std::string::npos) return;
    const std::string name = status.text.substr(kHead.size(), of - kHead.size());
    json names = json::array();
    std::string_view rest = std::string_view(status.text).substr(of + kOf.size());
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      names.push_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    profile_ = {{"name", name}, {"names", names}, {"text", ""}, {"trial", trial_.has_value()}};
    profiles_->ask("show " + name, [this](const ControlAnswer& shown) {
      const std::size_t line_end = shown.text.find('\n');
      if (shown.ok && line_end != std::string::npos && profile_.is_object())
        profile_["text"] = shown.text.substr(line_end + 1);
      send_state();
    });
  });
}

/// A trial lasts as long as who tries goes on asking.
void WebBridge::keep_trial() {
  if (!trial_ || !profiles_) return;
  profiles_->ask("live", [this](const ControlAnswer& live) {
    if (!trial_ || (live.ok && live.text.ends_with(" 1"))) return;
    trial_.reset();
    read_profile();
  });
}

void WebBridge::end_recording(std::function<void(RunRecording::Ending)> then) {
  ending_recording_ = true;
  if (ender_.joinable()) ender_.join();
  ender_ = std::thread([this, then = std::move(then),
                        recording = std::shared_ptr<RunRecording>(std::move(recording_))] {
    const RunRecording::Ending ending = recording->finish();
    server_.post([this, then, ending] {
      ending_recording_ = false;
      if (!ending.line.empty()) {
        log_info(ending.line);
        say(ending.line);
      }
      then(ending);
      send_state();
    });
  });
  send_state();
}

void WebBridge::tick() {
  ticker_->after(kTick, [this] { tick(); });
  const std::uint64_t samples = server_.feed().written();
  fresh_ = samples != std::exchange(seen_, samples);
  ++ticks_;
  if (recording_ && recording_->failed() && !ending_recording_) {
    take_recording([this] {
      if (recording_) end_recording([](const RunRecording::Ending&) {});
    });
  }
  if (ticks_ % kTicksBetweenTrials == 0) keep_trial();
  if (server_.pages() == 0) return;
  if (ticks_ % kTicksBetweenLooks == 0) look_around();
  send_state();
}

void WebBridge::look_around() {
  if (!facts_ || server_.pages() == 0) return;
  readers_ = device_readers("tagwrench-" + facts_->name);
  if (camera_ && running_) controls_ = settings_json(camera_->all());
}

std::string WebBridge::words(const SeenNow& seen, bool fresh) const {
  if (!failure_.empty()) return failure_;
  if (!running_ && jobs_->holds_camera()) return "the camera is lent to what is being done";
  if (!running_) return "the sensor is being set up";
  if (!fresh && seen.status != Status::ok) return "no pictures come";
  if (seen.trouble != Diagnostic::none && !carries_numbers(seen.status))
    return diagnostic_text(seen.trouble, seen.details);
  switch (seen.status) {
    case Status::ok: return "held";
    case Status::saturated: return "held, but pushed beyond the range that is known";
    case Status::acquiring: return "looking for the tags, or learning their rest: hands off";
    case Status::lost: return "the tags are not seen";
    case Status::doubtful:
      return "seen, but what is seen does not fit: nothing is told until it does";
  }
  return {};
}

json WebBridge::state() const {
  const LiveFigures figures = server_.figures();
  const SeenNow seen = views_.seen.get();
  json clients = json::array();
  for (const std::string& program : programs_)
    clients.push_back({{"name", program}, {"by", "spnav"}});
  for (const DeviceReader& reader : readers_)
    clients.push_back({{"name", reader.program}, {"by", reader.by}});
  json board = nullptr;
  if (facts_ && facts_->board && running_) {
    const BoardReading reading = views_.board.get();
    json cells = json::array();
    for (std::size_t i = 0; i < reading.cells.size(); ++i) {
      const BoardReading::Cell& cell = reading.cells[i];
      if (cell.known)
        cells.push_back({{"channel", i}, {"n", cell.newtons}, {"sigma_n", cell.sigma_n}});
    }
    board = {{"led", reading.led}, {"exposure_us", reading.exposure_us}, {"cells", cells}};
  }
  json image = nullptr;
  if (running_ && figures_ && figures_->figures().is_object()) {
    image = figures_->figures();
    image["residual_part"] = seen.residual_fraction;
  }
  json profile = profile_;
  if (profile.is_object()) profile["trial"] = trial_.has_value();
  return {{"type", "state"},
          {"rate_hz", figures.rate_hz},
          {"latency_us", {{"median", figures.latency_median_us}, {"p99", figures.latency_p99_us}}},
          {"jitter_us", figures.jitter_us},
          {"dropped", figures.dropped},
          {"skipped", seen.skipped},
          {"frames", figures.frames},
          {"running", running_},
          {"setting_up", !running_ && failure_.empty()},
          {"status", running_ ? name(seen.status) : name(Status::lost)},
          {"words", words(seen, fresh_)},
          {"image", image},
          {"profile", running_ ? profile : json()},
          {"zero_state", name(seen.zero_state)},
          {"clients", clients},
          {"recording", recording_ ? recording_->progress() : json()},
          {"board", board},
          {"camera_controls", running_ ? controls_ : json::array()},
          {"job", jobs_->to_json()}};
}

}  // namespace tagwrench

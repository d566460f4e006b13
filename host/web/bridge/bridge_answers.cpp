// What the bridge does about each request of a page.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <map>

#include "host/calibration/wrench/plan.h"
#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/motion/profile_config.h"
#include "host/sensor/sensor_config.h"
#include "host/web/bridge/web_bridge.h"

// Not fuzzed: fuzz.yaml_files has profiles, fuzz.web_messages what pages ask.

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxWaiting = 64;  // requests to the desk
constexpr const char* kNoRun = "the sensor does not run at the moment; try again when it does";

std::string text_of(const PageRequest& request, const char* key) {
  const auto found = request.arguments.find(key);
  if (found == request.arguments.end() || !found->is_string())
    throw RequestRefused(fmt::format("{}: is missing, or no text", key));
  return found->get<std::string>();
}

/// One line of plain text; empty where it may be left out and is.
std::string line_of(const PageRequest& request, const char* key, bool needed = true) {
  if (!needed && !request.arguments.contains(key)) return {};
  return checked_line(key, text_of(request, key));
}

double number_of(const PageRequest& request, const char* key, double least, double most) {
  return checked_number(key, request.arguments.value(key, json()), least, most);
}

record::Keep keep_of(const std::string& word) {
  for (const record::Keep keep : {record::Keep::raw, record::Keep::region, record::Keep::none})
    if (word == record::name(keep)) return keep;
  if (word.empty()) return record::Keep::raw;
  throw RequestRefused("keep: must be raw, region or none");
}

namespace fs = std::filesystem;

/// What a profile that has no file is made from.
std::string text_of_ready(const std::string& name) {
  for (const ReadyProfile& ready : ready_profiles())
    if (ready.name == name) return ready.text;
  return "name: " + name + "\n";
}

/// `file_text`, in which a page has kept the person's comments, if it says the same as `text`;
/// otherwise `text`. Throws RequestRefused: a fault in one of them, or another name than `name`.
std::string checked_profile(const std::string& text, const std::string& file_text,
                            const std::string& name, const SensorConfig& sensor) {
  try {
    const Profile defaults = default_profile(sensor);
    const std::string file = name + ".yaml";  // a text without `name:` is called so
    const Profile wanted = parse_profile(text, file, defaults);
    if (wanted.name != name)
      throw ConfigError("{}: its name is {}, and not {}; change `name:`", file, wanted.name, name);
    if (file_text.empty()) return text;
    const Profile same = parse_profile(file_text, file, defaults);
    return profile_text(same) == profile_text(wanted) ? file_text : text;
  } catch (const ConfigError& e) {
    throw RequestRefused(e.what());
  }
}

struct SavedProfile {
  std::filesystem::path file;
  bool is_new = false;  ///< the sensor does not read it by itself
};

/// `file` is where the profile in force was read from, empty if it is a ready-made one or the
/// sensor's own: then it goes to NAME.yaml in the folder `own`, which must not be there yet. Throws
/// RequestRefused: a name that cannot be; ConfigError and std::runtime_error: it cannot be written.
SavedProfile write_profile(const std::string& name, const std::string& text,
                           const std::string& file, const fs::path& own) {
  if (!file.empty()) {
    write_atomically(file, text);
    return {file, false};
  }
  check_recording_name(name);
  std::error_code error;
  fs::create_directories(own, error);
  const fs::path target = own / (name + ".yaml");
  if (error) throw ConfigError("{}: cannot be made: {}", own.string(), error.message());
  if (fs::exists(fs::symlink_status(target, error)))
    throw RequestRefused(fmt::format("name: {} is there already; choose another", target.string()));
  write_atomically(target, text);
  return {target, true};
}

}  // namespace

/// What is thrown is the answer.
void WebBridge::handle(PageRequest request) {
  static const std::map<std::string_view, Answer> answers = {
      {"zero", [](WebBridge& b, const PageRequest& asked) { b.ask_control(asked, "zero"); }},
      {"profile",
       [](WebBridge& b, const PageRequest& asked) {
         b.ask_control(asked, "profile " + line_of(asked, "name"),
                       [&b](const ControlAnswer&) { b.read_profile(); });
       }},
      {"next_profile",
       [](WebBridge& b, const PageRequest& asked) {
         b.ask_control(asked, "next", [&b](const ControlAnswer&) { b.read_profile(); });
       }},
      {"show", &WebBridge::show_profile},
      {"try", &WebBridge::try_profile},
      {"keep", &WebBridge::keep_profile},
      {"revert", &WebBridge::revert_profile},
      {"save_profile", &WebBridge::save_profile},
      {"record_start", &WebBridge::start_recording},
      {"record_stop", &WebBridge::stop_recording},
      {"recordings",
       [](WebBridge& b, const PageRequest& asked) {
         b.answer(asked, true, b.recordings_.path().string(), b.recordings_.list());
       }},
      {"camera_set", &WebBridge::set_camera},
      {"led", &WebBridge::set_led},
      {"tare", &WebBridge::tare},
      {"job_start", &WebBridge::start_job},
      {"job_key",
       [](WebBridge& b, const PageRequest& asked) {
         b.jobs_->press(line_of(asked, "key"));
         b.answer(asked, true, "pressed");
       }},
      {"job_close",
       [](WebBridge& b, const PageRequest& asked) {
         b.jobs_->close();
         b.answer(asked, true, "closed");
       }},
      {"plans", &WebBridge::list_plans},
      {"retry", &WebBridge::retry},
  };
  if (!jobs_) throw RequestRefused("the bridge is about to end; nothing was done");
  const auto found = answers.find(request.what);
  if (found == answers.end())
    throw RequestRefused("ask: this bridge does not know that request; reload the page");
  found->second(*this, request);
}

/// `work` in the run's loop, with null where there is none; then `then` here, with its result.
template <typename Work, typename Then>
void WebBridge::in_loop(Work work, Then then) {
  control_.request([this, work, then](WebOutput* run) {
    server_.post([then, result = work(run)] { then(result); });
  });
}

void WebBridge::answer(const PageRequest& request, bool ok, std::string text, json data) {
  server_.answer(request.page, request.id, ok, std::move(text), std::move(data));
}

ControlLink& WebBridge::profiles() {
  if (!running_) throw RequestRefused(kNoRun);
  if (profiles_ && profiles_->waiting() >= kMaxWaiting)
    throw RequestRefused("too many requests wait for an answer; send fewer");
  if (profiles_) return *profiles_;
  throw RequestRefused(
      "another bridge of this name answers them; stop it, or give this one another --name");
}

void WebBridge::ask_control(const PageRequest& request, std::string text,
                            std::function<void(ControlAnswer)> then) {
  if (text.size() > ControlSocket::kMaxRequest)
    throw RequestRefused(fmt::format("text: is longer than {} bytes", ControlSocket::kMaxRequest));
  profiles().ask(std::move(text), [this, request, then = std::move(then)](ControlAnswer said) {
    answer(request, said.ok, said.text);
    if (then) then(std::move(said));
  });
}

void WebBridge::show_profile(const PageRequest& request) {
  const std::string name = line_of(request, "name", false);
  profiles().ask("show " + name, [this, request, name](const ControlAnswer& shown) {
    const std::size_t line_end = shown.text.find('\n');
    if (!shown.ok || line_end == std::string::npos) return answer(request, false, shown.text);
    const std::string file = shown.text.substr(0, line_end);
    try {
      const std::string written = file.empty() ? text_of_ready(name) : read_text(file);
      answer(request, true, shown.text.substr(line_end + 1),
             {{"file", file}, {"written", written}});
    } catch (const std::exception& e) {
      answer(request, false, e.what());
    }
  });
}

void WebBridge::try_profile(const PageRequest& request) {
  const std::string name = line_of(request, "name");
  const std::string text = text_of(request, "text");
  const std::optional<Trial>& first = trial_ ? trial_ : trying_;
  if (first && first->page != request.page)
    throw RequestRefused("another page tries profile " + first->name + "; keep or revert it there");
  profiles().ask("try " + name + "\n" + text, [this, request, name](const ControlAnswer& said) {
    if (--trying_->unanswered == 0) trying_.reset();
    if (said.ok && !pages_.contains(request.page)) {  // gone before it had its answer
      trial_.reset();
      return profiles_->ask("revert", [this](const ControlAnswer&) { read_profile(); });
    }
    if (said.ok) trial_ = Trial{request.page, name};
    const std::size_t line_end = std::min(said.text.find('\n'), said.text.size());
    answer(request, said.ok,
           said.ok ? said.text.substr(std::min(line_end + 1, said.text.size())) : said.text);
    send_state();
  });
  if (!trying_) trying_ = Trial{request.page, name};
  ++trying_->unanswered;
}

void WebBridge::keep_profile(const PageRequest& request) {
  ask_control(request, "keep", [this](const ControlAnswer& said) {
    if (!said.ok) return;
    trial_.reset();
    profiles_->ask("revert", [this](const ControlAnswer&) { read_profile(); });
  });
}

void WebBridge::revert_profile(const PageRequest& request) {
  ask_control(request, "revert", [this](const ControlAnswer&) {
    trial_.reset();
    read_profile();
  });
}

void WebBridge::save_profile(const PageRequest& request) {
  const std::string of = line_of(request, "name");
  const std::string as = line_of(request, "as", false);
  const std::string file_text =
      request.arguments.contains("file_text") ? text_of(request, "file_text") : "";
  ControlLink& link = profiles();
  const std::string text =
      checked_profile(text_of(request, "text"), file_text, as.empty() ? of : as, facts_->sensor);
  link.ask("show " + of, [this, request, text,
                          name = as.empty() ? of : as](const ControlAnswer& shown) {
    if (!shown.ok) return answer(request, false, shown.text);
    const std::string file = shown.text.substr(0, shown.text.find('\n'));
    try {
      const SavedProfile saved = write_profile(name, text, file, own_profiles_);
      answer(request, true,
             saved.is_new ? fmt::format("saved; from the next start on: tagwrench run --profile {}",
                                        saved.file.string())
                          : fmt::format("saved: {}", saved.file.string()),
             {{"file", saved.file.string()}});
      if (saved.is_new && trial_ && profiles_) {
        profiles_->ask("keep", [](const ControlAnswer&) {});
        profiles_->ask("revert", [](const ControlAnswer&) {});
        trial_.reset();
      }
      read_profile();
    } catch (const std::exception& e) {
      answer(request, false, e.what());
    }
  });
}

void WebBridge::start_recording(const PageRequest& request) {
  const std::string name = line_of(request, "name");
  const record::Keep keep = keep_of(line_of(request, "keep", false));
  if (!running_) throw RequestRefused(kNoRun);
  if (recording_) throw RequestRefused("recording: one runs already; stop it first");
  if (ending_recording_)
    throw RequestRefused("recording: the last one is still being written; wait");
  if (!facts_->head) throw RequestRefused("recording: this run is recorded as a whole already");
  record::Head head = *facts_->head;
  head.keep = keep;
  head.created = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  recording_ = std::make_unique<RunRecording>(recordings_.new_file(name), head);
  in_loop(
      [keep, started = recording_.get()](WebOutput* run) {
        if (run != nullptr) run->record(started, keep == record::Keep::region);
        return run != nullptr;
      },
      [this, request](bool on) {
        if (!on) return answer(request, false, kNoRun);
        answer(request, true, recording_ ? recording_->name() : "ended already");
        send_state();
      });
}

void WebBridge::stop_recording(const PageRequest& request) {
  if (!recording_ || ending_recording_) throw RequestRefused("recording: none runs");
  ending_recording_ = true;
  take_recording([this, request] {
    if (!recording_) return answer(request, true, "ended with its run");
    end_recording([this, request](const RunRecording::Ending& ending) {
      answer(request, ending.whole, ending.line);
    });
  });
}

void WebBridge::take_recording(std::function<void()> then) {
  in_loop(
      [](WebOutput* run) {
        if (run != nullptr) run->record(nullptr, false);
        return run != nullptr;
      },
      [then](bool) { then(); });
}

void WebBridge::set_camera(const PageRequest& request) {
  const auto id = static_cast<std::uint32_t>(number_of(request, "control", 0, 4294967295.0));
  const auto value =
      static_cast<std::int64_t>(number_of(request, "value", -2147483648.0, 2147483647.0));
  if (!running_ || !camera_)
    throw RequestRefused("camera: there is none whose settings could be changed");
  for (const CameraSetting& setting : camera_->all()) {
    if (setting.id != id || !setting.writable) continue;
    const std::int32_t wanted = nearest(setting, value);
    // What the run keeps fixed it must know, or it would put the old value back.
    return in_loop(
        [id, wanted](WebOutput* run) {
          return run != nullptr && run->source().change_setting(id, wanted);
        },
        [this, request, id, wanted](bool kept) {
          const bool done = kept || (camera_ && camera_->set(id, wanted));
          answer(request, done, done ? fmt::format("{}", wanted) : "the camera refuses");
          look_around();
          send_state();
        });
  }
  throw RequestRefused("control: this camera has no such setting, or it cannot be changed now");
}

void WebBridge::set_led(const PageRequest& request) {
  const auto level = request.arguments.find("level");
  const bool settled = level != request.arguments.end() && *level == "auto";
  const double part = settled ? 0 : number_of(request, "level", 0, 1);
  in_loop(
      [settled, part](WebOutput* run) {
        BoardControl* board = run == nullptr ? nullptr : run->board();
        if (board != nullptr && settled) board->set_led_as_settled();
        if (board != nullptr && !settled) board->set_led(part);
        return board != nullptr;
      },
      [this, request](bool done) {
        answer(request, done, done ? "set" : "led: this run has no board; start with --board");
      });
}

void WebBridge::tare(const PageRequest& request) {
  const auto channel = static_cast<std::size_t>(number_of(request, "channel", 0, 3));
  in_loop(
      [channel](WebOutput* run) -> std::pair<bool, const char*> {
        BoardControl* board = run == nullptr ? nullptr : run->board();
        if (board == nullptr) return {false, "tare: this run has no board; start with --board"};
        return board->tare(channel)
                   ? std::pair{true, "is tared while it rests; that holds until this run ends"}
                   : std::pair{false, "tare: that load cell is not calibrated, or has not spoken"};
      },
      [this, request](std::pair<bool, const char*> said) {
        answer(request, said.first, said.second);
      });
}

void WebBridge::start_job(const PageRequest& request) {
  const std::string verb = line_of(request, "verb");
  if (!facts_) throw RequestRefused(kNoRun);
  const auto options = request.arguments.find("options");
  JobCommand command = job_command(
      verb, options == request.arguments.end() ? json::object() : *options, facts_->place);
  if (recording_ && command.needs_camera)
    throw RequestRefused(fmt::format("{}: needs the camera; stop the recording first", verb));
  jobs_->start(std::move(command), camera_free_);
  answer(request, true, "begun");
}

void WebBridge::list_plans(const PageRequest& request) {
  json plans = json::array();
  for (const ReadyPlan& ready : ready_plans()) {
    const WrenchPlan plan = parse_plan(ready.text, ready.name);
    plans.push_back({{"name", ready.name},
                     {"needs", plan.about},
                     {"minutes", plan.minutes},
                     {"steps", plan.steps.size()}});
  }
  answer(request, true, {}, std::move(plans));
}

void WebBridge::retry(const PageRequest& request) {
  if (running_) throw RequestRefused("retry: the sensor runs");
  if (jobs_->holds_camera()) throw RequestRefused("retry: a job has the camera; stop it first");
  if (!camera_free_) throw RequestRefused("retry: the sensor is being set up already");
  give_back_camera();
  answer(request, true, "trying again");
}

}  // namespace tagwrench

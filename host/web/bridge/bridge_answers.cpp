// What the bridge does about each request of a page.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <map>

#include "host/calibration/wrench/plan_config.h"
#include "host/web/bridge/profile_saving.h"
#include "host/web/bridge/web_bridge_impl.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxWaiting = 64;  // requests to the desk
constexpr const char* kNoRun = "the sensor does not run at the moment; try again when it does";

/// One line of plain text; empty where it may be left out and is.
std::string line_of(const PageRequest& request, const char* key, bool needed = true) {
  const auto found = request.arguments.find(key);
  if (found == request.arguments.end() && !needed) return {};
  if (found == request.arguments.end() || !found->is_string())
    throw RequestRefused(fmt::format("{}: is missing, or no text", key));
  const auto& text = found->get_ref<const std::string&>();
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      throw RequestRefused(fmt::format("{}: must be one line of plain text", key));
  }
  return text;
}

double number_of(const PageRequest& request, const char* key, double least, double most) {
  const auto found = request.arguments.find(key);
  const double number =
      found != request.arguments.end() && found->is_number() ? found->get<double>() : std::nan("");
  if (number >= least && number <= most) return number;
  throw RequestRefused(fmt::format("{}: must be a number from {:g} to {:g}", key, least, most));
}

std::string text_of(const PageRequest& request, const char* key) {
  const auto found = request.arguments.find(key);
  if (found == request.arguments.end() || !found->is_string())
    throw RequestRefused(fmt::format("{}: is missing, or no text", key));
  return found->get<std::string>();
}

record::Keep keep_of(const std::string& word) {
  for (const record::Keep keep : {record::Keep::raw, record::Keep::region, record::Keep::none}) {
    if (word == record::name(keep)) return keep;
  }
  if (word.empty()) return record::Keep::raw;
  throw RequestRefused("keep: must be raw, region or none");
}

}  // namespace

WebBridge::Impl::Answer WebBridge::Impl::answer_to(std::string_view what) {
  static const std::map<std::string_view, Answer> answers = {
      {"zero", &Impl::zero},
      {"profile", &Impl::choose_profile},
      {"next_profile", &Impl::next_profile},
      {"show", &Impl::show_profile},
      {"try", &Impl::try_profile},
      {"keep", &Impl::keep_profile},
      {"revert", &Impl::revert_profile},
      {"save_profile", &Impl::save_profile},
      {"record_start", &Impl::start_recording},
      {"record_stop", &Impl::stop_recording},
      {"recordings", &Impl::list_recordings},
      {"camera_set", &Impl::set_camera},
      {"led", &Impl::set_led},
      {"tare", &Impl::tare},
      {"job_start", &Impl::start_job},
      {"job_key", &Impl::press_key},
      {"job_close", &Impl::close_job},
      {"plans", &Impl::list_plans},
      {"retry", &Impl::retry},
  };
  const auto found = answers.find(what);
  return found == answers.end() ? nullptr : found->second;
}

/// What is thrown is the answer.
void WebBridge::Impl::handle(PageRequest request) {
  if (!jobs_) throw RequestRefused("the bridge is about to end; nothing was done");
  const Answer does = answer_to(request.what);
  if (does == nullptr)
    throw RequestRefused("ask: this bridge does not know that request; reload the page");
  (this->*does)(request);
}

void WebBridge::Impl::answer(const PageRequest& request, bool ok, std::string text, json data) {
  server_.answer(request.page, request.id, ok, std::move(text), std::move(data));
}

ControlLink& WebBridge::Impl::profiles() {
  if (!running_) throw RequestRefused(kNoRun);
  if (profiles_ && profiles_->waiting() >= kMaxWaiting)
    throw RequestRefused("too many requests wait for an answer; send fewer");
  if (profiles_) return *profiles_;
  throw RequestRefused(
      "another bridge of this name answers them; stop it, or give this one another --name");
}

void WebBridge::Impl::ask_control(const PageRequest& request, std::string text,
                                  std::function<void(ControlAnswer)> then) {
  if (text.size() > ControlSocket::kMaxRequest)
    throw RequestRefused(fmt::format("text: is longer than {} bytes", ControlSocket::kMaxRequest));
  profiles().ask(std::move(text), [this, request, then = std::move(then)](ControlAnswer said) {
    answer(request, said.ok, said.text);
    if (then) then(std::move(said));
  });
}

void WebBridge::Impl::zero(const PageRequest& request) { ask_control(request, "zero"); }

void WebBridge::Impl::choose_profile(const PageRequest& request) {
  ask_control(request, "profile " + line_of(request, "name"),
              [this](const ControlAnswer&) { read_profile(); });
}

void WebBridge::Impl::next_profile(const PageRequest& request) {
  ask_control(request, "next", [this](const ControlAnswer&) { read_profile(); });
}

void WebBridge::Impl::show_profile(const PageRequest& request) {
  profiles().ask("show " + line_of(request, "name", false),
                 [this, request](const ControlAnswer& shown) {
                   const std::size_t line_end = shown.text.find('\n');
                   if (!shown.ok || line_end == std::string::npos)
                     return answer(request, false, shown.text);
                   answer(request, true, shown.text.substr(line_end + 1),
                          {{"file", shown.text.substr(0, line_end)}});
                 });
}

void WebBridge::Impl::try_profile(const PageRequest& request) {
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

void WebBridge::Impl::keep_profile(const PageRequest& request) {
  ask_control(request, "keep", [this](const ControlAnswer& said) {
    if (!said.ok) return;
    trial_.reset();
    profiles_->ask("revert", [this](const ControlAnswer&) { read_profile(); });
  });
}

void WebBridge::Impl::revert_profile(const PageRequest& request) {
  ask_control(request, "revert", [this](const ControlAnswer&) {
    trial_.reset();
    read_profile();
  });
}

void WebBridge::Impl::save_profile(const PageRequest& request) {
  const std::string of = line_of(request, "name");
  const std::string text = text_of(request, "text");
  const std::string given = line_of(request, "as", false);
  const std::string name = given.empty() ? of + "-mine" : given;
  profiles().ask("show " + of, [this, request, of, text, name](const ControlAnswer& shown) {
    if (!shown.ok) return answer(request, false, shown.text);
    const std::string file = shown.text.substr(0, shown.text.find('\n'));
    try {
      const SavedProfile saved =
          tagwrench::save_profile(of, name, text, file, own_profiles_, facts_->sensor);
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

void WebBridge::Impl::start_recording(const PageRequest& request) {
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
  control_.request([this, request, keep, started = recording_.get()](WebOutput* run) {
    if (run != nullptr) {
      run->source().narrow(keep == record::Keep::region);
      run->record(started);
    }
    server_.post([this, request, on = run != nullptr] {
      if (!on) return answer(request, false, kNoRun);
      answer(request, true, recording_ ? recording_->name() : "ended already");
      send_state();
    });
  });
}

void WebBridge::Impl::stop_recording(const PageRequest& request) {
  if (!recording_ || ending_recording_) throw RequestRefused("recording: none runs");
  ending_recording_ = true;
  control_.request([this, request](WebOutput* run) {
    if (run != nullptr) {
      run->record(nullptr);
      run->source().narrow(false);
    }
    server_.post([this, request] {
      if (!recording_) return answer(request, true, "ended with its run");
      end_recording([this, request](const RunRecording::Ending& ending) {
        answer(request, ending.whole, ending.line);
      });
    });
  });
}

void WebBridge::Impl::list_recordings(const PageRequest& request) {
  answer(request, true, recordings_.path().string(), recordings_.list());
}

void WebBridge::Impl::set_camera(const PageRequest& request) {
  const auto id = static_cast<std::uint32_t>(number_of(request, "control", 0, 4294967295.0));
  const auto value =
      static_cast<std::int64_t>(number_of(request, "value", -2147483648.0, 2147483647.0));
  if (!running_ || !camera_)
    throw RequestRefused("camera: there is none whose settings could be changed");
  for (const CameraSetting& setting : camera_->all()) {
    if (setting.id != id || !setting.writable) continue;
    const std::int32_t wanted = nearest(setting, value);
    // What the run keeps fixed it must know, or it would put the old value back.
    return control_.request([this, request, id, wanted](WebOutput* run) {
      const bool kept = run != nullptr && run->source().change_setting(id, wanted);
      server_.post([this, request, id, wanted, kept] {
        const bool done = kept || (camera_ && camera_->set(id, wanted));
        answer(request, done, done ? fmt::format("{}", wanted) : "the camera refuses");
        look_around();
        send_state();
      });
    });
  }
  throw RequestRefused("control: this camera has no such setting, or it cannot be changed now");
}

void WebBridge::Impl::set_led(const PageRequest& request) {
  const auto level = request.arguments.find("level");
  const bool settled = level != request.arguments.end() && *level == "auto";
  const double part = settled ? 0 : number_of(request, "level", 0, 1);
  control_.request([this, request, settled, part](WebOutput* run) {
    BoardControl* board = run == nullptr ? nullptr : run->board();
    if (board != nullptr) {
      if (settled) {
        board->set_led_as_settled();
      } else {
        board->set_led(part);
      }
    }
    server_.post([this, request, done = board != nullptr] {
      answer(request, done, done ? "set" : "led: this run has no board; start with --board");
    });
  });
}

void WebBridge::Impl::tare(const PageRequest& request) {
  const auto channel = static_cast<std::size_t>(number_of(request, "channel", 0, 3));
  control_.request([this, request, channel](WebOutput* run) {
    BoardControl* board = run == nullptr ? nullptr : run->board();
    const bool there = board != nullptr;
    const bool done = there && board->tare(channel);
    server_.post([this, request, there, done] {
      answer(request, done,
             done    ? "is tared while it rests; that holds until this run ends"
             : there ? "tare: that load cell is not calibrated, or has not spoken"
                     : "tare: this run has no board; start with --board");
    });
  });
}

void WebBridge::Impl::start_job(const PageRequest& request) {
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

void WebBridge::Impl::press_key(const PageRequest& request) {
  jobs_->press(line_of(request, "key"));
  answer(request, true, "pressed");
}

void WebBridge::Impl::close_job(const PageRequest& request) {
  jobs_->close();
  answer(request, true, "closed");
}

void WebBridge::Impl::list_plans(const PageRequest& request) {
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

void WebBridge::Impl::retry(const PageRequest& request) {
  if (running_) throw RequestRefused("retry: the sensor runs");
  if (jobs_->holds_camera()) throw RequestRefused("retry: a job has the camera; stop it first");
  if (!camera_free_) throw RequestRefused("retry: the sensor is being set up already");
  give_back_camera();
  answer(request, true, "trying again");
}

}  // namespace tagwrench

// What the bridge does about each wish of a page.
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

constexpr std::size_t kMostWaiting = 64;  // wishes to the desk
constexpr const char* kNoRun = "the sensor does not run at the moment; try again when it does";

/// One line of plain text; empty where it may be left out and is.
std::string line_of(const Ask& ask, const char* key, bool needed = true) {
  const auto found = ask.arguments.find(key);
  if (found == ask.arguments.end() && !needed) return {};
  if (found == ask.arguments.end() || !found->is_string())
    throw WishRefused(fmt::format("{}: is missing, or no text", key));
  const auto& text = found->get_ref<const std::string&>();
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      throw WishRefused(fmt::format("{}: must be one line of plain text", key));
  }
  return text;
}

double number_of(const Ask& ask, const char* key, double least, double most) {
  const auto found = ask.arguments.find(key);
  const double number =
      found != ask.arguments.end() && found->is_number() ? found->get<double>() : std::nan("");
  if (number >= least && number <= most) return number;
  throw WishRefused(fmt::format("{}: must be a number from {:g} to {:g}", key, least, most));
}

std::string text_of(const Ask& ask, const char* key) {
  const auto found = ask.arguments.find(key);
  if (found == ask.arguments.end() || !found->is_string())
    throw WishRefused(fmt::format("{}: is missing, or no text", key));
  return found->get<std::string>();
}

record::Keep keep_of(const std::string& word) {
  for (const record::Keep keep : {record::Keep::raw, record::Keep::region, record::Keep::none}) {
    if (word == record::name(keep)) return keep;
  }
  if (word.empty()) return record::Keep::raw;
  throw WishRefused("keep: must be raw, region or none");
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
void WebBridge::Impl::ask(Ask ask) {
  if (!jobs_) throw WishRefused("the bridge is about to end; nothing was done");
  const Answer does = answer_to(ask.what);
  if (does == nullptr)
    throw WishRefused("ask: this bridge does not know that wish; reload the page");
  (this->*does)(ask);
}

void WebBridge::Impl::answer(const Ask& ask, bool ok, std::string text, json data) {
  server_.answer(ask.page, ask.id, ok, std::move(text), std::move(data));
}

DeskLink& WebBridge::Impl::desk() {
  if (!running_) throw WishRefused(kNoRun);
  if (desk_ && desk_->waiting() >= kMostWaiting)
    throw WishRefused("too many wishes wait for the desk; send fewer");
  if (desk_) return *desk_;
  throw WishRefused(
      "another bridge of this name has the desk; stop it, or give this one another --name");
}

void WebBridge::Impl::ask_desk(const Ask& ask, std::string wish,
                               std::function<void(DeskAnswer)> then) {
  if (wish.size() > ControlSocket::kLongestWish)
    throw WishRefused(fmt::format("text: is longer than {} bytes", ControlSocket::kLongestWish));
  desk().ask(std::move(wish), [this, ask, then = std::move(then)](DeskAnswer said) {
    answer(ask, said.ok, said.text);
    if (then) then(std::move(said));
  });
}

void WebBridge::Impl::zero(const Ask& ask) { ask_desk(ask, "zero"); }

void WebBridge::Impl::choose_profile(const Ask& ask) {
  ask_desk(ask, "profile " + line_of(ask, "name"), [this](const DeskAnswer&) { read_profile(); });
}

void WebBridge::Impl::next_profile(const Ask& ask) {
  ask_desk(ask, "next", [this](const DeskAnswer&) { read_profile(); });
}

void WebBridge::Impl::show_profile(const Ask& ask) {
  desk().ask("show " + line_of(ask, "name", false), [this, ask](const DeskAnswer& shown) {
    const std::size_t line_end = shown.text.find('\n');
    if (!shown.ok || line_end == std::string::npos) return answer(ask, false, shown.text);
    answer(ask, true, shown.text.substr(line_end + 1), {{"file", shown.text.substr(0, line_end)}});
  });
}

void WebBridge::Impl::try_profile(const Ask& ask) {
  const std::string name = line_of(ask, "name");
  const std::string text = text_of(ask, "text");
  const std::optional<Trial>& first = trial_ ? trial_ : trying_;
  if (first && first->page != ask.page)
    throw WishRefused("another page tries profile " + first->name + "; keep or revert it there");
  desk().ask("try " + name + "\n" + text, [this, ask, name](const DeskAnswer& said) {
    if (--trying_->unanswered == 0) trying_.reset();
    if (said.ok && !pages_.contains(ask.page)) {  // gone before it had its answer
      trial_.reset();
      return desk_->ask("revert", [this](const DeskAnswer&) { read_profile(); });
    }
    if (said.ok) trial_ = Trial{ask.page, name};
    const std::size_t line_end = std::min(said.text.find('\n'), said.text.size());
    answer(ask, said.ok,
           said.ok ? said.text.substr(std::min(line_end + 1, said.text.size())) : said.text);
    send_state();
  });
  if (!trying_) trying_ = Trial{ask.page, name};
  ++trying_->unanswered;
}

void WebBridge::Impl::keep_profile(const Ask& ask) {
  ask_desk(ask, "keep", [this](const DeskAnswer& said) {
    if (!said.ok) return;
    trial_.reset();
    desk_->ask("revert", [this](const DeskAnswer&) { read_profile(); });
  });
}

void WebBridge::Impl::revert_profile(const Ask& ask) {
  ask_desk(ask, "revert", [this](const DeskAnswer&) {
    trial_.reset();
    read_profile();
  });
}

void WebBridge::Impl::save_profile(const Ask& ask) {
  const std::string of = line_of(ask, "name");
  const std::string text = text_of(ask, "text");
  const std::string given = line_of(ask, "as", false);
  const std::string name = given.empty() ? of + "-mine" : given;
  desk().ask("show " + of, [this, ask, of, text, name](const DeskAnswer& shown) {
    if (!shown.ok) return answer(ask, false, shown.text);
    const std::string file = shown.text.substr(0, shown.text.find('\n'));
    try {
      const SavedProfile saved =
          tagwrench::save_profile(of, name, text, file, own_profiles_, facts_->sensor);
      answer(ask, true,
             saved.is_new ? fmt::format("saved; from the next start on: tagwrench run --profile {}",
                                        saved.file.string())
                          : fmt::format("saved: {}", saved.file.string()),
             {{"file", saved.file.string()}});
      if (saved.is_new && trial_ && desk_) {
        desk_->ask("keep", [](const DeskAnswer&) {});
        desk_->ask("revert", [](const DeskAnswer&) {});
        trial_.reset();
      }
      read_profile();
    } catch (const std::exception& e) {
      answer(ask, false, e.what());
    }
  });
}

void WebBridge::Impl::start_recording(const Ask& ask) {
  const std::string name = line_of(ask, "name");
  const record::Keep keep = keep_of(line_of(ask, "keep", false));
  if (!running_) throw WishRefused(kNoRun);
  if (recording_) throw WishRefused("recording: one runs already; stop it first");
  if (ending_recording_) throw WishRefused("recording: the last one is still being written; wait");
  if (!facts_->head) throw WishRefused("recording: this run is recorded as a whole already");
  record::Head head = *facts_->head;
  head.keep = keep;
  head.created = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  recording_ = std::make_unique<RunRecording>(recordings_.new_file(name), head);
  control_.wish([this, ask, keep, started = recording_.get()](WebOutput* run) {
    if (run != nullptr) {
      run->source().narrow(keep == record::Keep::region);
      run->record(started);
    }
    server_.post([this, ask, on = run != nullptr] {
      if (!on) return answer(ask, false, kNoRun);
      answer(ask, true, recording_ ? recording_->name() : "ended already");
      send_state();
    });
  });
}

void WebBridge::Impl::stop_recording(const Ask& ask) {
  if (!recording_ || ending_recording_) throw WishRefused("recording: none runs");
  ending_recording_ = true;
  control_.wish([this, ask](WebOutput* run) {
    if (run != nullptr) {
      run->record(nullptr);
      run->source().narrow(false);
    }
    server_.post([this, ask] {
      if (!recording_) return answer(ask, true, "ended with its run");
      end_recording([this, ask](const RunRecording::Ending& ending) {
        answer(ask, ending.whole, ending.line);
      });
    });
  });
}

void WebBridge::Impl::list_recordings(const Ask& ask) {
  answer(ask, true, recordings_.path().string(), recordings_.list());
}

void WebBridge::Impl::set_camera(const Ask& ask) {
  const auto id = static_cast<std::uint32_t>(number_of(ask, "control", 0, 4294967295.0));
  const auto value =
      static_cast<std::int64_t>(number_of(ask, "value", -2147483648.0, 2147483647.0));
  if (!running_ || !camera_)
    throw WishRefused("camera: there is none whose settings could be changed");
  for (const CameraSetting& setting : camera_->all()) {
    if (setting.id != id || !setting.writable) continue;
    const std::int32_t wanted = nearest(setting, value);
    // What the run keeps fixed it must know, or it would put the old value back.
    return control_.wish([this, ask, id, wanted](WebOutput* run) {
      const bool kept = run != nullptr && run->source().change_setting(id, wanted);
      server_.post([this, ask, id, wanted, kept] {
        const bool done = kept || (camera_ && camera_->set(id, wanted));
        answer(ask, done, done ? fmt::format("{}", wanted) : "the camera refuses");
        look_around();
        send_state();
      });
    });
  }
  throw WishRefused("control: this camera has no such setting, or it cannot be changed now");
}

void WebBridge::Impl::set_led(const Ask& ask) {
  const auto level = ask.arguments.find("level");
  const bool settled = level != ask.arguments.end() && *level == "auto";
  const double part = settled ? 0 : number_of(ask, "level", 0, 1);
  control_.wish([this, ask, settled, part](WebOutput* run) {
    BoardControl* board = run == nullptr ? nullptr : run->board();
    if (board != nullptr) {
      if (settled) {
        board->set_led_as_settled();
      } else {
        board->set_led(part);
      }
    }
    server_.post([this, ask, done = board != nullptr] {
      answer(ask, done, done ? "set" : "led: this run has no board; start with --board");
    });
  });
}

void WebBridge::Impl::tare(const Ask& ask) {
  const auto channel = static_cast<std::size_t>(number_of(ask, "channel", 0, 3));
  control_.wish([this, ask, channel](WebOutput* run) {
    BoardControl* board = run == nullptr ? nullptr : run->board();
    const bool there = board != nullptr;
    const bool done = there && board->tare(channel);
    server_.post([this, ask, there, done] {
      answer(ask, done,
             done    ? "is tared while it rests; that holds until this run ends"
             : there ? "tare: that load cell is not calibrated, or has not spoken"
                     : "tare: this run has no board; start with --board");
    });
  });
}

void WebBridge::Impl::start_job(const Ask& ask) {
  const std::string verb = line_of(ask, "verb");
  if (!facts_) throw WishRefused(kNoRun);
  const auto options = ask.arguments.find("options");
  JobCommand command =
      job_command(verb, options == ask.arguments.end() ? json::object() : *options, facts_->place);
  if (recording_ && command.needs_camera)
    throw WishRefused(fmt::format("{}: needs the camera; stop the recording first", verb));
  jobs_->start(std::move(command), camera_free_);
  answer(ask, true, "begun");
}

void WebBridge::Impl::press_key(const Ask& ask) {
  jobs_->press(line_of(ask, "key"));
  answer(ask, true, "pressed");
}

void WebBridge::Impl::close_job(const Ask& ask) {
  jobs_->close();
  answer(ask, true, "closed");
}

void WebBridge::Impl::list_plans(const Ask& ask) {
  json plans = json::array();
  for (const ReadyPlan& ready : ready_plans()) {
    const WrenchPlan plan = parse_plan(ready.text, ready.name);
    plans.push_back({{"name", ready.name},
                     {"needs", plan.about},
                     {"minutes", plan.minutes},
                     {"steps", plan.steps.size()}});
  }
  answer(ask, true, {}, std::move(plans));
}

void WebBridge::Impl::retry(const Ask& ask) {
  if (running_) throw WishRefused("retry: the sensor runs");
  if (jobs_->holds_camera()) throw WishRefused("retry: a job has the camera; stop it first");
  if (!camera_free_) throw WishRefused("retry: the sensor is being set up already");
  give_back_camera();
  answer(ask, true, "trying again");
}

}  // namespace tagwrench

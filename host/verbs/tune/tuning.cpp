#include "host/verbs/tune/tuning.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "host/config/sensor_edit.h"
#include "host/config_error.h"

namespace tagwrench {
namespace {

constexpr std::size_t kLongestPath = 200;
constexpr std::size_t kMostSteps = 1000;  // that can be undone

bool same(const Profile& a, const Profile& b) {
  return a.shaping == b.shaping && a.gestures == b.gestures;
}

}  // namespace

Tuning::Tuning(TuningSource source)
    : source_(std::move(source)),
      in_force_(source_.saved),
      wanted_(source_.saved),
      text_(source_.text),
      text_in_force_(source_.text),
      knobs_(tuning_knobs(in_force_)) {}

Tuning::Wish Tuning::press(Key key) {
  if (key.kind == Key::Kind::stop) return Wish::leave;
  switch (mode_) {
    case Mode::moving:
      return press_moving(key);
    case Mode::naming:
      return press_naming(key);
    case Mode::leaving:
      return press_leaving(key);
  }
  return Wish::none;
}

Tuning::Wish Tuning::press_moving(Key key) {
  switch (key.kind) {
    case Key::Kind::up:
      chosen_ = (chosen_ + knobs_.size() - 1) % knobs_.size();
      return Wish::none;
    case Key::Kind::down:
      chosen_ = (chosen_ + 1) % knobs_.size();
      return Wish::none;
    case Key::Kind::left:
      return move(-1);
    case Key::Kind::right:
      return move(+1);
    case Key::Kind::character:
      return press_character(key.character);
    default:
      return Wish::none;
  }
}

Tuning::Wish Tuning::press_character(char character) {
  switch (character) {
    case 'k':
      return press_moving({Key::Kind::up});
    case 'j':
      return press_moving({Key::Kind::down});
    case 'h':
      return move(-1);
    case 'l':
      return move(+1);
    case ' ':
      return knobs_[chosen_].kind == Knob::Kind::choice ? move(+1) : Wish::none;
    case 'u':
      return undo();
    case 's':
      return save();
    case 'q':
      if (!unsaved()) return Wish::leave;
      mode_ = Mode::leaving;
      return Wish::none;
    default:
      return Wish::none;
  }
}

Tuning::Wish Tuning::press_leaving(Key key) {
  mode_ = Mode::moving;
  if (key.kind != Key::Kind::character) return Wish::none;
  if (key.character == 'q') return Wish::leave;
  if (key.character != 's') return Wish::none;
  leaves_ = true;
  return save();
}

Tuning::Wish Tuning::press_naming(Key key) {
  switch (key.kind) {
    case Key::Kind::enter:
      mode_ = Mode::moving;
      return name_and_save();
    case Key::Kind::escape:
      mode_ = Mode::moving;
      leaves_ = false;
      note_ = "not saved";
      return Wish::none;
    case Key::Kind::erase:
      if (!typed_.empty()) typed_.pop_back();
      return Wish::none;
    case Key::Kind::character:
      if (typed_.size() < kLongestPath) typed_ += key.character;
      return Wish::none;
    default:
      return Wish::none;
  }
}

Tuning::Wish Tuning::move(int steps) {
  const Knob& knob = knobs_[chosen_];
  if (!knob.applies) {
    note_ = "does not apply as the profile is now";
    return Wish::none;
  }
  const double next = moved(knob, steps);
  if (next == knob.value) return Wish::none;
  Profile wanted = in_force_;
  knob.set(wanted, next);
  return attempt(wanted);
}

/// Steps on one knob, one after the other, are undone together.
Tuning::Wish Tuning::undo() {
  if (done_.empty()) {
    note_ = "nothing to undo";
    return Wish::none;
  }
  undoing_ = true;
  return attempt(done_.back().before);
}

Tuning::Wish Tuning::start_from(const Profile& profile) {
  return same(profile, in_force_) ? Wish::none : attempt(profile);
}

Tuning::Wish Tuning::attempt(const Profile& wanted) {
  note_.clear();
  wanted_ = wanted;
  try {
    text_ = with_changes(source_.text, source_.file, source_.saved, wanted);
    return Wish::attempt;
  } catch (const ConfigError& e) {
    refused(e.what());
    return Wish::none;
  }
}

void Tuning::granted(const Profile& told) {
  const Profile in_force = with_unsaid(told, wanted_);
  if (undoing_) {
    done_.pop_back();
  } else if (!same(in_force, in_force_) && (done_.empty() || done_.back().knob != chosen_)) {
    if (done_.size() >= kMostSteps) done_.erase(done_.begin());
    done_.push_back({in_force_, chosen_});
  }
  undoing_ = false;
  if (!same(in_force, wanted_))
    note_ = "the profile says otherwise for some axes; change those in its text";
  in_force_ = in_force;
  text_in_force_ = text_;
  knobs_ = tuning_knobs(in_force_);
}

void Tuning::refused(std::string why) {
  note_ = std::move(why);
  wanted_ = in_force_;
  text_ = text_in_force_;
  undoing_ = false;
  leaves_ = false;
  if (source_.new_file && !typed_.empty()) {  // another name may do
    source_.file.clear();
    source_.new_file = false;
  }
}

Tuning::Wish Tuning::save() {
  if (source_.file.empty()) {
    typed_ = source_.name + "-mine.yaml";
    mode_ = Mode::naming;
    return Wish::none;
  }
  return name_and_save();
}

/// A new file's profile is named after it, or there would be two of one name.
Tuning::Wish Tuning::name_and_save() {
  std::string file = source_.file;
  if (file.empty()) {
    if (typed_.empty()) {
      refused("not saved: it has no name");
      return Wish::none;
    }
    file = typed_;
    source_.new_file = true;
  }
  text_ = text_in_force_;
  if (source_.new_file) {
    const std::string own_name = std::filesystem::path(file).stem().string();
    if (own_name.find_first_of("\"\\") != std::string::npos) {
      refused(file + ": a name has no \" and no \\ in it; type another");
      return Wish::none;
    }
    try {
      text_ = with_value(text_, {"name"}, "\"" + own_name + "\"", file);
      source_.file = file;
      return Wish::save;
    } catch (const ConfigError& e) {
      refused(e.what());
      return Wish::none;
    }
  }
  return Wish::save;
}

Tuning::Wish Tuning::saved() {
  source_.text = text_;
  source_.saved = in_force_;
  text_in_force_ = text_;
  source_.new_file = false;
  typed_.clear();
  note_ = "saved: " + source_.file;
  return leaves_ ? Wish::leave : Wish::none;
}

std::string Tuning::line() const {
  switch (mode_) {
    case Mode::naming:
      return "save as (Return; Esc: not): " + typed_ + "_";
    case Mode::leaving:
      return "not saved yet: s saves it, q leaves without, any other key stays";
    case Mode::moving:
      break;
  }
  return note_;
}

}  // namespace tagwrench

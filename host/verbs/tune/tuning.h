// A profile being tuned: what keys make of it. No terminal, no socket, no file.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host/config/profile_config.h"
#include "host/verbs/tune/key_reader.h"
#include "host/verbs/tune/knobs.h"

namespace tagwrench {

/// What a profile is made from.
struct TuningSource {
  std::string name;
  std::string file;       ///< to save to; empty: it is asked for
  bool new_file = false;  ///< there is nothing yet, and it gets a name of its own
  std::string text;       ///< as it was saved, a YAML mapping
  Profile saved;          ///< what the sensor makes of that text
};

class Tuning {
 public:
  enum class Mode : unsigned char { moving, naming, leaving };
  enum class Wish : unsigned char {
    none,
    attempt,  ///< text() should come in force; then granted() or refused()
    save,     ///< text() should be written to file(); then saved() or refused()
    leave,
  };

  explicit Tuning(TuningSource source);

  Wish press(Key key);
  /// A profile that is not what was saved, to begin with.
  Wish start_from(const Profile& profile);

  /// The text that was wished for is in force, and this is what it means.
  void granted(const Profile& told);
  void refused(std::string why);
  Wish saved();
  void note(std::string line) { note_ = std::move(line); }

  const std::string& name() const { return source_.name; }
  const std::string& file() const { return source_.file; }
  bool new_file() const { return source_.new_file; }
  const std::string& text() const { return text_; }
  const std::string& saved_text() const { return source_.text; }
  bool unsaved() const { return text_in_force_ != source_.text; }
  Mode mode() const { return mode_; }
  const std::vector<Knob>& knobs() const { return knobs_; }
  std::size_t chosen() const { return chosen_; }
  const Profile& profile() const { return in_force_; }
  /// One line: what happened, or what is asked.
  std::string line() const;

 private:
  Wish press_moving(Key key);
  Wish press_character(char character);
  Wish press_naming(Key key);
  Wish press_leaving(Key key);
  Wish move(int steps);
  Wish undo();
  Wish save();
  Wish name_and_save();
  Wish attempt(const Profile& wanted);

  TuningSource source_;
  Profile in_force_;
  Profile wanted_;
  std::string text_;  ///< of what is wished for
  std::string text_in_force_;
  std::vector<Knob> knobs_;  ///< of what is in force
  std::size_t chosen_ = 0;
  struct Step {
    Profile before;
    std::size_t knob = 0;
  };
  std::vector<Step> done_;
  bool undoing_ = false;
  bool leaves_ = false;  ///< once it is saved
  Mode mode_ = Mode::moving;
  std::string typed_;  ///< the name of a file
  std::string note_;
};

}  // namespace tagwrench

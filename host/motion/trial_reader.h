// Texts of profiles on trial, read beside the frame loop: a page sends one with every move of a
// slider, and to read 16 kB of YAML takes longer than a frame.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/motion/profile_config.h"

namespace tagwrench {

class TrialReader {
 public:
  /// No two texts are read within this time, so that reading cannot take a processor for itself.
  static constexpr Duration kInterval = std::chrono::milliseconds(20);

  struct Text {
    std::string asker;  ///< who tries it
    std::size_t profile = 0;
    std::string name;  ///< of that profile; the text cannot change it
    std::string file;  ///< where it would be saved, for people; empty: nowhere
    std::string text;
    Profile defaults;
  };
  struct Reading {
    std::string asker;
    std::size_t profile = 0;
    std::optional<Profile> read;
    std::string answer;  ///< "ok: FILE" and the profile with all that the text leaves out, or
                         ///< "error: " and the first fault
  };

  /// Starts a thread, to which no signal is ever delivered. Throws ConfigError: no descriptors, no
  /// threads.
  TrialReader();
  ~TrialReader();
  TrialReader(const TrialReader&) = delete;
  TrialReader& operator=(const TrialReader&) = delete;

  /// False: one is being read, or was and has not been taken.
  bool read(Text text);
  /// Readable when there is something to take.
  int fd() const noexcept { return done_.get(); }
  std::optional<Reading> take() noexcept;

 private:
  void run() noexcept;

  UniqueFd done_;  ///< eventfd
  std::mutex mutex_;
  std::condition_variable wake_;
  bool busy_ = false;
  bool ending_ = false;
  std::optional<Text> text_;
  std::optional<Reading> reading_;
  std::thread thread_;
};

}  // namespace tagwrench

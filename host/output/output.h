// Where samples go. Every output gets every sample; none blocks, none queues.
#pragma once

#include <string>
#include <string_view>

#include "host/types.h"

namespace tagwrench {

enum class SendStatus : std::uint8_t {
  ok,
  skipped,  ///< the reader is slow: this sample is lost to it, and the gap in `seq` shows it
  failed,   ///< the output is gone for good; failure() says why and what to do
};

/// Setup (the constructors of implementations) throws ConfigError; the running loop gets statuses.
class Output {
 public:
  Output() = default;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  /// Leaves nothing behind: input devices send neutral before they go away, files end on a whole
  /// line.
  virtual ~Output() = default;

  /// A sample whose status does not carry numbers is a neutral output: zeros.
  virtual SendStatus send(const Sample& sample) noexcept = 0;

  /// One line about the last failed send().
  virtual std::string failure() const { return {}; }

  /// Readable when service() has something to answer (a client's LED report); -1: never.
  virtual int poll_fd() const noexcept { return -1; }
  /// Answers. What a client has changed, in words for people; empty if nothing.
  virtual std::string_view service() noexcept { return {}; }

  /// Whether somebody presses a button that this output knows of.
  virtual bool touched() const noexcept { return false; }

  /// Offers a line meant for people; true if this output has shown it. An empty one takes the last
  /// one away.
  virtual bool notice(std::string_view) noexcept { return false; }
};

}  // namespace tagwrench

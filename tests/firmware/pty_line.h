// The far end of a pseudo terminal that stands for a board's USB serial port: a name that stays
// while the terminal behind it comes and goes, and whether a host has it open.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench::emulator {

class PtyLine {
 public:
  /// `link` becomes a symbolic link to the terminal; empty: none. Plugged in from the start. Throws
  /// ConfigError if the link cannot be had, std::runtime_error without a pseudo terminal.
  explicit PtyLine(std::string link);
  PtyLine(const PtyLine&) = delete;
  PtyLine& operator=(const PtyLine&) = delete;
  ~PtyLine() { unplug(); }

  /// Throws as the constructor does, and stays unplugged.
  void plug();
  void unplug();
  bool plugged() const { return static_cast<bool>(master_); }
  /// Has a host the port open?
  bool open() const;
  /// What the host set; 0 if it cannot be told.
  double baud() const;
  /// Readable when the host sent something; only worth waiting for while open().
  int fd() const { return master_.get(); }
  std::string name() const { return link_.empty() ? terminal_ : link_; }

  /// From now on each bit, either way, is flipped with this probability.
  void set_bit_errors(double probability) { bit_errors_ = probability; }
  /// Sends the host bytes that mean nothing.
  void babble(std::size_t count);

  std::vector<std::uint8_t> read();
  /// Bytes that find no room, or no host, are lost as on a wire.
  void write(std::span<const std::uint8_t> bytes);

 private:
  void disturb(std::vector<std::uint8_t>& bytes);

  std::string link_;
  std::string terminal_;
  UniqueFd master_;
  double bit_errors_ = 0;
  std::mt19937 random_{1};
};

}  // namespace tagwrench::emulator

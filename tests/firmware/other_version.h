// Makes the board's greeting that of a firmware of another protocol version; all else passes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/codec.h"

namespace tagwrench::emulator {

class OtherVersion {
 public:
  explicit OtherVersion(std::optional<std::uint8_t> major) : major_(major) {}

  /// Bytes from the board to bytes for the host.
  std::vector<std::uint8_t> pass(const std::vector<std::uint8_t>& bytes);

 private:
  void forge();

  std::optional<std::uint8_t> major_;  ///< none: everything passes
  link::FrameReader reader_;
  std::vector<std::uint8_t> frame_;  ///< as it came, up to now
};

}  // namespace tagwrench::emulator

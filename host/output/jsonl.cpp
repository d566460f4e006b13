#include "host/output/jsonl.h"

namespace tagwrench {

JsonlOutput::JsonlOutput(const std::string& path, bool lossless) : sink_(path, lossless) {}

SendStatus JsonlOutput::send(const Sample& sample) noexcept {
  const auto now = std::chrono::steady_clock::now();
  return sink_.write(json_line(line_, sample, latency_us(sample, now)));
}

}  // namespace tagwrench

#include "host/output/jsonl.h"

namespace tagwrench {

JsonlOutput::JsonlOutput(const std::string& path, bool lossless) : sink_(path, lossless) {}

SendStatus JsonlOutput::send(const Sample& sample) noexcept {
  return sink_.write(json_line(line_, sample));
}

}  // namespace tagwrench

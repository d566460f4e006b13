#include "host/output/line_outputs.h"

namespace tagwrench {

JsonlOutput::JsonlOutput(const std::string& path, bool lossless) : sink_(path, lossless) {}

SendStatus JsonlOutput::send(const Sample& sample) noexcept {
  return sink_.write(json_line(line_, sample));
}

// A header that does not go out now (the reader has not started) goes out before the first row; one
// that cannot go out at all shows as the failure of the first send().
CsvOutput::CsvOutput(const std::string& path, bool lossless) : sink_(path, lossless) {
  header_written_ = sink_.write(kCsvHeader) == SendStatus::ok;
}

SendStatus CsvOutput::send(const Sample& sample) noexcept {
  if (!header_written_) {
    const SendStatus status = sink_.write(kCsvHeader);
    if (status != SendStatus::ok) return status;
    header_written_ = true;
  }
  return sink_.write(csv_line(line_, sample));
}

}  // namespace tagwrench

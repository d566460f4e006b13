// One JSON object a line for every sample.
#pragma once

#include <string>

#include "host/output/output.h"
#include "host/output/sample_text.h"
#include "host/output/text_sink.h"

namespace tagwrench {

class JsonlOutput : public Output {
 public:
  /// See TextSink: `-` is standard output; throws ConfigError if the path cannot be written.
  JsonlOutput(const std::string& path, bool lossless);

  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return sink_.failure(); }

 private:
  TextSink sink_;
  LineBuffer line_{};
};

// A header line, then one row for every sample.

class CsvOutput : public Output {
 public:
  /// See TextSink: `-` is standard output; throws ConfigError if the path cannot be written.
  CsvOutput(const std::string& path, bool lossless);

  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return sink_.failure(); }

 private:
  TextSink sink_;
  LineBuffer line_{};
  bool header_written_ = false;
};

}  // namespace tagwrench

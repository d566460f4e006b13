// Lines of text: where they go (a file, a pipe, a terminal; whole blocks only, and never a wait
// unless asked for), what they say of a sample, and the outputs jsonl and csv.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/output/output.h"

namespace tagwrench {

/// A block is a line or a screenful. A reader that is too slow loses whole blocks: where a terminal
/// or socket takes only a part, the rest of that one block goes out before anything else does. The
/// program must ignore SIGPIPE.
class TextSink {
 public:
  static constexpr std::size_t kMaxBlock = 8192;

  /// Creates the file afresh; `-` is standard output. Lossless: write() waits for a slow reader,
  /// but returns `skipped` if termination (termination.h) is requested meanwhile. Throws
  /// ConfigError if the path cannot be written.
  TextSink(const std::string& path, bool lossless);

  /// Writes to a duplicate of `fd`; `label` stands for it in messages.
  TextSink(int fd, std::string label, bool lossless);

  TextSink(TextSink&&) = default;
  TextSink& operator=(TextSink&&) = delete;
  /// Completes a block that is half out, within a short time.
  ~TextSink();

  /// skipped: nothing of the block was written. failed: for good, as are all later calls.
  SendStatus write(std::string_view block) noexcept;

  /// One line about why write() failed.
  std::string failure() const;

  int fd() const noexcept { return fd_.get(); }

 private:
  enum class Kind { file, stream, socket };  ///< stream: pipe, terminal or other character device

  void adopt(int fd);
  bool writable(int timeout_ms) noexcept;
  bool wait_writable() noexcept;
  long put(const char* data, std::size_t size) noexcept;
  SendStatus fail(int error) noexcept {
    error_ = error;
    return SendStatus::failed;
  }
  SendStatus flush_rest() noexcept;
  void undo_partial_line(std::size_t written) noexcept;

  UniqueFd fd_;
  std::string label_;
  Kind kind_ = Kind::stream;
  bool lossless_ = false;
  int error_ = 0;
  std::array<char, kMaxBlock> rest_{};  ///< of a block that went out in part
  std::size_t rest_begin_ = 0;
  std::size_t rest_end_ = 0;
};

// One sample as one line, formatted without heap. Numbers are the shortest that read back the same.

/// Room for 24 doubles of at most 24 characters, the integers and the names.
using LineBuffer = std::array<char, 1536>;

/// The JSON keys, flattened; displacement and wrench are named as in the simulator's truth.csv.
inline constexpr std::string_view kCsvHeader =
    "seq,t_ns,status,dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,sigma_dx_m,sigma_dy_m,sigma_dz_m,sigma_rx_"
    "rad,sigma_ry_rad,sigma_rz_rad,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,sigma_fx_n,sigma_fy_n,sigma_fz_"
    "n,sigma_mx_nm,sigma_my_nm,sigma_mz_nm,dropped,latency_us\n";

/// A status without numbers has zeros for them. The view is into `buffer` and ends with a newline.
std::string_view json_line(LineBuffer& buffer, const Sample& sample) noexcept;
std::string_view csv_line(LineBuffer& buffer, const Sample& sample) noexcept;

/// Microseconds from the sample's latency origin to the output call, never negative.
std::int64_t latency_us(const Sample& sample) noexcept;

/// One JSON object a line for every sample. See TextSink about paths; throws as that does.
class JsonlOutput : public Output {
 public:
  JsonlOutput(const std::string& path, bool lossless) : sink_(path, lossless) {}

  SendStatus send(const Sample& sample) noexcept override {
    return sink_.write(json_line(line_, sample));
  }
  std::string failure() const override { return sink_.failure(); }

 private:
  TextSink sink_;
  LineBuffer line_{};
};

/// A header line, then one row for every sample. See TextSink about paths; throws as that does.
class CsvOutput : public Output {
 public:
  CsvOutput(const std::string& path, bool lossless);

  SendStatus send(const Sample& sample) noexcept override;
  std::string failure() const override { return sink_.failure(); }

 private:
  TextSink sink_;
  LineBuffer line_{};
  bool header_written_ = false;
};

}  // namespace tagwrench

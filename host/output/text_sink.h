// Where text goes: a file, a pipe, a terminal. Whole blocks only, and never a wait (unless asked
// for).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "host/core/os/unique_fd.h"
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
  SendStatus fail(int error) noexcept;
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

}  // namespace tagwrench

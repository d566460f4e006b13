// Text in columns, whoever wrote it: rows of fields with their places, for messages.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench::study {

/// Lines that are empty or begin with # are left out. If no field of the first row is a number, the
/// row is the header.
class DelimitedText {
 public:
  /// `separator` 0: whichever of ; tab , splits the first rows evenly; `skip` rows at the top are
  /// left out unread. Throws ConfigError, naming file and line: unreadable, nothing in it, rows of
  /// different lengths.
  explicit DelimitedText(const std::filesystem::path& file, char separator = 0,
                         std::size_t skip = 0);
  DelimitedText(const DelimitedText&) = delete;
  DelimitedText& operator=(const DelimitedText&) = delete;

  std::size_t rows() const noexcept { return lines_.size(); }
  std::size_t columns() const noexcept { return columns_; }
  const std::vector<std::string>& header() const noexcept { return header_; }
  const std::vector<std::string>& comments() const noexcept { return comments_; }
  std::string_view field(std::size_t row, std::size_t column) const noexcept {
    return fields_[row * columns_ + column];
  }
  static constexpr double kMax = 1e12;  ///< squares and sums of it stay finite

  /// FILE:LINE, for messages.
  std::string place(std::size_t row) const;
  const std::string& name() const noexcept { return name_; }

  /// Throws ConfigError unless it is a number of at most `largest`, either way.
  double number(std::size_t row, std::size_t column, double largest = kMax) const;

  /// Columns, counted from 0, of `3`, `3-8`, `time` or `Fx,Fy,Fz`: numbers count from 1, names are
  /// the header's. Throws ConfigError.
  std::vector<std::size_t> find(std::string_view columns) const;

 private:
  std::string name_;
  std::string text_;
  std::size_t columns_ = 0;
  std::vector<std::string> header_;
  std::vector<std::string> comments_;
  std::vector<std::string_view> fields_;
  std::vector<std::size_t> lines_;  ///< of each row, counted from 1
};

/// True, and `value` set, if all of `text` but the space around it is one finite number.
bool parse_number(std::string_view text, double& value) noexcept;

}  // namespace tagwrench::study

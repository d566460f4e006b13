// How a job goes, as pages are told: put together from what the verb says to people and to
// programs.
#pragma once

#include <cstdint>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

/// A picture that a job shows: what is seen in it, as a picture message has it, and a JPEG.
struct JobPicture {
  int width = 0;
  int height = 0;
  nlohmann::json tags = nlohmann::json::array();
  std::vector<std::uint8_t> jpeg;
};

class JobReport {
 public:
  enum class State : std::uint8_t { running, done, failed, stopped };
  static constexpr std::size_t kMaxLines = 200;
  static constexpr std::size_t kMaxLine = 2000;
  static constexpr std::size_t kMaxText = 65'536;

  explicit JobReport(std::string verb, std::vector<std::string> keys);

  void note(std::string text) { add("note", std::move(text)); }
  /// A line of standard error.
  void said(std::string_view line);
  /// Some bytes of standard output.
  void printed(std::string_view text);
  /// A line of the events; a damaged or unknown one is nothing. Returns the picture, if it was one.
  std::optional<JobPicture> event(std::string_view line);
  /// `result`: beside what was printed.
  void ended(State state, std::string why, nlohmann::json result);

  State state() const { return state_; }
  const std::string& verb() const { return verb_; }
  nlohmann::json to_json() const;

 private:
  void add(std::string kind, std::string text);

  struct Line {
    std::string kind;
    std::string text;
  };
  std::string verb_;
  std::vector<std::string> keys_;
  State state_ = State::running;
  std::deque<Line> lines_;
  std::string live_;
  std::string printed_;
  nlohmann::json coverage_ = nullptr;
  nlohmann::json progress_ = nullptr;
  nlohmann::json result_ = nullptr;
};

/// Nothing, if the text is no base64.
std::optional<std::vector<std::uint8_t>> from_base64(std::string_view text);

}  // namespace tagwrench

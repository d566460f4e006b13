// From a page's request for a calibration to the command line of our own program, and what pages
// are told of how it goes. Nothing of a page gets there that was not looked at: names from fixed
// lists, numbers in their range, never a path.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/source/frame_source.h"

namespace tagwrench {

/// One line for the page that wished: what cannot be, and what to do.
class RequestRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Both throw RequestRefused, naming the key.
std::string checked_line(const char* key, std::string text);
double checked_number(const char* key, const nlohmann::json& value, double least, double most);

/// What the bridge works with, which a job gets too.
struct JobPlace {
  std::string sensor;  ///< path of sensor.yaml; empty: the sensor has none
  std::string source;  ///< SRC
  SourceKind source_kind = SourceKind::simulator;
  std::string board;        ///< port; empty: there is none
  std::string cells;        ///< calibration of its load cells; may be empty
  bool calibrated = false;  ///< there is a calibration in newtons
  bool kept = false;        ///< what the run writes to could not go on after a job
};

struct JobCommand {
  std::string verb;  ///< as the page named it
  std::vector<std::string> arguments;
  bool needs_camera = false;
  bool takes_keys = false;
  bool tells_events = false;
};

/// Throws RequestRefused.
JobCommand job_command(std::string_view verb, const nlohmann::json& options, const JobPlace& place);

/// Those that job_command() would not refuse whatever the options.
std::vector<std::string> possible_jobs(const JobPlace& place);

/// Folder of the certificate of this sensor.
std::string certificate_folder(const JobPlace& place);

// How a job goes, as pages are told: of what the verb says to people and to programs.

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

  explicit JobReport(std::string verb, std::vector<std::string> keys)
      : verb_(std::move(verb)), keys_(std::move(keys)) {}

  void note(std::string text) { add("note", std::move(text)); }
  /// A line of standard error.
  void said(std::string_view line);
  /// Some bytes of standard output.
  void printed(std::string_view text) {
    printed_ += text.substr(0, kMaxText - std::min(kMaxText, printed_.size()));
  }
  /// A line of the events; a damaged or unknown one is nothing. Returns the picture, if it was one.
  std::optional<JobPicture> event(std::string_view line);
  /// `result`: beside what was printed.
  void ended(State state, std::string why, nlohmann::json result);

  State state() const { return state_; }
  const std::string& verb() const { return verb_; }
  nlohmann::json to_json() const;

 private:
  void add(std::string kind, std::string text) {
    lines_.push_back({std::move(kind), std::move(text)});
    if (lines_.size() > kMaxLines) lines_.pop_front();
  }

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

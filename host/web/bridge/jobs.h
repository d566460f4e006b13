// The one job at a time: waiting for the camera where it needs it, running, over; and what pages
// are told of it. In the server's thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/web/bridge/job_command.h"
#include "host/web/server/server_timer.h"

namespace boost::asio {
class io_context;
}

namespace tagwrench {

class JobProcess;

// How a job goes, as pages are told: put together from what the verb says to people and to
// programs.

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

class Jobs {
 public:
  struct Hooks {
    /// The run shall end; camera_free() tells when it has.
    std::function<void()> want_camera;
    /// It may begin anew.
    std::function<void()> give_back_camera;
    std::function<void(const nlohmann::json& job)> tell;  ///< often: ten times a second at most
    std::function<void(const JobPicture& picture)> show;
    std::function<void()> changed;  ///< it has begun, or is over
  };

  /// `program`: ours.
  Jobs(boost::asio::io_context& context, std::string program, Hooks hooks);
  ~Jobs();
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  bool running() const { return report_ && report_->state() == JobReport::State::running; }
  /// It has the camera, or waits for it.
  bool holds_camera() const { return running() && command_.needs_camera; }

  /// `camera_is_free`: there is no run that has it. Throws RequestRefused: one runs already.
  void start(JobCommand command, bool camera_is_free);
  void camera_free();
  /// "skip", "redo" or "stop". Throws RequestRefused.
  void press(const std::string& key);
  /// Forgets one that is over. Throws RequestRefused: it runs.
  void close();

  /// Null: there is none.
  nlohmann::json to_json() const { return report_ ? report_->to_json() : nlohmann::json(); }

 private:
  void spawn();
  void ended(int status);
  void finish(JobReport::State state, std::string why, nlohmann::json result = nullptr);
  void log_soon();

  boost::asio::io_context& context_;
  std::string program_;
  Hooks hooks_;
  JobCommand command_;
  std::optional<JobReport> report_;
  std::shared_ptr<JobProcess> process_;
  ServerTimer telling_;
  bool will_tell_ = false;
};

}  // namespace tagwrench

// The one job at a time: waiting for the camera where it needs it, running, over; and what pages
// are told of it. In the server's thread.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "host/web/bridge/job_command.h"
#include "host/web/bridge/job_report.h"
#include "host/web/server/server_timer.h"

namespace boost::asio {
class io_context;
}

namespace tagwrench {

class JobProcess;

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

// The one job at a time: a verb of our own program as a child, with its words, its keys and its
// end; waiting for the camera where it needs it, running, over. All in the server's thread, which
// never waits for it.
#pragma once

#include <sys/types.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/web/bridge/job_command.h"
#include "host/web/server/server_timer.h"

namespace tagwrench {

class JobProcess : public std::enable_shared_from_this<JobProcess> {
 public:
  struct Listener {
    std::function<void(std::string_view bytes)> printed;
    std::function<void(std::string_view line)> said;
    std::function<void(std::string_view line)> event;
    /// The last that is heard of it; `status` as waitpid() has it.
    std::function<void(int status)> ended;
  };
  /// From a request to stop to the end by force.
  static constexpr std::chrono::seconds kPatience{5};
  /// Its own descriptor for events.
  static constexpr int kEventsFd = 3;

  /// The child dies with this process. Throws ConfigError if it cannot be started.
  static std::shared_ptr<JobProcess> start(boost::asio::io_context& context,
                                           const std::string& program, const JobCommand& command,
                                           Listener listener);
  JobProcess(const JobProcess&) = delete;
  JobProcess& operator=(const JobProcess&) = delete;
  /// Kills it if it is still there.
  ~JobProcess();

  void press(char key);
  void stop();
  /// Kills it; nothing more is heard of it.
  void abandon();
  bool stopping() const { return stopping_; }
  pid_t pid() const { return pid_; }

 private:
  using Stream = boost::asio::posix::stream_descriptor;
  /// What a pipe brings, cut into lines where it has them.
  struct Channel {
    explicit Channel(boost::asio::io_context& context) : stream(context) {}
    Stream stream;
    std::vector<char> buffer = std::vector<char>(65'536);
    std::string line;
    std::size_t longest = 0;  ///< line; longer ones are left out
    bool skipping = false;
    std::function<void(std::string_view)> whole;
    bool by_lines = true;
  };

  JobProcess(boost::asio::io_context& context, Listener listener);
  void spawn(const std::string& program, const JobCommand& command);
  void read(Channel& channel);
  void take(Channel& channel, std::size_t count);
  void drain(Channel& channel);
  void wait_for_end();
  void reap();
  void close();

  Listener listener_;
  Channel out_, err_, events_;
  Stream keys_;
  Stream end_;  ///< a pidfd: readable once the child has ended
  boost::asio::steady_timer patience_;
  pid_t pid_ = 0;
  bool stopping_ = false;
};

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
  ~Jobs() {
    if (process_) process_->abandon();
  }
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  bool running() const { return report_ && report_->state() == JobReport::State::running; }
  /// It has the camera, or waits for it.
  bool holds_camera() const { return running() && command_.needs_camera; }

  /// `camera_is_free`: there is no run that has it. Throws RequestRefused: one runs already.
  void start(JobCommand command, bool camera_is_free);
  void camera_free() {
    if (holds_camera()) return spawn();
    hooks_.give_back_camera();  // stopped before it began
  }
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

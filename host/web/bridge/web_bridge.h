// Room web/bridge: what pages see of a run, and what their requests become.
// In:  samples (m, rad, N, N m), pictures, facts of a run; requests of pages.
// Out: messages for web/server; zero, profiles, recordings, camera settings; jobs: commands of the
//      program as child processes.
// Then: bridge_answers.cpp (every request), jobs.h, web_output.h.
//
// The pages' other end: what they see of runs, and what their requests become. It outlives the
// runs: a job that needs the camera ends one, and another is built when the job is over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/recording/schema.h"
#include "host/sensor/sensor_config.h"
#include "host/source/frame_source.h"
#include "host/web/bridge/camera_settings.h"
#include "host/web/bridge/control_link.h"
#include "host/web/bridge/job_command.h"
#include "host/web/bridge/jobs.h"
#include "host/web/bridge/recording_folder.h"
#include "host/web/bridge/web_output.h"
#include "host/web/server/web_server.h"

namespace tagwrench {

/// What pages are told of a run, before its first frame.
struct RunFacts {
  std::string name;  ///< of the sensor
  SourceFormat format;
  SensorConfig sensor;
  JobPlace place;
  std::string camera_device;  ///< node; empty: no camera
  bool board = false;
  bool profiles = false;             ///< its socket listens
  std::optional<record::Head> head;  ///< of a recording; none: something else records already
};

struct WebBridgeOptions {
  WebOptions server;
  std::filesystem::path recordings;
  std::filesystem::path own_profiles;  ///< folder for profiles that pages make
  std::string program = "/proc/self/exe";
};

class WebBridge final : private PageRequestHandler {
 public:
  /// Binds; `stop` becomes readable when a signal has come. Throws ConfigError.
  WebBridge(const WebBridgeOptions& options, int stop);
  ~WebBridge() override;

  // The thread that builds runs.

  void start();
  /// Fit for logs; and to be opened in a browser.
  std::string url() const { return server_.url(); }
  std::string local_url() const { return server_.local_url(); }
  /// `parts`: those of the run; the bridge adds its own.
  std::unique_ptr<WebOutput> begin_run(const RunFacts& facts, WebOutput::Parts parts);
  /// Readable when the run shall end: a signal, or a job wants the camera.
  int end_fd() const noexcept { return control_.end_fd(); }
  /// The loop of the run is over.
  void end_run();
  using Beside = std::span<Output* const>;
  /// Everything of the run is gone, the camera too: until the job that wanted it is over (true) or
  /// a signal has come (false). Outputs that are there all the same are served.
  bool lend_camera(Beside beside);
  /// There is no run, and why: until somebody wants to try again (true) or a signal has come.
  bool wait_after(const std::string& failure, Beside beside);

 private:
  using Answer = std::function<void(WebBridge&, const PageRequest&)>;
  struct Trial {
    std::uint64_t page = 0;
    std::string name;
    int unanswered = 0;  ///< requests that the desk has still to answer
  };

  // The server's thread.
  void handle(PageRequest request) override;
  void page_came(std::uint64_t page) override;
  void page_gone(std::uint64_t page) override;
  void show_profile(const PageRequest& request);
  void try_profile(const PageRequest& request);
  void keep_profile(const PageRequest& request);
  void revert_profile(const PageRequest& request);
  void save_profile(const PageRequest& request);
  void start_recording(const PageRequest& request);
  void stop_recording(const PageRequest& request);
  void set_camera(const PageRequest& request);
  void set_led(const PageRequest& request);
  void tare(const PageRequest& request);
  void start_job(const PageRequest& request);
  void list_plans(const PageRequest& request);
  void retry(const PageRequest& request);

  void answer(const PageRequest& request, bool ok, std::string text, nlohmann::json data = nullptr);
  void ask_control(const PageRequest& request, std::string text,
                   std::function<void(ControlAnswer)> then = {});
  ControlLink& profiles();
  void read_profile();
  void keep_trial();
  template <typename Work, typename Then>
  void in_loop(Work work, Then then);
  /// From the run that writes to it, if there is one.
  void take_recording(std::function<void()> then);
  void end_recording(std::function<void(RunRecording::Ending)> then);
  void heard(std::string line, std::vector<std::string> programs);
  void say(const std::string& line) { server_.send_all({{"type", "say"}, {"line", line}}); }
  void show(const JobPicture& picture);
  void tick();
  void send_state() {
    if (jobs_ && server_.pages() > 0) server_.send_all(state());
  }
  nlohmann::json state() const;
  std::string words(const SeenNow& seen, bool fresh) const;
  void look_around();
  void give_back_camera() {
    camera_free_ = false;
    raise_event(resume_);
  }

  /// Runs it in the server's thread, and waits.
  void in_server(std::function<void()> work);
  bool wait_to_resume(Beside beside);

  std::filesystem::path own_profiles_;
  RecordingFolder recordings_;
  WebServer server_;
  RunControl control_;
  RunViews views_;
  int stop_;
  UniqueFd resume_;
  bool started_ = false;

  // The server's thread alone.
  std::optional<ServerTimer> ticker_;
  std::optional<Jobs> jobs_;
  std::optional<RunFacts> facts_;  ///< of the last run
  bool running_ = false;
  bool camera_free_ = false;  ///< there is no run, and none is being built
  std::string failure_;       ///< why there is no run
  std::optional<ControlLink> profiles_;
  std::optional<CameraSettings> camera_;
  std::optional<PictureFigures> figures_;
  std::set<std::uint64_t> pages_;  ///< that are there
  std::optional<Trial> trial_;     ///< in force
  std::optional<Trial> trying_;    ///< asked of the profiles; other pages wait
  nlohmann::json profile_ = nullptr;
  std::vector<std::string> programs_;  ///< that read the spnav socket
  std::vector<DeviceReader> readers_;
  nlohmann::json controls_ = nlohmann::json::array();
  std::unique_ptr<RunRecording> recording_;
  bool ending_recording_ = false;
  std::thread ender_;  ///< of the last recording
  unsigned ticks_ = 0;
  std::uint64_t seen_ = 0;  ///< samples at the last tick
  bool fresh_ = false;      ///< some have come since then
};

}  // namespace tagwrench

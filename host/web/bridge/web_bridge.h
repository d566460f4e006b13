// Room web/bridge: what pages see of a run, and what their requests become.
// In:  samples (m, rad, N, N m), pictures, facts of a run; requests of pages.
// Out: messages for web/server; zero, profiles, recordings, camera settings; jobs: commands of the
//      program as child processes.
// Then: run_facts.h, bridge_answers.cpp (every request), jobs.h, web_output.h.
//
// The pages' other end: what they see of runs, and what their requests become. It outlives the
// runs: a job that needs the camera ends one, and another is built when the job is over.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "host/output/output.h"
#include "host/web/bridge/run_facts.h"
#include "host/web/bridge/web_output.h"
#include "host/web/server/web_options.h"

namespace tagwrench {

struct WebBridgeOptions {
  WebOptions server;
  std::filesystem::path recordings;
  std::filesystem::path own_profiles;  ///< folder for profiles that pages make
  std::string program = "/proc/self/exe";
};

class WebBridge {
 public:
  /// Binds; `stop` becomes readable when a signal has come. Throws ConfigError.
  WebBridge(const WebBridgeOptions& options, int stop);
  ~WebBridge();
  WebBridge(const WebBridge&) = delete;
  WebBridge& operator=(const WebBridge&) = delete;

  // The thread that builds runs.

  void start();
  /// Fit for logs; and to be opened in a browser.
  std::string url() const;
  std::string url_with_token() const;
  /// `parts`: those of the run; the bridge adds its own.
  std::unique_ptr<WebOutput> begin_run(const RunFacts& facts, WebOutput::Parts parts);
  /// Readable when the run shall end: a signal, or a job wants the camera.
  int end_fd() const noexcept;
  /// The loop of the run is over.
  void end_run();
  using Beside = std::span<Output* const>;
  /// Everything of the run is gone, the camera too: until the job that wanted it is over (true) or
  /// a signal has come (false). Outputs that are there all the same are served.
  bool lend_camera(Beside beside);
  /// There is no run, and why: until somebody wants to try again (true) or a signal has come.
  bool wait_after(const std::string& failure, Beside beside);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tagwrench

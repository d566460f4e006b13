// A run's instrument: every part by name, built in order in one place, from what was asked for and
// the sensor's description.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "host/app/board/run_board.h"
#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/app/pipeline.h"
#include "host/app/recording.h"
#include "host/app/run.h"
#include "host/core/os/unique_fd.h"
#include "host/motion/profile_manager.h"
#include "host/output/watchdog.h"
#include "host/source/frame_source.h"
#include "host/web/bridge/web_bridge.h"
#include "host/wrench/zero.h"

namespace tagwrench {

/// What outlives an instrument that lends its camera to a job.
struct RunSession {
  RunOptions options;
  std::vector<OutputSpec> asked;
  Outputs outputs{asked, !options.record};
  std::unique_ptr<ServiceWatch> watch = ServiceWatch::open();  ///< null: no systemd
  std::unique_ptr<WebBridge> pages{};                          ///< null: there are none
  std::uint64_t frames = 0;                                    ///< of the runs before
  TimePoint start = std::chrono::steady_clock::now();
};

/// Pages are told when a run is over, however it ends.
class PagesOfRun {
 public:
  PagesOfRun(WebBridge& pages, const RunFacts& facts, const WebOutput::Parts& parts)
      : pages_(pages), output_(pages.begin_run(facts, parts)) {}
  PagesOfRun(const PagesOfRun&) = delete;
  PagesOfRun& operator=(const PagesOfRun&) = delete;
  ~PagesOfRun() { pages_.end_run(); }
  WebOutput& output() const { return *output_; }

 private:
  WebBridge& pages_;
  std::unique_ptr<WebOutput> output_;
};

class Instrument {
 public:
  /// Null: a signal came while it waited. Throws ConfigError.
  static std::unique_ptr<Instrument> build(RunSession& session);
  Instrument(const Instrument&) = delete;
  Instrument& operator=(const Instrument&) = delete;
  ~Instrument();

  Pipeline& pipeline() { return *pipeline_; }
  const RunLimits& limits() const { return limits_; }

  // Once the loop is over.
  /// Brings to their end, at once, those outputs that do not outlive a job.
  void lend(const RunReport& report);
  /// Brings all outputs to their end, and says what there is to say. The exit status.
  int end(const RunReport& report);

 private:
  /// What is found, lit and checked before anything is built on it.
  struct Found {
    std::unique_ptr<RunBoard> board;
    Input input;
    UniqueFd stop;
    std::optional<record::Head> head;  ///< of what is kept of the run
    RegionSource* region = nullptr;    ///< the source, where its part that is read is chosen
  };
  Instrument(RunSession& session, Found found, std::optional<ControlSocket> control);

  void open_outputs();
  void announce() const;
  std::vector<Output*> fed();
  void end_loop(const RunReport& report);

  // In the order in which they are built.
  RunSession& session_;
  std::unique_ptr<RunBoard> board_;  ///< null: there is none
  Input input_;
  UniqueFd stop_;
  Tracker tracker_;
  WrenchEstimator wrench_;
  bool has_control_;
  ProfileManager profiles_;
  ZeroOptions zero_limits_;
  ZeroTracking zero_;
  RunLimits limits_;
  std::unique_ptr<Output> board_output_;
  std::optional<PagesOfRun> pages_;
  std::optional<Recording> recording_;
  std::optional<Watchdog> watchdog_;
  std::optional<Pipeline> pipeline_;
};

}  // namespace tagwrench

// The verbs. Exit status: 0 done, 1 failed while running, 2 wrong usage or a configuration that
// cannot be used.
#include <fcntl.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <opencv2/core/utility.hpp>

#include "host/bandwidth/command.h"
#include "host/board/command.h"
#include "host/config/scenario_config.h"
#include "host/config_error.h"
#include "host/source/simulator/folder_export.h"
#include "host/tell.h"
#include "host/verbs/analyze_command.h"
#include "host/verbs/calibrate_command.h"
#include "host/verbs/certificate_command.h"
#include "host/verbs/check_command.h"
#include "host/verbs/control_command.h"
#include "host/verbs/design_command.h"
#include "host/verbs/doctor_command.h"
#include "host/verbs/export_command.h"
#include "host/verbs/gadget_command.h"
#include "host/verbs/manual_command.h"
#include "host/verbs/read_command.h"
#include "host/verbs/record_command.h"
#include "host/verbs/run_command.h"
#include "host/verbs/spnav_command.h"
#include "host/verbs/tags_command.h"
#include "host/verbs/tune_command.h"
#include "host/verbs/zero_command.h"

namespace {

constexpr int kFailed = 1;
constexpr int kUnusable = 2;
constexpr int kMostFrames = 2'000'000'000;

constexpr const char* kSources =
    "where frames come from:\n"
    "  sim | sim:SCENARIO.yaml       the simulated sensor\n"
    "  v4l2:/dev/videoN[,WxH[@FPS][,FOURCC]]\n"
    "  images:DIR                    PNG, PGM or JPEG in name order, times from DIR/frames.csv\n"
    "  recording:FILE                what `tagwrench record` made\n"
    "Without it: a camera that sees the tags, else sim";
constexpr const char* kOutputs =
    "where samples go (repeat it for more than one):\n"
    "  terminal                      live view\n"
    "  jsonl:FILE, csv:FILE          one line per frame, - is standard output\n"
    "  spacemouse                    virtual 6-DOF puck for CAD programs\n"
    "  wrench                        HID force-torque sensor in N and N m\n"
    "  joystick                      six-axis joystick for games\n"
    "  spnav[:PATH]                  the socket of libspnav programs, without any device\n"
    "  web[:ADDRESS:PORT]            pages for a browser: 127.0.0.1:8137\n"
    "  gadget[:spacemouse|:wrench]   a USB device of another computer, after `tagwrench gadget "
    "up`\n"
    "  reference:FILE                as csv, beside the load cells of --board at the same time\n"
    "Without it: terminal, and every device that this machine allows";

/// What is wrong, and whose help tells more: that of the verb which was reached.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* reached = &app;
  std::string words = "tagwrench";
  while (!reached->get_subcommands().empty()) {
    reached = reached->get_subcommands().front();
    words += " " + reached->get_name();
  }
  std::string verbs;
  for (const CLI::App* verb :
       reached->get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); }))
    verbs += (verbs.empty() ? "" : ", ") + verb->get_name();
  const std::vector<std::string> rest = reached->remaining();
  if (verbs.empty() || (!rest.empty() && rest[0][0] == '-'))
    return fmt::format("{}; `{} --help` lists what there is", error.what(), words);
  if (rest.empty())
    return fmt::format("`{0}` needs a subcommand: {1}; see `{0} --help`", words, verbs);
  return fmt::format("`{0}` has no subcommand '{1}' but {2}; see `{0} --help`", words, rest[0],
                     verbs);
}

int dispatch(int argc, char** argv) {
  CLI::App app{
      "tagwrench: a camera under a spring platform as a 6-axis force-torque sensor and 6-DOF input "
      "device"};
  app.require_subcommand(1);
  const CLI::Validator duration(
      [](std::string& text) {
        double seconds = 0;
        const bool usable =
            CLI::detail::lexical_cast(text, seconds) && seconds >= 1e-3 && seconds <= 1e9;
        return usable ? std::string()
                      : "'" + text + "' is not a number of seconds from 0.001 to 1e9";
      },
      "SECONDS");
  app.set_version_flag("--version", TAGWRENCH_VERSION);

  tagwrench::RunOptions run_options;
  CLI::App* run = app.add_subcommand("run", "track the tags, compute the wrench, feed the outputs");
  run->add_option("--sensor", run_options.sensor,
                  "sensor.yaml of this sensor; without it, for a camera, the one "
                  "in\n~/.config/tagwrench if it is there");
  run->add_option("--source", run_options.source, kSources);
  run->add_option("--output", run_options.outputs, kOutputs);
  run->add_option("--profile", run_options.profiles,
                  "how pushes become motion: cad, game, research, a file, or a folder of them;\n"
                  "several: the first is in force until a program's window, a gesture or\n"
                  "`tagwrench control` chooses another");
  run->add_option("--name", run_options.name,
                  "of the sensor, where there are two: the serial number of its devices")
      ->capture_default_str();
  run->add_option("--frames", run_options.frames, "end after N frames")
      ->check(CLI::Range(1, kMostFrames));
  run->add_option("--seconds", run_options.seconds, "end after S seconds")->check(duration);
  run->add_flag("--fast", run_options.fast,
                "sources that are not live run as fast as they can, no frame dropped");
  run->add_flag("--wait", run_options.wait,
                "for the camera, if it is not there: what a service wants");
  run->add_flag("--no-zero-tracking", run_options.no_zero_tracking,
                "the zero does not follow what reads while nobody touches the sensor");
  run->add_option("--board", run_options.board,
                  "serial port of the board that lights the tags and reads load cells:\n"
                  "a path, usb:VENDOR:PRODUCT[:SERIAL], or auto for the only one");
  run->add_flag(
      "--open", run_options.web.open,
      "pages as with --output web, but beside the usual outputs, and open in the browser");
  run->add_option("--web-token", run_options.web.token_file,
                  "file with the token that pages need on an address that others reach;\n"
                  "made where it is not there");
  run->add_option("--recordings", run_options.web.recordings,
                  "folder of what pages record; without it ~/.local/share/tagwrench/recordings");
  run->add_option("--web-pages", run_options.web.pages)->group("");
  run->add_option("--cells", run_options.cells,
                  "calibration file of its load cells; without it the one kept for this board");

  std::string scenario;
  std::string folder;
  int frames = 0;
  CLI::App* sim = app.add_subcommand(
      "sim", "render the simulated sensor to a folder: frames, truth, sensor.yaml");
  sim->add_option("--scenario", scenario, "scenario YAML; without it the default scenario");
  sim->add_option("--out", folder, "folder to write")->required();
  sim->add_option("--frames", frames, "number of frames")
      ->required()
      ->check(CLI::Range(1, 10'000'000));

  tagwrench::RecordCommand record(app, kSources, kOutputs, duration);
  tagwrench::ExportCommand exporting(app);
  tagwrench::ReadCommand read(app, duration);
  tagwrench::CalibrateCommand calibrate(app);
  tagwrench::TagsCommand tags(app);
  tagwrench::BoardCommand board(app);

  tagwrench::AnalyzeCommand analyze(app);
  tagwrench::BandwidthCommand bandwidth(app);
  tagwrench::CheckCommand check(app);
  tagwrench::ZeroCommand zero(app);
  tagwrench::CertificateCommand certificate(app);
  tagwrench::DesignCommand design(app);

  tagwrench::ControlCommand control(app);
  tagwrench::TuneCommand tune(app);
  tagwrench::SpnavCommand spnav(app);
  tagwrench::GadgetCommand gadget(app);
  tagwrench::DoctorCommand doctor(app, duration);
  tagwrench::ManualCommand manual(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    tagwrench::tell(usage_error(app, e));
    return kUnusable;
  }
  if (run->parsed()) return tagwrench::run(run_options);
  if (record.parsed()) return record.run();
  if (exporting.parsed()) return exporting.run();
  if (read.parsed()) return read.run();
  if (calibrate.parsed()) return calibrate.run();
  if (tags.parsed()) return tags.run();
  if (board.parsed()) return board.run();
  if (analyze.parsed()) return analyze.run();
  if (bandwidth.parsed()) return bandwidth.run();
  if (check.parsed()) return check.run();
  if (zero.parsed()) return zero.run();
  if (certificate.parsed()) return certificate.run();
  if (design.parsed()) return design.run();
  if (control.parsed()) return control.run();
  if (tune.parsed()) return tune.run();
  if (spnav.parsed()) return spnav.run();
  if (gadget.parsed()) return gadget.run();
  if (doctor.parsed()) return doctor.run();
  if (manual.parsed()) return manual.run();
  if (sim->parsed()) {
    const tagwrench::sim::Scenario described =
        scenario.empty() ? tagwrench::sim::Scenario{} : tagwrench::load_scenario(scenario);
    tagwrench::sim::export_folder(described, folder, frames);
    tagwrench::tell(fmt::format("{} frames with truth and sensor.yaml in {}", frames, folder));
  }
  return 0;
}

/// A closed standard stream would give its number to the next file that is opened, a device's say.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; ++fd) {
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) != fd) std::abort();
  }
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes becomes an error code
  cv::setNumThreads(1);           // one thread, one poll loop
  try {
    return dispatch(argc, argv);
  } catch (const tagwrench::ConfigError& e) {
    tagwrench::tell(e.what());
    return kUnusable;
  } catch (const std::exception& e) {
    tagwrench::tell(std::string("failed: ") + e.what());
    return kFailed;
  }
}

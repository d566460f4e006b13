#include "host/commands/calibrate_command.h"

#include "host/app/sources.h"
#include "host/commands/events_option.h"

namespace tagwrench {
namespace {

constexpr int kMaxFrames = 2'000'000'000;

command_line::Check duration() {
  return command_line::number(1, 1e6, "a number of seconds from 1 to 1e6", "SECONDS");
}

}  // namespace

CalibrateCommand::CalibrateCommand(command_line::Command program)
    : verb_(program.add_subcommand("calibrate",
                                   "measure this sensor and write it to its sensor.yaml")),
      camera_(verb_.add_subcommand(
          "camera", "the lens, from a printed board shown to the camera (tagwrench tags --board)")),
      target_(verb_.add_subcommand("target",
                                   "where the tags sit, from the platform at rest and then "
                                   "moved about")),
      wrench_(verb_.add_subcommand("wrench", "newtons, from known loads; step by step")) {
  verb_.require_subcommand();
  command_line::Option source =
      camera_.add_option("--source", camera_options_.source,
                         "the camera: v4l2:/dev/videoN[,WxH[@FPS][,FOURCC]]; or "
                         "images:DIR");
  command_line::Option images =
      camera_.add_option("--images", camera_options_.folders, "folders of pictures of the board");
  source.excludes(images);
  camera_
      .add_option("--board", camera_options_.board,
                  "charuco:COLUMNSxROWS:SQUAREmm:MARKERmm:DICTIONARY or "
                  "checkerboard:COLUMNSxROWS:SQUAREmm, counted in squares")
      .required();
  camera_.add_option("--sensor", camera_options_.sensor, "sensor.yaml whose camera this is");
  camera_.add_option("--out", camera_options_.out,
                     "a new sensor.yaml to make; what is found goes into measured/ beside it, "
                     "without --out beside --sensor");
  camera_
      .add_option("--views", camera_options_.views,
                  "views of the board to use: as many at least from a camera, at most from folders")
      .check(command_line::range(kMinCameraViews, kMaxCameraViews));
  camera_
      .add_option("--seconds", camera_options_.seconds,
                  "look at a camera no longer than this, then use what there is")
      .check(duration());
  target_.add_option("--sensor", target_options_.sensor, "sensor.yaml of this sensor").required();
  target_
      .add_option("--source", target_options_.source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  target_.add_option(
      "--out", target_options_.out,
      "a new sensor.yaml to make, in another folder; what is found goes into measured/ "
      "beside it, without --out beside --sensor");
  target_.add_option("--frames", target_options_.frames, "use no more than N frames")
      .check(command_line::range(1, kMaxFrames));
  target_
      .add_option("--seconds", target_options_.seconds,
                  "use no more than S seconds; without it a folder is used up and anything else "
                  "for 30 s")
      .check(duration());
  add_events_option(camera_, camera_options_.events);
  add_events_option(target_, target_options_.events);
  declare_wrench();
}

void CalibrateCommand::declare_wrench() {
  CalibrateWrenchOptions& o = wrench_options_;
  command_line::Option list =
      wrench_.add_flag("--list-plans", o.list_plans, "name the ready-made plans");
  command_line::Option show = wrench_.add_option("--show-plan", o.show_plan,
                                                 "print a plan, to be changed and given as a file");
  wrench_.add_option("--sensor", o.sensor, "sensor.yaml of this sensor");
  wrench_.add_option("--source", o.source,
                     "sim | sim:SCENARIO.yaml, which loads itself, or "
                     "v4l2:/dev/videoN[,WxH[@FPS][,FOURCC]]; or recording:FILE of --record, whose "
                     "loads are fitted once more");
  wrench_.add_option("--plan", o.plan,
                     "a ready-made plan (--list-plans) or a plan file; of a recording, without it "
                     "its own");
  wrench_.add_option("--out", o.out,
                     "file to write; without it measured/wrench.json beside --sensor");
  wrench_.add_option("--notes", o.notes, "temperature, place, who: goes into the record");
  command_line::Option board = wrench_.add_option(
      "--board", o.board, "serial port of the board with the load cell, or auto");
  wrench_.add_option("--cells", o.cells,
                     "its load cells' calibration; without it the one kept for this board");
  wrench_
      .add_option("--emulated-cell", o.emulated_cell,
                  "with --source sim and an emulated board: the pipe that the board reads its "
                  "orders from, so that its cell feels the simulated hand; in real time")
      .needs(board);
  wrench_.add_option("--optoforce", o.optoforce, "serial port of an OptoForce sensor");
  wrench_
      .add_option("--counts-per-unit", o.counts_per_unit,
                  "of that, from its data sheet: per N of Fx Fy Fz, per N m of Tx Ty Tz")
      .delimiter(',')
      .expected(6)
      .check(command_line::positive_number());
  command_line::Option record = wrench_.add_option(
      "--record", record_.file,
      "keep frames, readings and accepted steps in a new file, for --source recording:FILE");
  wrench_
      .add_option("--keep", keep_,
                  "what of each frame is recorded:\n"
                  "  raw       as it came from the source (MJPG stays MJPG)\n"
                  "  region    grey pixels of the part around the tags")
      .check(command_line::one_of({"raw", "region"}))
      .capture_default_str()
      .needs(record);
  wrench_.add_flag("--resume", o.resume, "go on with a calibration that was stopped");
  wrench_.add_flag("--force", o.force, "begin anew, whatever is there");
  wrench_.add_flag("--require-all", o.require_all,
                   "refuse unless all six axes are measured, in place of completing them from the "
                   "spring model");
  wrench_.add_option("--seconds", o.seconds, "stop after S seconds of frames; --resume goes on")
      .check(duration());
  add_events_option(wrench_, o.events);
  wrench_.callback([this, list, show] {
    if (list.count() > 0 || show.count() > 0) return;
    const bool recorded = wrench_options_.source.rfind("recording:", 0) == 0;
    for (const char* needed : {"--sensor", "--source", "--plan"}) {
      const bool optional = recorded && std::string_view(needed) == "--plan";
      if (wrench_.count(needed) == 0 && !optional) command_line::missing(needed);
    }
    if (record_.file.empty()) return;
    record_.keep = keep_ == "raw" ? record::Keep::raw : record::Keep::region;
    wrench_options_.record = record_;
  });
}

int CalibrateCommand::run() const {
  if (wrench_.parsed()) return calibrate_wrench(wrench_options_);
  return target_.parsed() ? calibrate_target(target_options_) : calibrate_camera(camera_options_);
}

}  // namespace tagwrench

// `tagwrench run` and `tagwrench record`, which is a run that is kept in a file: see
// host/app/run.h.
#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/app/run.h"
#include "host/commands/commands.h"

namespace tagwrench {
namespace {

void add_input_and_output(command_line::Command verb, RunOptions& o) {
  verb.add_option("--sensor", o.sensor,
                  "sensor.yaml of this sensor; without it, for a camera, the one "
                  "in\n~/.config/tagwrench if it is there");
  verb.add_option("--source", o.source, source_help());
  verb.add_option("--output", o.outputs, output_help());
}

void add_course(command_line::Command verb, RunOptions& o) {
  verb.add_option("--frames", o.frames, "end after N frames")
      .check(command_line::range(1, 2'000'000'000));
  verb.add_option("--seconds", o.seconds, "end after S seconds").check(command_line::seconds());
  verb.add_flag("--fast", o.fast,
                "sources that are not live run as fast as they can, no frame dropped");
  verb.add_flag("--no-zero-tracking", o.no_zero_tracking,
                "the zero does not follow what reads while nobody touches the sensor");
  verb.add_option("--board", o.board,
                  "serial port of the board that lights the tags and reads load cells:\n"
                  "a path, usb:VENDOR:PRODUCT[:SERIAL], or auto for the only one");
  verb.add_option("--cells", o.cells,
                  "calibration file of its load cells; without it the one kept for this board");
}

}  // namespace

void run_command(command_line::Command program) {
  const auto o = std::make_shared<RunOptions>();
  auto verb = program.add_subcommand("run", "track the tags, compute the wrench, feed the outputs");
  add_input_and_output(verb, *o);
  verb.add_option("--profile", o->profiles,
                  "how pushes become motion: cad, game, research, a file, or a folder of them;\n"
                  "several: the first is in force until a program's window, a gesture or\n"
                  "`tagwrench control` chooses another");
  verb.add_option("--name", o->name,
                  "of the sensor, where there are two: the serial number of its devices")
      .capture_default_str();
  add_course(verb, *o);
  verb.add_flag("--wait", o->wait, "for the camera, if it is not there: what a service wants");
  verb.add_flag(
      "--open", o->web.open,
      "pages as with --output web, but beside the usual outputs, and open in the browser");
  verb.add_option("--web-token", o->web.token_file,
                  "file with the token that pages need on an address that others reach;\n"
                  "made where it is not there");
  verb.add_option("--recordings", o->web.recordings,
                  "folder of what pages record; without it ~/.local/share/tagwrench/recordings");
  verb.add_option("--web-pages", o->web.pages).hidden();
  verb.runs([o] { return run(*o); });
}

void record_command(command_line::Command program) {
  struct Options : RunOptions {
    RecordOptions kept;
    std::string keep = "raw";
  };
  const auto o = std::make_shared<Options>();
  auto verb = program.add_subcommand(
      "record", "as run, and keep all of it in a file: frames, tracks, samples, references");
  verb.add_option("--out", o->kept.file, "the recording, a new file").required();
  verb.add_option("--keep", o->keep,
                  "what of each frame is kept:\n"
                  "  raw       as it came from the source (MJPG stays MJPG)\n"
                  "  region    grey pixels of the part around the tags\n"
                  "  none      nothing; such a recording cannot be replayed")
      .check(command_line::one_of({"raw", "region", "none"}))
      .capture_default_str();
  add_input_and_output(verb, *o);
  add_course(verb, *o);
  verb.runs([o] {
    o->kept.keep = o->keep == "raw"      ? record::Keep::raw
                   : o->keep == "region" ? record::Keep::region
                                         : record::Keep::none;
    o->record = o->kept;
    return run(*o);
  });
}

}  // namespace tagwrench

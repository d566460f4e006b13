#include "host/commands/run_command.h"

#include "host/app/sources.h"

namespace tagwrench {

RunCommand::RunCommand(command_line::Command program)
    : verb_(program.add_subcommand("run", "track the tags, compute the wrench, feed the outputs")) {
  verb_.add_option("--sensor", options_.sensor,
                   "sensor.yaml of this sensor; without it, for a camera, the one "
                   "in\n~/.config/tagwrench if it is there");
  verb_.add_option("--source", options_.source, source_help());
  verb_.add_option("--output", options_.outputs, output_help());
  verb_.add_option("--profile", options_.profiles,
                   "how pushes become motion: cad, game, research, a file, or a folder of them;\n"
                   "several: the first is in force until a program's window, a gesture or\n"
                   "`tagwrench control` chooses another");
  verb_
      .add_option("--name", options_.name,
                  "of the sensor, where there are two: the serial number of its devices")
      .capture_default_str();
  verb_.add_option("--frames", options_.frames, "end after N frames")
      .check(command_line::range(1, kMaxRunFrames));
  verb_.add_option("--seconds", options_.seconds, "end after S seconds")
      .check(command_line::seconds());
  verb_.add_flag("--fast", options_.fast,
                 "sources that are not live run as fast as they can, no frame dropped");
  verb_.add_flag("--wait", options_.wait,
                 "for the camera, if it is not there: what a service wants");
  verb_.add_flag("--no-zero-tracking", options_.no_zero_tracking,
                 "the zero does not follow what reads while nobody touches the sensor");
  verb_.add_option("--board", options_.board,
                   "serial port of the board that lights the tags and reads load cells:\n"
                   "a path, usb:VENDOR:PRODUCT[:SERIAL], or auto for the only one");
  verb_.add_flag(
      "--open", options_.web.open,
      "pages as with --output web, but beside the usual outputs, and open in the browser");
  verb_.add_option("--web-token", options_.web.token_file,
                   "file with the token that pages need on an address that others reach;\n"
                   "made where it is not there");
  verb_.add_option("--recordings", options_.web.recordings,
                   "folder of what pages record; without it ~/.local/share/tagwrench/recordings");
  verb_.add_option("--web-pages", options_.web.pages).hidden();
  verb_.add_option("--cells", options_.cells,
                   "calibration file of its load cells; without it the one kept for this board");
}

}  // namespace tagwrench

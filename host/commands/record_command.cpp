#include "host/commands/record_command.h"

#include "host/app/outputs.h"
#include "host/app/sources.h"

namespace tagwrench {

RecordCommand::RecordCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "record", "as run, and keep all of it in a file: frames, tracks, samples, references")) {
  verb_.add_option("--out", record_.file, "the recording, a new file").required();
  verb_
      .add_option("--keep", keep_,
                  "what of each frame is kept:\n"
                  "  raw       as it came from the source (MJPG stays MJPG)\n"
                  "  region    grey pixels of the part around the tags\n"
                  "  none      nothing; such a recording cannot be replayed")
      .check(command_line::one_of({"raw", "region", "none"}))
      .capture_default_str();
  verb_.add_option("--sensor", options_.sensor, "sensor.yaml of this sensor");
  verb_.add_option("--source", options_.source, source_help());
  verb_.add_option("--output", options_.outputs, output_help());
  verb_.add_option("--frames", options_.frames, "end after N frames")
      .check(command_line::range(1, kMaxRunFrames));
  verb_.add_option("--seconds", options_.seconds, "end after S seconds")
      .check(command_line::seconds());
  verb_.add_flag("--fast", options_.fast,
                 "sources that are not live run as fast as they can, no frame dropped");
  verb_.add_flag("--no-zero-tracking", options_.no_zero_tracking,
                 "the zero does not follow what reads while nobody touches the sensor");
  verb_.add_option("--board", options_.board,
                   "serial port of the board that lights the tags and reads load cells");
  verb_.add_option("--cells", options_.cells,
                   "calibration file of its load cells; without it the one kept for this board");
}

int RecordCommand::run() {
  record_.keep = keep_ == "raw"      ? record::Keep::raw
                 : keep_ == "region" ? record::Keep::region
                                     : record::Keep::none;
  options_.record = record_;
  return tagwrench::run(options_);
}

}  // namespace tagwrench

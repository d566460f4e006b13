// `tagwrench tags`: sheets of tags and boards to print.

#include <cmath>
#include <optional>
#include <vector>

#include "host/calibration/print/sheets.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/sensor/sensor_config.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

struct TagsOptions {
  command_line::Option sensor_given, hardware_given, family_given, ids_given, size_given,
      border_given, copies_given, board_given, marker_given;
  std::string out;
  std::string paper = "a4";
  int copies = 0;
  std::string sensor;
  std::string hardware;
  std::string family;
  std::vector<int> ids;
  double size_mm = 0;
  double border_mm = 0;
  bool published = false;
  std::string board;
  int columns = 9;
  int rows = 6;
  double square_mm = 1.2;
  double marker_mm = 0;
  std::string dictionary = "aruco_4x4_50";
};

struct Sheet {
  Drawing drawing;
  double cell_mm = 1;
};

/// Printers of 600 dots an inch draw smaller cells with two dots a side or fewer.
constexpr double kFinestCell_mm = 0.1;
constexpr double kUsualMarker = 0.75;  // of its square

/// Metres as written in a file of millimetres.
double in_mm(double metres) { return std::round(1e9 * metres) / 1e6; }

TagFamily known_family(const std::string& option, const std::string& text) {
  const std::optional<TagFamily> family = family_from_name(text);
  if (!family) {
    throw ConfigError(
        "{}: there is no family '{}'; use aruco_original, aruco_4x4_50 ... aruco_7x7_1000, "
        "apriltag_16h5 ... apriltag_36h11 or grid_10x10",
        option, text);
  }
  return *family;
}

Paper known_paper(const std::string& text) {
  for (const Paper& paper : {kA4, kLetter})
    if (paper.name == text) return paper;
  throw ConfigError("--paper: no paper '{}'; use a4 or letter", text);
}

void add_tag_options(command_line::Command verb, TagsOptions& o) {
  o.sensor_given =
      verb.add_option("--sensor", o.sensor,
                      "sensor.yaml: the tags of this sensor; options below overrule what it says");
  o.hardware_given = verb.add_option(
      "--hardware", o.hardware,
      "a file of hardware/sensors: the tags of this sensor to be built; options below overrule it");
  o.sensor_given.excludes(o.hardware_given);
  o.family_given =
      verb.add_option("--family", o.family,
                      "aruco_original (default), aruco_4x4_50 ... aruco_7x7_1000, apriltag_16h5 "
                      "... apriltag_36h11, grid_10x10 (finest measurement)");
  o.ids_given = verb.add_option("--ids", o.ids, "for example 5,2 (default)").delimiter(',');
  o.size_given = verb.add_option("--size-mm", o.size_mm, "edge of the black square, default 3.8");
  o.border_given = verb.add_option("--border-mm", o.border_mm,
                                   "white around it, to be cut out with it, default 0.35");
  o.board_given = verb.add_option(
      "--board", o.board,
      "charuco or checkerboard, for `calibrate camera`; or all of it in one word: "
      "charuco:COLUMNSxROWS:SQUAREmm:MARKERmm:DICTIONARY, checkerboard:COLUMNSxROWS:SQUAREmm");
  for (command_line::Option tags : {o.sensor_given, o.hardware_given, o.family_given, o.ids_given,
                                    o.size_given, o.border_given})
    o.board_given.excludes(tags);
}

void add_board_options(command_line::Command verb, TagsOptions& o) {
  auto columns = verb.add_option("--columns", o.columns, "squares across").capture_default_str();
  auto rows = verb.add_option("--rows", o.rows, "squares down").capture_default_str();
  auto square =
      verb.add_option("--square-mm", o.square_mm,
                      "edge of a square; 1.2 suits a lens focused at 21 mm, 25 one for a room")
          .capture_default_str();
  o.marker_given = verb.add_option("--marker-mm", o.marker_mm,
                                   "edge of a charuco marker; without it 0.75 of a square");
  auto dictionary = verb.add_option("--dictionary", o.dictionary, "family of the charuco markers")
                        .capture_default_str();
  for (command_line::Option option : {columns, rows, square, o.marker_given, dictionary})
    option.needs(o.board_given);
}

Sheet tags(const TagsOptions& o) {
  TagSheet sheet;
  if (!o.sensor.empty()) {
    const TargetDescription target =
        load_sensor(o.sensor, WrenchCalibration::without_camera).target;
    sheet.family = target.family;
    sheet.size_mm = in_mm(target.tag_size);
    sheet.border_mm = in_mm(target.border);
    sheet.ids.clear();
    for (const Tag& tag : target.tags) sheet.ids.push_back(tag.id);
  }
  if (!o.hardware.empty()) {
    const hardware::TargetChoice target = load_buildable(o.hardware).target;
    sheet.family = *family_from_name(target.family);
    sheet.size_mm = in_mm(target.tag_size);
    sheet.border_mm = in_mm(target.border);
    sheet.ids = target.ids;
  }
  if (o.family_given.count() > 0) sheet.family = known_family("--family", o.family);
  if (o.ids_given.count() > 0) sheet.ids = o.ids;
  if (o.size_given.count() > 0) sheet.size_mm = o.size_mm;
  if (o.border_given.count() > 0) sheet.border_mm = o.border_mm;
  if (o.copies_given.count() > 0) sheet.copies = o.copies;
  return {tag_sheet(known_paper(o.paper), sheet), cell_mm(sheet)};
}

Sheet board_of(const TagsOptions& o) {
  BoardSpec board;
  if (o.board == "charuco" || o.board == "checkerboard") {
    board.kind = o.board == "charuco" ? BoardKind::charuco : BoardKind::checkerboard;
    board.columns = o.columns;
    board.rows = o.rows;
    board.square = 1e-3 * o.square_mm;
    board.marker = o.marker_given.count() > 0 ? 1e-3 * o.marker_mm : kUsualMarker * board.square;
    board.dictionary = known_family("--dictionary", o.dictionary);
  } else {
    board = parse_board(o.board);
  }
  const int copies = o.copies_given.count() > 0 ? o.copies : 1;
  return {board_sheet(known_paper(o.paper), board, copies), cell_mm(board)};
}

Sheet sheet_of(const TagsOptions& o) {
  if (o.published) return {published_sheet(known_paper(o.paper))};
  return o.board_given.count() > 0 ? board_of(o) : tags(o);
}

int print_tags(const TagsOptions& o) {
  const Sheet asked = sheet_of(o);
  write_vector_file(asked.drawing, o.out);
  if (asked.cell_mm < kFinestCell_mm) {
    log_info(
        "{}: cells of {:.3f} mm are finer than most printers print; use larger tags, or fewer "
        "cells",
        o.out, asked.cell_mm);
  }
  log_info("{}: print at 100 %, then measure the two bars of 50.0 mm", o.out);
  return 0;
}

}  // namespace

void tags_command(command_line::Command program) {
  const auto o = std::make_shared<TagsOptions>();
  auto verb = program.add_subcommand(
      "tags", "sheets of tags and calibration boards, true to scale, to print");
  verb.footer(
      "Print at 100 % and check the two bars of 50.0 mm on the sheet. Never print mirrored, even "
      "for a camera that delivers mirrored images: that is `mirrored: true` in its sensor.yaml.");
  verb.add_option("--out", o->out, "FILE.pdf or FILE.svg").required();
  verb.add_option("--paper", o->paper, "a4 or letter").capture_default_str();
  o->copies_given = verb.add_option("--copies", o->copies,
                                    "of each tag (without it 6) or of the board (without it 1)");
  add_tag_options(verb, *o);
  add_board_options(verb, *o);
  auto published = verb.add_flag("--paper-sheet", o->published,
                                 "the published design's sheet: aruco_original, ids 0 to 9, 3.0 to "
                                 "5.0 mm; its sensor carries ids 5 and 2 of 3.8 mm");
  for (command_line::Option other : {o->family_given, o->ids_given, o->size_given, o->border_given,
                                     o->copies_given, o->board_given})
    published.excludes(other);
  verb.runs([o] { return print_tags(*o); });
}

}  // namespace tagwrench

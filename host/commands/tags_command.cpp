#include "host/commands/tags_command.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "host/calibration/print/drawing.h"
#include "host/calibration/print/sheets.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/sensor/sensor_config.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

/// Printers of 600 dots an inch draw smaller cells with two dots a side or fewer.
constexpr double kFinestCell_mm = 0.1;
constexpr double kUsualMarker = 0.75;  // of its square

/// Metres as written in a file of millimetres.
double in_mm(double metres) { return std::round(1e9 * metres) / 1e6; }

TagFamily known_family(const std::string& option, const std::string& text) {
  const std::optional<TagFamily> family = family_from_name(text);
  if (!family) {
    throw ConfigError(
        fmt::format("{}: there is no family '{}'; use aruco_original, aruco_4x4_50 "
                    "... aruco_7x7_1000, apriltag_16h5 ... apriltag_36h11 or "
                    "grid_10x10",
                    option, text));
  }
  return *family;
}

Paper known_paper(const std::string& text) {
  for (const Paper& paper : {kA4, kLetter}) {
    if (paper.name == text) return paper;
  }
  throw ConfigError(fmt::format("--paper: no paper '{}'; use a4 or letter", text));
}

}  // namespace

struct TagsCommand::Sheet {
  Drawing drawing;
  double cell_mm = 1;
};

TagsCommand::TagsCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "tags", "sheets of tags and calibration boards, true to scale, to print")) {
  verb_.footer(
      "Print at 100 % and check the two bars of 50.0 mm on the sheet. Never print mirrored, even "
      "for a camera that delivers mirrored images: that is `mirrored: true` in its sensor.yaml.");
  verb_.add_option("--out", out_, "FILE.pdf or FILE.svg").required();
  verb_.add_option("--paper", paper_, "a4 or letter").capture_default_str();
  copies_given_ = verb_.add_option("--copies", copies_,
                                   "of each tag (without it 6) or of the board (without it 1)");
  add_tag_options();
  add_board_options();
  command_line::Option published =
      verb_.add_flag("--paper-sheet", published_,
                     "the published design's sheet: aruco_original, ids 0 to 9, "
                     "3.0 to 5.0 mm; its sensor carries ids 5 and 2 of 3.8 mm");
  for (command_line::Option other :
       {family_given_, ids_given_, size_given_, border_given_, copies_given_, board_given_}) {
    published.excludes(other);
  }
}

void TagsCommand::add_tag_options() {
  sensor_given_ =
      verb_.add_option("--sensor", sensor_,
                       "sensor.yaml: the tags of this sensor; options below overrule what it says");
  hardware_given_ = verb_.add_option(
      "--hardware", hardware_,
      "a file of hardware/sensors: the tags of this sensor to be built; options below overrule it");
  sensor_given_.excludes(hardware_given_);
  family_given_ = verb_.add_option(
      "--family", family_,
      "aruco_original (default), aruco_4x4_50 ... aruco_7x7_1000, apriltag_16h5 ... "
      "apriltag_36h11, grid_10x10 (finest measurement)");
  ids_given_ = verb_.add_option("--ids", ids_, "for example 5,2 (default)").delimiter(',');
  size_given_ = verb_.add_option("--size-mm", size_mm_, "edge of the black square, default 3.8");
  border_given_ = verb_.add_option("--border-mm", border_mm_,
                                   "white around it, to be cut out with it, default 0.35");
  board_given_ = verb_.add_option(
      "--board", board_,
      "charuco or checkerboard, for `calibrate camera`; or all of it in one word: "
      "charuco:COLUMNSxROWS:SQUAREmm:MARKERmm:DICTIONARY, checkerboard:COLUMNSxROWS:SQUAREmm");
  for (command_line::Option tags :
       {sensor_given_, hardware_given_, family_given_, ids_given_, size_given_, border_given_}) {
    board_given_.excludes(tags);
  }
}

void TagsCommand::add_board_options() {
  command_line::Option columns =
      verb_.add_option("--columns", columns_, "squares across").capture_default_str();
  command_line::Option rows =
      verb_.add_option("--rows", rows_, "squares down").capture_default_str();
  command_line::Option square =
      verb_
          .add_option("--square-mm", square_mm_,
                      "edge of a square; 1.2 suits a lens focused at 21 mm, 25 one for a room")
          .capture_default_str();
  marker_given_ = verb_.add_option("--marker-mm", marker_mm_,
                                   "edge of a charuco marker; without it 0.75 of a square");
  command_line::Option dictionary =
      verb_.add_option("--dictionary", dictionary_, "family of the charuco markers")
          .capture_default_str();
  for (command_line::Option option : {columns, rows, square, marker_given_, dictionary}) {
    option.needs(board_given_);
  }
}

TagsCommand::Sheet TagsCommand::tags() const {
  TagSheet sheet;
  if (!sensor_.empty()) {
    const TargetDescription target = load_sensor(sensor_, WrenchCalibration::without_camera).target;
    sheet.family = target.family;
    sheet.size_mm = in_mm(target.tag_size);
    sheet.border_mm = in_mm(target.border);
    sheet.ids.clear();
    for (const Tag& tag : target.tags) sheet.ids.push_back(tag.id);
  }
  if (!hardware_.empty()) {
    const hardware::TargetChoice target = load_buildable(hardware_).target;
    sheet.family = *family_from_name(target.family);
    sheet.size_mm = in_mm(target.tag_size);
    sheet.border_mm = in_mm(target.border);
    sheet.ids = target.ids;
  }
  if (family_given_.count() > 0) sheet.family = known_family("--family", family_);
  if (ids_given_.count() > 0) sheet.ids = ids_;
  if (size_given_.count() > 0) sheet.size_mm = size_mm_;
  if (border_given_.count() > 0) sheet.border_mm = border_mm_;
  if (copies_given_.count() > 0) sheet.copies = copies_;
  return {tag_sheet(known_paper(paper_), sheet), cell_mm(sheet)};
}

TagsCommand::Sheet TagsCommand::board() const {
  BoardSpec board;
  if (board_ == "charuco" || board_ == "checkerboard") {
    board.kind = board_ == "charuco" ? BoardKind::charuco : BoardKind::checkerboard;
    board.columns = columns_;
    board.rows = rows_;
    board.square = 1e-3 * square_mm_;
    board.marker = marker_given_.count() > 0 ? 1e-3 * marker_mm_ : kUsualMarker * board.square;
    board.dictionary = known_family("--dictionary", dictionary_);
  } else {
    board = parse_board(board_);
  }
  const int copies = copies_given_.count() > 0 ? copies_ : 1;
  return {board_sheet(known_paper(paper_), board, copies), cell_mm(board)};
}

TagsCommand::Sheet TagsCommand::sheet() const {
  if (published_) return {published_sheet(known_paper(paper_))};
  return board_given_.count() > 0 ? board() : tags();
}

int TagsCommand::run() const {
  const Sheet asked = sheet();
  write_vector_file(asked.drawing, out_);
  if (asked.cell_mm < kFinestCell_mm) {
    log_info(
        fmt::format("{}: cells of {:.3f} mm are finer than most printers print; use larger tags, "
                    "or fewer cells",
                    out_, asked.cell_mm));
  }
  log_info(fmt::format("{}: print at 100 %, then measure the two bars of 50.0 mm", out_));
  return 0;
}

}  // namespace tagwrench

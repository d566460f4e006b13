// `tagwrench tags`: its options, and from them a sheet to print.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class TagsCommand {
 public:
  explicit TagsCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Writes the sheet; returns the exit status. Throws ConfigError for what cannot be printed.
  int run() const;

 private:
  void add_tag_options();
  void add_board_options();

  command_line::Command verb_;
  command_line::Option sensor_given_;
  command_line::Option hardware_given_;
  command_line::Option family_given_;
  command_line::Option ids_given_;
  command_line::Option size_given_;
  command_line::Option border_given_;
  command_line::Option copies_given_;
  command_line::Option board_given_;
  command_line::Option marker_given_;
  std::string out_;
  std::string paper_ = "a4";
  int copies_ = 0;
  std::string sensor_;
  std::string hardware_;
  std::string family_;
  std::vector<int> ids_;
  double size_mm_ = 0;
  double border_mm_ = 0;
  bool published_ = false;
  std::string board_;
  int columns_ = 9;
  int rows_ = 6;
  double square_mm_ = 1.2;
  double marker_mm_ = 0;
  std::string dictionary_ = "aruco_4x4_50";

  struct Sheet;
  Sheet sheet() const;
  Sheet tags() const;
  Sheet board() const;
};

}  // namespace tagwrench

// `tagwrench export`: what a recording holds, in files for other programs.
#pragma once

#include <fstream>
#include <string>

#include "host/core/command_line/command_line.h"
#include "host/recording/reader.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class ExportCommand {
 public:
  explicit ExportCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError for what cannot be exported.
  int run() const;

 private:
  command_line::Command verb_;
  std::string recording_;
  std::string csv_;
  std::string paper_;
  std::string frames_;
  std::string references_;
  std::string events_;
  bool force_ = false;
};

/// A text file that appears when it is complete, or standard output (`-`).
class ExportFile {
 public:
  /// Throws ConfigError: it exists and is not to be replaced, or cannot be written.
  ExportFile(const std::string& path, bool force);
  ExportFile(const ExportFile&) = delete;
  ExportFile& operator=(const ExportFile&) = delete;
  /// What was not finished is not there.
  ~ExportFile();

  std::ostream& out() { return *out_; }
  /// Throws std::runtime_error: the disk is full.
  void finish();

 private:
  std::string path_;
  std::string partial_;
  std::ofstream file_;
  std::ostream* out_;
};

/// The two CSV files of Ouyang and Howe's program (ICRA 2020), PREFIX_arucotagData.csv and, where
/// there is a six-axis reference, PREFIX_optoforceData.csv: see export_paper.cpp. Throws
/// ConfigError if the sensor has not two tags or they were never held.
void export_paper(const std::string& recording, const std::string& prefix, bool force);

/// A folder for images:DIR: pictures, frames.csv and sensor.yaml. JPEG, PNG and PGM files come out
/// as they went in, everything else as PGM. Throws ConfigError if the folder is there and not
/// empty.
void export_frames(const std::string& recording, const std::string& folder);

}  // namespace tagwrench

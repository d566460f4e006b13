// `tagwrench analyze`: what data with a reference say about an instrument, on what it has not seen.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/csv_mapping.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

class AnalyzeCommand {
 public:
  explicit AnalyzeCommand(command_line::Command program);
  bool parsed() const { return verb_.parsed(); }
  int run() const;

 private:
  void add_mapping_options();
  void add_analysis_options();
  study::CsvMapping mapping() const;

  command_line::Command verb_;
  std::vector<std::filesystem::path> files_;
  std::string json_;
  bool force_ = false;
  bool series_ = false;
  study::AnalysisOptions options_;

  command_line::Option readings_given_;
  study::CsvMapping mapping_;
  std::string separator_ = "auto";
  std::string time_unit_ = "s";
  std::string reference_time_unit_ = "s";
  std::vector<std::string> features_;
  std::vector<std::string> loads_;
  std::string data_;  ///< where what was mapped goes as a data file
};

}  // namespace tagwrench

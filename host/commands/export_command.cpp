#include "host/commands/export_command.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/log.h"
#include "host/output/sample_text.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

std::int64_t ns(TimePoint time) { return time.time_since_epoch().count(); }

/// What a file holds now. Standard output is not talked about.
void tell_written(std::uint64_t count, std::string_view one, const std::string& path) {
  if (path != "-") log_info(fmt::format("{} in {}", count_text(count, one), path));
}

void export_samples(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording);
  ExportFile file(path, force);
  file.out() << kCsvHeader;
  LineBuffer line{};
  std::uint64_t count = 0;
  for (Sample sample; reader.next(sample); ++count) file.out() << csv_line(line, sample);
  file.finish();
  tell_written(count, "sample", path);
}

/// NaN is an empty field.
std::string field(double value) {
  return std::isnan(value) ? std::string(",") : fmt::format(",{}", value);
}

void export_references(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording);
  ExportFile file(path, force);
  file.out() << "t_ns,sigma_ns,channel,axes,saturated,lost_before";
  for (const char* what : {"counts", "value", "sigma"}) {
    for (int i = 0; i < 6; ++i) file.out() << ',' << what << '_' << i;
  }
  file.out() << '\n';
  std::uint64_t count = 0;
  for (record::ReferenceRecord r; reader.next(r); ++count) {
    std::string line = fmt::format("{},{},{},{},{},{}", ns(r.time), r.time_sigma.count(), r.channel,
                                   r.axes, r.saturated ? 1 : 0, r.lost_before);
    for (const auto* six : {&r.counts, &r.value, &r.sigma}) {
      for (const double value : *six) line += field(value);
    }
    file.out() << line << '\n';
  }
  file.finish();
  tell_written(count, "reading", path);
}

/// RFC 4180.
std::string in_quotes(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

void export_events(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording);
  ExportFile file(path, force);
  file.out() << "id,t_ns,kind,step,value,text\n";
  std::uint64_t count = 0;
  for (record::EventRecord e; reader.next(e); ++count) {
    file.out() << fmt::format("{},{},{},{},{},{}\n", e.id, ns(e.time), name(e.kind),
                              e.step < 0 ? std::string() : std::to_string(e.step), e.value,
                              e.text.empty() ? std::string() : in_quotes(e.text));
  }
  file.finish();
  tell_written(count, "event", path);
}

}  // namespace

ExportFile::ExportFile(const std::string& path, bool force) : path_(path), out_(&file_) {
  if (path == "-") {
    out_ = &std::cout;
    return;
  }
  std::error_code error;
  if (!force && fs::exists(fs::symlink_status(path, error))) {
    throw ConfigError(
        fmt::format("{}: exists; choose another name, or replace it with --force", path));
  }
  partial_ = path + ".partial";
  file_.open(partial_, std::ios::binary | std::ios::trunc);
  if (!file_) {
    throw ConfigError(
        fmt::format("{}: cannot be written; choose a file in a folder of yours", path));
  }
}

ExportFile::~ExportFile() {
  if (partial_.empty()) return;
  file_.close();
  std::error_code ignored;
  fs::remove(partial_, ignored);
}

void ExportFile::finish() {
  out_->flush();
  if (!*out_) {
    throw std::runtime_error(fmt::format("{}: cannot be written; free some space on the disk",
                                         path_ == "-" ? "standard output" : path_));
  }
  if (partial_.empty()) return;
  file_.close();
  fs::rename(partial_, path_);
  partial_.clear();
}

ExportCommand::ExportCommand(command_line::Command program)
    : verb_(program.add_subcommand("export",
                                   "a recording's samples, frames and readings, in files")) {
  verb_.add_option("recording", recording_, "what `tagwrench record --out` made").required();
  verb_.add_option("--csv", csv_, "its samples, in the columns of --output csv:FILE");
  verb_.add_option("--paper", paper_,
                   "PREFIX_arucotagData.csv and PREFIX_optoforceData.csv, in the columns of\n"
                   "Ouyang and Howe's program (ICRA 2020)");
  verb_.add_option("--frames", frames_, "a folder for --source images:DIR");
  verb_.add_option("--references", references_, "readings of load cells and six-axis sensors");
  verb_.add_option("--events", events_, "marks, notes, news of the board, as CSV");
  verb_.add_flag("--force", force_, "files that exist are replaced");
}

int ExportCommand::run() const {
  if (csv_.empty() && paper_.empty() && frames_.empty() && references_.empty() && events_.empty()) {
    throw ConfigError(
        "export: nothing was asked for; give --csv, --paper, --frames, --references or --events");
  }
  if (const record::RecordingReader reader(recording_); !reader.unclosed().empty())
    log_info(fmt::format("{} {}", recording_, reader.unclosed()));
  if (!csv_.empty()) export_samples(recording_, csv_, force_);
  if (!references_.empty()) export_references(recording_, references_, force_);
  if (!events_.empty()) export_events(recording_, events_, force_);
  if (!paper_.empty()) export_paper(recording_, paper_, force_);
  if (!frames_.empty()) export_frames(recording_, frames_);
  return 0;
}

}  // namespace tagwrench

// `tagwrench analyze`: what data with a reference say about an instrument, on what it has not seen.
#include <fmt/format.h>

#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/commands/commands.h"
#include "host/commands/recorded_trial.h"
#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"

namespace tagwrench {
namespace {

struct AnalyzeOptions {
  std::vector<std::filesystem::path> files;
  std::string json;
  bool force = false;
  bool series = false;
  study::AnalysisOptions analysis;

  command_line::Option readings_given;
  study::CsvMapping mapping;
  std::string separator = "auto";
  std::string time_unit = "s";
  std::string reference_time_unit = "s";
  std::vector<std::string> features;
  std::vector<std::string> loads;
  std::string data;  ///< where what was mapped goes as a data file
};

char known_separator(const std::string& text) {
  if (text == "auto") return 0;
  if (text == "tab" || text == "\\t") return '\t';
  if (text.size() == 1 && std::string_view(";,|:\t ").find(text[0]) != std::string_view::npos)
    return text[0];
  throw ConfigError("--separator: '{}' is none; use ; , tab or auto", text);
}

/// That `out` can be written, is none of the files that are read, and replaces nothing unasked.
void check_output(const char* option, const std::filesystem::path& out, bool force,
                  const std::vector<std::filesystem::path>& inputs) {
  for (const std::filesystem::path& input : inputs) {
    std::error_code none;
    if (std::filesystem::equivalent(out, input, none))
      throw ConfigError("{} {}: is what is to be read; name another file", option, out.string());
  }
  std::error_code none;
  if (!force && std::filesystem::exists(std::filesystem::symlink_status(out, none))) {
    throw ConfigError("{} {}: is there already; name another file, or --force", option,
                      out.string());
  }
  check_replaceable(out);
}

void add_analysis_options(command_line::Command verb, study::AnalysisOptions& o) {
  verb.add_option("--folds", o.folds, "blocks in time, each held out once")
      .check(command_line::range(2, 100))
      .capture_default_str();
  verb.add_option("--hold-out", o.hold_out,
                  "instead of blocks hold out this share at the end, for example 0.3")
      .check(command_line::range(0.05, 0.9));
  verb.add_option("--guard", o.guard, "s beside what is held out that are not learned from")
      .check(command_line::range(0.0, 3600.0));
  verb.add_option("--ridge", o.ridge, "penalty of standardised features, for example 1e-3")
      .check(command_line::range(0.0, 1e3));
  verb.add_flag("--smooth", o.smooth,
                "filter all readings by [1/4 1/2 1/4], and the reference alike");
  verb.add_option("--drop-start", o.drop_start, "s of readings left out")
      .check(command_line::range(0.0, 1e6));
  verb.add_option("--lag-from", o.lag_from, "s, shortest lag looked for")
      .check(command_line::range(-10.0, 10.0))
      .capture_default_str();
  verb.add_option("--lag-to", o.lag_to, "s, longest")
      .check(command_line::range(-10.0, 10.0))
      .capture_default_str();
}

void add_mapping_options(command_line::Command verb, AnalyzeOptions& o) {
  study::CsvMapping& m = o.mapping;
  o.readings_given = verb.add_option("--readings", m.readings, "CSV of what the sensor read");
  const auto add = [&](const char* name, auto& value, const char* what) {
    return verb.add_option(name, value, what).needs(o.readings_given);
  };
  add("--reference", m.reference, "CSV of the reference; without it the same file");
  add("--separator", o.separator, "; , tab or auto");
  add("--skip-lines", m.skip_lines, "of text at the top of each file");
  add("--reading-time", m.reading_time, "column of times; 1 without it");
  add("--reference-time", m.reference_time, "column of times; 1 without it");
  add("--time-unit", o.time_unit, "s ms us ns");
  add("--reference-time-unit", o.reference_time_unit, "s ms us ns");
  add("--features", o.features,
      "COLUMNS[:UNIT][:euler[=ORDER]][:unsmooth=WEIGHT], any number of times.\n"
      "Units m mm um rad mrad deg. euler: three angles of intrinsic rotations, xyz or another\n"
      "order, become a rotation vector from rest. unsmooth undoes an exponential smoothing");
  add("--load", o.loads,
      "COLUMNS[:UNIT][:counts=A,B,...][:axes=Fx,...][:negative], any number of times.\n"
      "Units N mN gf Nm mNm Nmm; counts: per unit; axes: Fx Fy Fz Mx My Mz, in order without it");
  add("--skip-readings", m.skip_readings, "rows left out at the start (after unsmooth)");
  add("--skip-references", m.skip_references, "rows left out at the start");
  add("--rest-readings", m.rest_readings, "rows from whose mean euler counts; 10 without it");
  add("--zero-rows", m.zero_rows, "first rows of the reference whose mean is zero");
  add("--data", o.data, "write what was read as FILE.data.csv, a new one");
}

study::CsvMapping mapping_of(const AnalyzeOptions& o) {
  study::CsvMapping mapping = o.mapping;
  mapping.separator = known_separator(o.separator);
  mapping.time_unit = study::parse_time_unit(o.time_unit, "--time-unit");
  mapping.reference_time_unit =
      study::parse_time_unit(o.reference_time_unit, "--reference-time-unit");
  if (o.features.empty()) throw ConfigError("--readings: say which columns by --features");
  if (o.loads.empty())
    throw ConfigError("--readings: say which columns the reference is by --load");
  for (const std::string& text : o.features)
    mapping.features.push_back(study::parse_feature_columns(text, "--features"));
  for (const std::string& text : o.loads)
    mapping.loads.push_back(study::parse_load_columns(text, "--load"));
  return mapping;
}

int analyze(const AnalyzeOptions& o) {
  const bool mapped = o.readings_given.count() > 0;
  if (mapped && !o.files.empty())
    throw ConfigError("--readings: either that or data files, not both");
  if (!mapped && o.files.empty())
    throw ConfigError("analyze: name a data file, or --readings of another program's CSV");
  std::vector<std::filesystem::path> inputs(o.files.begin(), o.files.end());
  if (mapped) inputs.insert(inputs.end(), {o.mapping.readings, o.mapping.reference});
  if (!o.json.empty() && o.json != "-") check_output("--json", o.json, o.force, inputs);
  if (!o.data.empty()) check_output("--data", o.data, o.force, inputs);
  if (!o.data.empty() && o.json == o.data)
    throw ConfigError("--data {}: is where --json goes; name another file", o.data);

  std::vector<study::Trial> trials;
  std::vector<std::string> notes;
  if (mapped) {
    study::MappedTrial read = study::read_mapped(mapping_of(o));
    trials.push_back(std::move(read.trial));
    notes = std::move(read.notes);
    if (!o.data.empty()) write_atomically(o.data, study::trial_to_csv(trials[0]));
  }
  for (const std::filesystem::path& file : o.files)
    trials.push_back(is_recording(file) ? recorded_trial(file, notes) : study::read_trial(file));

  study::Analysis analysis = study::analyze(trials, o.analysis);
  analysis.warnings.insert(analysis.warnings.begin(), notes.begin(), notes.end());
  const std::string json =
      o.json.empty() ? std::string() : study::analysis_json(analysis, o.series);
  if (!o.json.empty() && o.json != "-") write_atomically(o.json, json);
  print_data(o.json == "-" ? json : study::analysis_text(analysis));
  return 0;
}

}  // namespace

void analyze_command(command_line::Command program) {
  const auto o = std::make_shared<AnalyzeOptions>();
  auto verb = program.add_subcommand(
      "analyze", "how well readings predict a reference: scores on data held out, per axis");
  verb.footer(
      "Other people's CSV files, two of them or one:\n"
      "  tagwrench analyze --readings TAGS.csv --reading-time 2 --features 3-8:m\n"
      "    --features 9-11:deg:euler:unsmooth=0.2 --reference FORCE.csv --reference-time 2\n"
      "    --load 3-5:N:counts=96.11,95.64,20.92 --load 6-8:Nm:counts=5425.36,5524.60,8103.25\n"
      "Columns count from 1, or go by the names of the header.");
  verb.add_option(
      "files", o->files,
      "FILE.data.csv as calibrations leave them, or recordings with a six-axis reference;\n"
      "of several each is held out once");
  auto json = verb.add_option(
      "--json", o->json, "also as JSON to FILE, a new one; - is standard output, instead of text");
  verb.add_flag("--series", o->series, "with the held-out time series in the JSON").needs(json);
  verb.add_flag("--force", o->force, "replace files that are there");
  add_analysis_options(verb, o->analysis);
  add_mapping_options(verb, *o);
  verb.runs([o] { return analyze(*o); });
}

}  // namespace tagwrench

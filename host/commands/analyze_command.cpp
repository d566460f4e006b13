// `tagwrench analyze`: what data with a reference say about an instrument, on what it has not seen.
// `tagwrench certificate`: a calibration and the data it rests on, as one page.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/calibration/certificate/certificate.h"
#include "host/commands/commands.h"
#include "host/commands/measuring.h"
#include "host/commands/recorded_trial.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/core/sha256.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/sensor_config.h"

// Not fuzzed: hashes of files alone; fuzz.tables has the data, fuzz.json_files calibrations.

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

namespace fs = std::filesystem;

constexpr const char* kName = "certificate";  // where --out is a folder
constexpr std::size_t kNumberLength = 12;     // hexadecimal digits

/// The calibration in force, which belongs to this sensor. Throws ConfigError.
fs::path calibration_of(const std::string& sensor) {
  fs::path file = load_sensor(sensor).calibration;
  if (file.empty()) {
    throw ConfigError(
        "{}: there is no calibration in newtons; run `tagwrench calibrate wrench` first", sensor);
  }
  return file;
}

CertificateData described(const fs::path& file) {
  const FileSha256 hash = sha256_of_file(file);
  return {file.filename().string(), hash.hex, hash.bytes};
}

constexpr std::size_t kHashShown = 16;  // hexadecimal digits

void add(std::vector<Fact>& facts, const char* name, const std::string& value) {
  if (!value.empty()) facts.push_back({name, value});
}

std::string model_text(const Calibration& calibration) {
  const std::string kind(name(calibration.model.features.kind));
  const std::size_t tried = calibration.record.trials.size();
  return tried > 1 ? fmt::format("{}, the best of {} on data held out", kind, tried)
                   : kind + ", 6 x 6 with offset";
}

/// Of the fit's own cross-validation, which knows masses and lines of action.
std::string rmse_text(const std::array<AxisFit, 6>& axes) {
  std::vector<std::string> parts;
  for (int i = 0; i < 6; ++i) {
    const AxisFit& axis = axes[static_cast<std::size_t>(i)];
    if (axis.state == AxisState::calibrated)
      parts.push_back(fmt::format("{}\u00a0{}", kWrenchAxes[static_cast<std::size_t>(i)],
                                  load_text(axis.held_out_rmse, i)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// Those that change with what the calibration says of its axes.
std::vector<std::string> axis_warnings(const study::Analysis& analysis) {
  std::vector<std::string> lines = study::excitation_warnings(analysis);
  for (std::string& line : study::coverage_warnings(analysis)) lines.push_back(std::move(line));
  return lines;
}

std::vector<Fact> sensor_facts(const SensorIdentity& sensor) {
  std::vector<Fact> facts;
  add(facts, "Tags",
      fmt::format("{} {} of {:g} mm", sensor.family, fmt::join(sensor.tag_ids, ", "),
                  sensor.tag_size_mm));
  add(facts, "Camera", fmt::format("{} x {} px", sensor.image_px[0], sensor.image_px[1]));
  if (sensor.lens_px) {
    const auto& lens = *sensor.lens_px;
    add(facts, "Lens",
        fmt::format("focal length {:.1f}, {:.1f} px; centre {:.1f}, {:.1f} px", lens[0], lens[1],
                    lens[2], lens[3]));
  }
  add(facts, "Target as learned",
      sensor.target_sha256.empty() ? "not recorded"
                                   : "SHA-256 " + sensor.target_sha256.substr(0, kHashShown) + "…");
  add(facts, "Wrench", "applied to the platform, about its origin at rest, camera axes");
  return facts;
}

std::vector<Fact> procedure_facts(const Calibration& calibration) {
  const CalibrationRecord& record = calibration.record;
  std::vector<Fact> facts;
  add(facts, "Date", record.date);
  add(facts, "Plan", record.plan);
  add(facts, "Reference", record.reference);
  add(facts, "Model", model_text(calibration));
  // Of an instrument each reading counts, of masses the mean of each hold, which has less noise.
  if (record.axis)
    add(facts, record.lag ? "RMSE in its fit" : "Each hold's mean, RMSE", rmse_text(*record.axis));
  add(facts, "Software", record.software);
  add(facts, "Environment", record.notes.empty() ? "not noted" : record.notes);
  return facts;
}

/// What the calibration knows better than an analysis of its data: which axes are calibrated,
/// coverage of the intervals that it states, and its warnings.
void add_calibration(const CalibrationRecord& record, study::Analysis& analysis) {
  for (const std::string& line : axis_warnings(analysis)) std::erase(analysis.warnings, line);
  std::vector<std::string> remarks;
  for (std::size_t i = 0; i < 6; ++i) {
    study::AxisReport& report = analysis.axis[i];
    if (record.inside_95) report.coverage = (*record.inside_95)[i];
    if (!record.axis) continue;
    const AxisFit& axis = (*record.axis)[i];
    if (axis.state != AxisState::calibrated) {
      report.calibrated = false;
      report.reason = axis.reason.empty() ? name(axis.state)
                                          : fmt::format("{}: {}", name(axis.state), axis.reason);
    } else if (!report.calibrated && analysis.own_predictions && report.full_scale > 0) {
      report.calibrated = true;
      report.reason.clear();
      // The fit has all readings together and judges the axis; one reading's score cannot.
      const std::string why =
          report.excitation < study::kMinExcitation
              ? fmt::format(
                    "the scores on held-out readings hold the reference's own noise, which the "
                    "load exceeds {:.0f} times only",
                    report.excitation)
              : "but it was never loaded without the others, so that its scores are theirs too";
      remarks.push_back(fmt::format("{}: calibrated, its answer known to {:.1f} %; {}",
                                    kWrenchAxes[i], std::max(0.1, 100 * axis.gain_sigma), why));
    }
  }
  for (const std::string& line : axis_warnings(analysis)) remarks.push_back(line);
  analysis.warnings.insert(analysis.warnings.begin(), remarks.begin(), remarks.end());
  for (const std::string& warning : record.warnings)
    if (std::find(analysis.warnings.begin(), analysis.warnings.end(), warning) ==
        analysis.warnings.end())
      analysis.warnings.push_back(warning);
}

struct CertificateOptions {
  fs::path out;
  std::string sensor;
  std::string calibration;
  std::vector<fs::path> data;
  std::string environment;
  bool force = false;
};

/// What is to be certified.
struct Subject {
  std::optional<Calibration> calibration;
  std::vector<fs::path> data;
};

Subject subject_of(const CertificateOptions& o) {
  Subject subject;
  fs::path file = o.calibration;
  if (!o.sensor.empty()) file = calibration_of(o.sensor);
  if (!file.empty()) subject.calibration = read_calibration(file);
  subject.data = o.data;
  if (!o.data.empty()) return subject;
  if (!subject.calibration) {
    throw ConfigError(
        "certificate: nothing to certify; give --sensor, --calibration or FILE.data.csv");
  }
  const CalibrationRecord& record = subject.calibration->record;
  if (record.data_file.empty()) {
    throw ConfigError("{}: does not say which data it was made of; name FILE.data.csv",
                      file.string());
  }
  // A calibration may have ended between its files: then what it was made of is the one before.
  const fs::path data = file.parent_path() / fs::path(record.data_file).filename();
  const auto is_its = [&](const fs::path& one) {
    return sha256_hex(text_of_file(one).value_or("")) == record.data_sha256;
  };
  const fs::path before = fs::path(data) += ".before";
  if (!is_its(data) && is_its(before)) {
    log_info("{}: is of a later calibration, which ended half-way; taking {}", data.string(),
             before.string());
    subject.data.push_back(before);
    return subject;
  }
  if (!is_its(data)) {
    read_text(data);  // says what is wrong with it
    throw ConfigError(
        "{}: is not the data that {} was made of (SHA-256 differs); find those or calibrate again",
        data.string(), file.string());
  }
  subject.data.push_back(data);
  return subject;
}

Certificate certificate_of(const CertificateOptions& o) {
  const Subject subject = subject_of(o);
  Certificate result;
  result.issued = today();
  result.software = "tagwrench " TAGWRENCH_VERSION;
  std::vector<study::Trial> trials;
  std::vector<std::string> notes;
  for (const fs::path& file : subject.data) {
    trials.push_back(is_recording(file) ? recorded_trial(file, notes) : study::read_trial(file));
    result.data.push_back(described(file));  // a recording that was left open is closed by now
  }
  result.analysis = study::analyze(trials, {});
  result.analysis.warnings.insert(result.analysis.warnings.begin(), notes.begin(), notes.end());
  if (subject.calibration) {
    Calibration calibration = *subject.calibration;
    if (!o.environment.empty()) calibration.record.notes = o.environment;
    result.sensor = sensor_facts(calibration.sensor);
    result.procedure = procedure_facts(calibration);
    add_calibration(calibration.record, result.analysis);
  } else {
    result.sensor = {{"Identity", "not given: data alone"}};
    result.procedure = {{"Model", "linear, fitted to the data below"},
                        {"Environment", o.environment.empty() ? "not noted" : o.environment}};
  }
  std::string number = sha256_hex(certificate_json(result)).substr(0, kNumberLength);
  for (char& c : number) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  result.number = number;
  return result;
}

fs::path prefix_of(const CertificateOptions& o) {
  std::error_code error;
  if (!o.out.has_filename() || fs::is_directory(o.out, error)) return o.out / kName;
  const std::string extension = o.out.extension().string();
  if (extension == ".pdf" || extension == ".html" || extension == ".json")
    return fs::path(o.out).replace_extension();
  return o.out;
}

bool may_replace(const CertificateOptions& o, const std::vector<fs::path>& files) {
  if (o.force) return true;
  for (const fs::path& file : files) {
    if (!fs::exists(fs::symlink_status(file))) continue;
    if (::isatty(STDIN_FILENO) != 1 || ::isatty(STDERR_FILENO) != 1)
      throw ConfigError("{}: is there already; give another --out, or --force", file.string());
    std::cerr << fmt::format("tagwrench: {} is there already. Replace it? [y/N] ", file.string())
              << std::flush;
    std::string answer;
    std::getline(std::cin, answer);
    if (answer != "y" && answer != "Y" && answer != "yes")
      throw ConfigError("{}: stays as it is; give another --out", file.string());
    return true;
  }
  return false;
}

int certify(const CertificateOptions& o) {
  const std::string base = prefix_of(o).string();
  const std::vector<fs::path> files{base + ".html", base + ".pdf", base + ".json"};
  const fs::path folder = files[0].has_parent_path() ? files[0].parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw ConfigError("{}: is no folder; --out needs one that is there", folder.string());
  const bool replace = may_replace(o, files);
  const Certificate contents = certificate_of(o);
  const RenderedCertificate rendered = render_certificate(contents);
  write_together({{files[0], rendered.html}, {files[1], rendered.pdf}, {files[2], rendered.json}},
                 replace);
  if (rendered.pages > 1)
    log_info("{}: {} pages; shorter texts would fit one", files[1].string(), rendered.pages);
  for (std::size_t i = 0; i < 6; ++i) {
    const study::AxisReport& axis = contents.analysis.axis[i];
    if (!axis.calibrated) log_info("{} is not calibrated: {}", kWrenchAxes[i], axis.reason);
  }
  log_info("certificate {}: {}.html .pdf .json", contents.number, base);
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

void certificate_command(command_line::Command program) {
  const auto o = std::make_shared<CertificateOptions>();
  auto verb = program.add_subcommand("certificate",
                                     "one page about a calibration: HTML, PDF (A4) and JSON");
  verb.footer(
      "Every score is of data that the fit in question has not seen. The data are those that the "
      "calibration was made of, unless others are named; several are held out in turn.");
  verb.add_option("--out", o->out, "folder, or the beginning of the three files' names").required();
  auto sensor = verb.add_option(
      "--sensor", o->sensor, "sensor.yaml: its calibration, after a check that it belongs to it");
  verb.add_option("--calibration", o->calibration, "its file, such as measured/wrench.json")
      .excludes(sensor);
  verb.add_option("data", o->data,
                  "FILE.data.csv ... as calibrations and `analyze --data` leave them, or "
                  "recordings with a six-axis reference");
  verb.add_option("--environment", o->environment,
                  "in place of what the calibration noted: temperature, place, who");
  verb.add_flag("--force", o->force, "replace files that are there");
  verb.runs([o] { return certify(*o); });
}

}  // namespace tagwrench

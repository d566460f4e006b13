#include "host/commands/certificate_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <optional>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/calibration/certificate/render.h"
#include "host/commands/certificate_facts.h"
#include "host/commands/recorded_trial.h"
#include "host/commands/today.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/sha256.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "certificate";  // where --out is a folder
constexpr std::size_t kNumberLength = 12;     // hexadecimal digits

/// The calibration in force, which belongs to this sensor. Throws ConfigError.
fs::path calibration_of(const std::string& sensor) {
  fs::path file = load_sensor(sensor).calibration;
  if (file.empty()) {
    throw ConfigError(fmt::format(
        "{}: there is no calibration in newtons; run `tagwrench calibrate wrench` first", sensor));
  }
  return file;
}

CertificateData described(const fs::path& file) {
  const FileSha256 hash = sha256_of_file(file);
  return {file.filename().string(), hash.hex, hash.bytes};
}

}  // namespace

/// What is to be certified.
struct CertificateCommand::Subject {
  std::optional<Calibration> calibration;
  std::vector<fs::path> data;
};

CertificateCommand::CertificateCommand(command_line::Command program)
    : verb_(program.add_subcommand("certificate",
                                   "one page about a calibration: HTML, PDF (A4) and JSON")) {
  verb_.footer(
      "Every score is of data that the fit in question has not seen. The data are those that the "
      "calibration was made of, unless others are named; several are held out in turn.");
  verb_.add_option("--out", out_, "folder, or the beginning of the three files' names").required();
  command_line::Option sensor = verb_.add_option(
      "--sensor", sensor_, "sensor.yaml: its calibration, after a check that it belongs to it");
  verb_.add_option("--calibration", calibration_, "its file, such as measured/wrench.json")
      .excludes(sensor);
  verb_.add_option(
      "data", data_,
      "FILE.data.csv ... as calibrations and `analyze --data` leave them, or recordings "
      "with a six-axis reference");
  verb_.add_option("--environment", environment_,
                   "in place of what the calibration noted: temperature, place, who");
  verb_.add_flag("--force", force_, "replace files that are there");
}

CertificateCommand::Subject CertificateCommand::subject() const {
  Subject subject;
  fs::path file = calibration_;
  if (!sensor_.empty()) file = calibration_of(sensor_);
  if (!file.empty()) subject.calibration = read_calibration(file);
  subject.data = data_;
  if (!data_.empty()) return subject;
  if (!subject.calibration) {
    throw ConfigError(
        "certificate: nothing to certify; give --sensor, --calibration or FILE.data.csv");
  }
  const CalibrationRecord& record = subject.calibration->record;
  if (record.data_file.empty()) {
    throw ConfigError(fmt::format("{}: does not say which data it was made of; name FILE.data.csv",
                                  file.string()));
  }
  const fs::path data = file.parent_path() / fs::path(record.data_file).filename();
  if (sha256_hex(read_text(data)) != record.data_sha256) {
    throw ConfigError(fmt::format(
        "{}: is not the data that {} was made of (SHA-256 differs); find those or calibrate again",
        data.string(), file.string()));
  }
  subject.data.push_back(data);
  return subject;
}

Certificate CertificateCommand::certificate() const {
  const Subject subject = this->subject();
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
    if (!environment_.empty()) calibration.record.notes = environment_;
    result.sensor = sensor_facts(calibration.sensor);
    result.procedure = procedure_facts(calibration);
    add_calibration(calibration.record, result.analysis);
  } else {
    result.sensor = {{"Identity", "not given: data alone"}};
    result.procedure = {{"Model", "linear, fitted to the data below"},
                        {"Environment", environment_.empty() ? "not noted" : environment_}};
  }
  std::string number = sha256_hex(certificate_json(result)).substr(0, kNumberLength);
  for (char& c : number) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  result.number = number;
  return result;
}

fs::path CertificateCommand::prefix() const {
  std::error_code error;
  if (!out_.has_filename() || fs::is_directory(out_, error)) return out_ / kName;
  const std::string extension = out_.extension().string();
  if (extension == ".pdf" || extension == ".html" || extension == ".json")
    return fs::path(out_).replace_extension();
  return out_;
}

bool CertificateCommand::may_replace(const std::vector<fs::path>& files) const {
  if (force_) return true;
  for (const fs::path& file : files) {
    if (!fs::exists(fs::symlink_status(file))) continue;
    if (::isatty(STDIN_FILENO) != 1 || ::isatty(STDERR_FILENO) != 1) {
      throw ConfigError(
          fmt::format("{}: is there already; give another --out, or --force", file.string()));
    }
    std::cerr << fmt::format("tagwrench: {} is there already. Replace it? [y/N] ", file.string())
              << std::flush;
    std::string answer;
    std::getline(std::cin, answer);
    if (answer != "y" && answer != "Y" && answer != "yes")
      throw ConfigError(fmt::format("{}: stays as it is; give another --out", file.string()));
    return true;
  }
  return false;
}

int CertificateCommand::run() const {
  const std::string base = prefix().string();
  const std::vector<fs::path> files{base + ".html", base + ".pdf", base + ".json"};
  const fs::path folder = files[0].has_parent_path() ? files[0].parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw ConfigError(
        fmt::format("{}: is no folder; --out needs one that is there", folder.string()));
  const bool replace = may_replace(files);
  const Certificate contents = certificate();
  const RenderedCertificate rendered = render_certificate(contents);
  write_together({{files[0], rendered.html}, {files[1], rendered.pdf}, {files[2], rendered.json}},
                 replace);
  if (rendered.pages > 1)
    log_info(fmt::format("{}: {} pages; shorter texts would fit one", files[1].string(),
                         rendered.pages));
  for (std::size_t i = 0; i < 6; ++i) {
    const study::AxisReport& axis = contents.analysis.axis[i];
    if (!axis.calibrated)
      log_info(fmt::format("{} is not calibrated: {}", kWrenchAxes[i], axis.reason));
  }
  log_info(fmt::format("certificate {}: {}.html .pdf .json", contents.number, base));
  return 0;
}

}  // namespace tagwrench

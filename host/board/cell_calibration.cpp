#include "host/board/cell_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/unique_fd.h"
#include "host/core/os/user_folders.h"
#include "host/core/printable.h"

namespace tagwrench::link {
namespace {

constexpr double kMinSpan = 20;  ///< standard deviations of the counts' difference: 5 % of scale
constexpr double kMinSigma_counts = 0.3;  ///< of a mean: counts are whole numbers (1/sqrt(12))

void check_span(const std::vector<CellPoint>& points) {
  const auto by_mass = [](const CellPoint& a, const CellPoint& b) { return a.mass_kg < b.mass_kg; };
  const auto [least, most] = std::minmax_element(points.begin(), points.end(), by_mass);
  if (points.size() < 2 || most->mass_kg - least->mass_kg < 1e-6) {
    throw ConfigError(
        "calibrate-cell: all masses are the same: give at least two different ones; for example "
        "--mass 0,0.5");
  }
  const double difference = std::abs(most->mean_counts - least->mean_counts);
  const double sigma = std::hypot(std::max(most->sigma_counts, kMinSigma_counts),
                                  std::max(least->sigma_counts, kMinSigma_counts));
  if (difference < kMinSpan * sigma) {
    throw ConfigError(
        "calibrate-cell: {:g} kg changed the counts by {:.0f} only, with an uncertainty of {:.0f}; "
        "take a larger mass, or check that it rests on this cell",
        most->mass_kg - least->mass_kg, difference, sigma);
  }
}

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kFormat = "tagwrench-cells-1";
constexpr std::uintmax_t kMaxBytes = 1 << 20;
constexpr double kMaxNumber = 1e12;  ///< far beyond any cell; its square and products are finite
constexpr std::size_t kMaxShown = 40;

/// The file, and what to do if it is none.
struct Source {
  const std::string& path;
  const std::string& remedy;
};

[[noreturn]] void refuse(const Source& source, const std::string& why) {
  throw ConfigError("{}: {}; {}", source.path, why, source.remedy);
}

[[noreturn]] void not_readable(const std::string& path, const std::string& why) {
  throw ConfigError("{}: cannot be read: {}; make it readable, or give another file with --cells",
                    path, why);
}

double number(const Source& source, const json& cell, const char* key) {
  const auto found = cell.find(key);
  if (found == cell.end() || !found->is_number())
    refuse(source, fmt::format("\"{}\" is missing or no number", key));
  const double value = found->get<double>();
  if (!(std::abs(value) <= kMaxNumber))
    refuse(source, fmt::format("\"{}\" is beyond {:.0e}", key, kMaxNumber));
  return value;
}

struct Field {
  const char* key;
  double CellCalibration::*value;
  bool sigma;   ///< or the residual: not negative
  bool needed;  ///< files of earlier versions lack one
};

constexpr Field kFields[] = {
    {"newtons_per_count", &CellCalibration::newtons_per_count, false, true},
    {"newtons_per_count_sigma", &CellCalibration::newtons_per_count_sigma, true, true},
    {"zero_counts", &CellCalibration::zero_counts, false, true},
    {"zero_sigma_counts", &CellCalibration::zero_sigma_counts, true, true},
    {"zero_scale_covariance_n", &CellCalibration::zero_scale_covariance_n, false, false},
    {"noise_counts", &CellCalibration::noise_counts, true, true},
    {"residual_n", &CellCalibration::residual_n, true, true},
};

void read_cell(const Source& source, const json& cell, CellCalibrations& out) {
  if (!cell.is_object()) refuse(source, "\"cells\" holds something that is no cell");
  const double channel = number(source, cell, "channel");
  if (channel < 0 || channel >= kMaxChannels || channel != std::floor(channel))
    refuse(source, fmt::format("channel {} does not exist", channel));
  CellCalibration& to = out[static_cast<std::size_t>(channel)];
  if (to.calibrated) refuse(source, fmt::format("channel {} is in it twice", channel));
  for (const Field& field : kFields)
    if (field.needed || cell.contains(field.key)) to.*field.value = number(source, cell, field.key);
  if (to.newtons_per_count == 0) refuse(source, "\"newtons_per_count\" is 0");
  for (const Field& field : kFields)
    if (field.sigma && to.*field.value < 0)
      refuse(source, "a standard deviation or the residual is negative");
  to.calibrated = true;
}

constexpr double kGapPeriods = 1.5;
constexpr double kForget = 1.0 / 64;  ///< of the noise, per sample
constexpr std::uint64_t kEnough = 8;  ///< third differences
constexpr double kThirdOfNoise = 20;  ///< 1 + 9 + 9 + 1

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

Newtons CellCalibration::newtons(double counts) const noexcept {
  const double load = counts - zero_counts;
  const double random = std::hypot(noise_counts, zero_sigma_counts) * newtons_per_count;
  const double scale = load * newtons_per_count_sigma;
  const double variance =
      random * random + scale * scale - 2 * newtons_per_count * load * zero_scale_covariance_n;
  return {load * newtons_per_count, std::sqrt(std::max(variance, 0.0))};
}

CellCalibration fit_cell(const std::vector<CellPoint>& points, double gravity) {
  check_span(points);
  // counts = zero + slope * force, each point weighed by its variance.
  double w = 0, wx = 0, wxx = 0, wy = 0, wxy = 0;
  for (const CellPoint& point : points) {
    const double sigma = std::max(point.sigma_counts, kMinSigma_counts);
    const double weight = 1 / (sigma * sigma);
    const double force = point.mass_kg * gravity;
    w += weight;
    wx += weight * force;
    wxx += weight * force * force;
    wy += weight * point.mean_counts;
    wxy += weight * force * point.mean_counts;
  }
  const double determinant = w * wxx - wx * wx;
  const double slope = (w * wxy - wx * wy) / determinant;
  const double zero = (wxx * wy - wx * wxy) / determinant;
  double squares = 0;
  double weighted = 0;
  for (const CellPoint& point : points) {
    const double off = point.mean_counts - zero - slope * point.mass_kg * gravity;
    const double sigma = std::max(point.sigma_counts, kMinSigma_counts);
    squares += off * off;
    weighted += off * off / (sigma * sigma);
  }
  const double freedom = static_cast<double>(points.size()) - 2;
  const double scatter = freedom > 0 ? std::max(1.0, weighted / freedom) : 1.0;

  CellCalibration out;
  out.calibrated = true;
  out.newtons_per_count = 1 / slope;
  out.newtons_per_count_sigma = std::sqrt(scatter * w / determinant) / (slope * slope);
  out.zero_counts = zero;
  out.zero_sigma_counts = std::sqrt(scatter * wxx / determinant);
  out.zero_scale_covariance_n = scatter * wx / determinant / (slope * slope);
  if (freedom > 0) out.residual_n = std::sqrt(squares / freedom) / std::abs(slope);
  return out;
}

std::string id_text(const UniqueId& id) {
  std::string out;
  for (std::size_t i = 0; i < id.count && i < kIdBytes; ++i)
    out += fmt::format("{:02x}", id.bytes[i]);
  return out;
}

std::string cell_file_path(const std::string& board_id) {
  const fs::path folder = config_folder();
  if (folder.empty()) {
    throw ConfigError(
        "board: neither XDG_CONFIG_HOME nor HOME says where calibrations are kept; give --cells "
        "FILE");
  }
  return (folder / fmt::format("board-{}.json", board_id)).string();
}

CellCalibrations load_cells(const std::string& path, const std::string& board_id,
                            const std::string& remedy) {
  const Source source{path, remedy};
  CellCalibrations out;
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  if (type == fs::file_type::not_found) return out;
  if (error) not_readable(path, error.message());
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) > kMaxBytes)
    refuse(source, "is no calibration of load cells");
  errno = 0;
  std::ifstream in(path);
  if (!in) not_readable(path, std::strerror(errno));
  std::ostringstream content;
  if (!(content << in.rdbuf())) refuse(source, "is empty");
  const json root = parse_json(content.str());
  if (!root.is_object() || root.value("format", json()) != kFormat)
    refuse(source, fmt::format("is not of the format \"{}\"", kFormat));
  const json owner = root.value("board", json());
  if (!owner.is_null() && !owner.is_string()) refuse(source, "\"board\" is no text");
  if (!board_id.empty() && owner.is_string() && owner != "" && owner != board_id) {
    throw ConfigError(
        "{}: belongs to the board {}, this one is {}; calibrate this board's cells, or give "
        "another --cells",
        path, printable(owner.get<std::string>().substr(0, kMaxShown)), board_id);
  }
  const json cells = root.value("cells", json());
  if (!cells.is_array()) refuse(source, "\"cells\" is missing");
  for (const json& cell : cells) read_cell(source, cell, out);
  return out;
}

void save_cells(const std::string& path, const std::string& board_id,
                const CellCalibrations& cells) {
  json list = json::array();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const CellCalibration& cell = cells[i];
    if (!cell.calibrated) continue;
    json& entry = list.emplace_back(json{{"channel", i}});
    for (const Field& field : kFields) entry[field.key] = cell.*field.value;
  }
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  try {
    write_atomically(
        path,
        dump_json(json({{"format", kFormat}, {"board", board_id}, {"cells", list}}), 2) + "\n");
  } catch (const std::runtime_error&) {
    throw ConfigError("{}: cannot be written: {}; give another file with --cells", path,
                      std::strerror(errno));
  }
}

void SampleHistory::add(TimePoint time, Duration time_sigma, double value, double sigma,
                        bool lost_before) noexcept {
  const auto delay = Duration(std::llround(options_.delay * 1e9));
  Sample sample{time - delay, seconds(time_sigma), value, sigma, lost_before};
  if (!samples_.empty()) {
    const double apart = seconds(sample.time - samples_.back().time);
    if (apart <= 0) return;
    if (options_.period > 0 && apart > kGapPeriods * options_.period) sample.after_gap = true;
  }
  samples_.push(sample);
  watch_noise();
}

void SampleHistory::watch_noise() noexcept {
  const std::size_t n = samples_.size();
  if (n < 4) return;
  for (std::size_t i = n - 3; i < n; ++i)
    if (samples_[i].after_gap) return;
  const double third = samples_[n - 1].value - 3 * samples_[n - 2].value +
                       3 * samples_[n - 3].value - samples_[n - 4].value;
  ++thirds_;
  const double weight = std::max(kForget, 1.0 / static_cast<double>(thirds_));
  third_squares_ += weight * (third * third - third_squares_);
}

double SampleHistory::noise() const noexcept {
  return thirds_ < kEnough ? 0 : std::sqrt(third_squares_ / kThirdOfNoise);
}

std::size_t SampleHistory::first_after(TimePoint time) const noexcept {
  // The newest is what is asked about: few steps back from the end.
  std::size_t first = samples_.size();
  while (first > 0 && samples_[first - 1].time > time) --first;
  return first;
}

/// Mean size of the second differences on either side of the interval that ends at `right`.
double SampleHistory::bend(std::size_t right) const noexcept {
  double sum = 0;
  int count = 0;
  const auto second = [&](std::size_t middle) {
    sum += std::abs(samples_[middle + 1].value - 2 * samples_[middle].value +
                    samples_[middle - 1].value);
    ++count;
  };
  if (right >= 2 && !samples_[right - 1].after_gap) second(right - 1);
  if (right + 1 < samples_.size() && !samples_[right + 1].after_gap) second(right);
  return count == 0 ? 0 : sum / count;
}

Aligned SampleHistory::at(TimePoint time) const noexcept {
  if (samples_.empty()) return {};
  if (time < samples_[0].time) return {AlignStatus::too_old};
  const std::size_t right = first_after(time);
  if (right == samples_.size()) {
    if (time > samples_.back().time || right == 1) return {AlignStatus::too_new};
    return at(time - Duration(1));  // exactly the last sample
  }
  const Sample& a = samples_[right - 1];
  const Sample& b = samples_[right];
  if (b.after_gap) return {AlignStatus::gap};
  const double h = seconds(b.time - a.time);
  const double u = seconds(time - a.time) / h;
  const double slope = (b.value - a.value) / h;
  const double noise_now = noise() * std::sqrt((1 - u) * (1 - u) + u * u);
  const double shift = std::max(a.time_sigma, b.time_sigma) * slope;
  const double scale = (1 - u) * a.sigma + u * b.sigma;
  const double between = 0.5 * u * (1 - u) * bend(right);
  return {AlignStatus::ok, a.value + u * (b.value - a.value),
          std::sqrt(noise_now * noise_now + shift * shift + scale * scale + between * between)};
}

}  // namespace tagwrench::link

#include "host/commands/calibrate_wrench/progress.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/os/atomic_file.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "tagwrench-calibrating-1";
constexpr std::size_t kFrameNumbers = 1 + 6 + 21;       // time, displacement, lower triangle
constexpr std::size_t kReadingNumbers = 1 + 6 + 6 + 1;  // time, value, sigma, saturated
constexpr double kMax = 1e12;

json frame_json(const TrackedFrame& frame) {
  json row = {frame.time};
  for (const double v : frame.displacement) row.push_back(v);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) row.push_back(frame.covariance(i, j));
  }
  return row;
}

json reading_json(const ReferenceSample& sample) {
  json row = {sample.time};
  for (const double v : sample.value) row.push_back(v);
  for (const double v : sample.sigma) row.push_back(v);
  row.push_back(sample.saturated ? 1 : 0);
  return row;
}

class ProgressReader {
 public:
  ProgressReader(const std::filesystem::path& path, const WrenchPlan& plan)
      : path_(path), plan_(plan), root_(parse_json(read_text(path))) {
    if (!root_.is_object() || root_.value("format", json()) != kFormat)
      fail("is not an interrupted calibration; remove it and start anew without --resume");
  }

  void check(const ProgressOf& of) const {
    if (root_.value("plan_sha256", json()) != of.plan_sha256)
      fail("belongs to another plan; give that one, or remove the file and start anew");
    if (root_.value("sensor_sha256", json()) != of.sensor_sha256)
      fail("belongs to another sensor; give that one, or remove the file and start anew");
  }

  Progress read() const {
    Progress progress;
    for (const json& s : list(root_, "skipped")) progress.skipped.push_back(step(s));
    for (const json& r : list(root_, "records")) {
      if (!r.is_object()) damaged();
      StepRecord record;
      record.step = step(r.value("step", json()));
      const json zero = r.value("zero", json());
      if (!zero.is_number_unsigned() || zero.get<std::uint64_t>() > 100'000) damaged();
      record.zero = zero.get<int>();
      for (const json& row : list(r, "frames")) record.frames.push_back(frame(row));
      for (const json& row : list(r, "readings")) record.readings.push_back(reading(row));
      if (record.frames.empty()) damaged();
      progress.records.push_back(std::move(record));
    }
    check_zeros(progress.records);
    return progress;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw ConfigError(fmt::format("{}: {}", path_.string(), message));
  }
  [[noreturn]] void damaged() const {
    fail("is damaged; remove it and start anew without --resume");
  }
  /// Each load has a rest of its zero before it.
  void check_zeros(const std::vector<StepRecord>& records) const {
    int zero = -1;
    for (const StepRecord& r : records) {
      const bool rest = plan_.steps[static_cast<std::size_t>(r.step)].kind == StepKind::rest;
      if (rest) zero = r.zero;
      if (r.zero != zero) damaged();
    }
  }
  json list(const json& object, const char* key) const {
    json value = object.value(key, json());
    if (!value.is_array() || value.size() > 1'000'000) damaged();
    return value;
  }
  int step(const json& value) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= plan_.steps.size()) damaged();
    return value.get<int>();
  }
  std::vector<double> numbers(const json& row, std::size_t count) const {
    if (!row.is_array() || row.size() != count) damaged();
    std::vector<double> out;
    for (const json& v : row) {
      if (!v.is_number()) damaged();
      out.push_back(v.get<double>());
      if (!(std::abs(out.back()) < kMax)) damaged();
    }
    return out;
  }
  TrackedFrame frame(const json& row) const {
    const std::vector<double> v = numbers(row, kFrameNumbers);
    TrackedFrame out;
    std::size_t at = 0;
    out.time = v[at++];
    for (int i = 0; i < 6; ++i) out.displacement[i] = v[at++];
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) out.covariance(i, j) = out.covariance(j, i) = v[at++];
    }
    return out;
  }
  ReferenceSample reading(const json& row) const {
    const std::vector<double> v = numbers(row, kReadingNumbers);
    ReferenceSample out;
    out.time = v[0];
    for (int i = 0; i < 6; ++i) {
      out.value[i] = v[static_cast<std::size_t>(1 + i)];
      out.sigma[i] = v[static_cast<std::size_t>(7 + i)];
    }
    out.saturated = v.back() != 0;
    return out;
  }

  std::filesystem::path path_;
  const WrenchPlan& plan_;
  json root_;
};

}  // namespace

void save_progress(const std::filesystem::path& path, const ProgressOf& of,
                   const Progress& progress) {
  json records = json::array();
  for (const StepRecord& record : progress.records) {
    json frames = json::array();
    for (const TrackedFrame& frame : record.frames) frames.push_back(frame_json(frame));
    json readings = json::array();
    for (const ReferenceSample& sample : record.readings) readings.push_back(reading_json(sample));
    records.push_back({{"step", record.step},
                       {"zero", record.zero},
                       {"frames", std::move(frames)},
                       {"readings", std::move(readings)}});
  }
  const json root = {{"format", kFormat},
                     {"plan_sha256", of.plan_sha256},
                     {"sensor_sha256", of.sensor_sha256},
                     {"skipped", progress.skipped},
                     {"records", std::move(records)}};
  std::error_code error;
  std::filesystem::create_directory(path.parent_path(),
                                    error);  // measured/, perhaps for the first time
  write_atomically(path, dump_json(root) + "\n");
}

Progress load_progress(const std::filesystem::path& path, const ProgressOf& of,
                       const WrenchPlan& plan) {
  const ProgressReader reader(path, plan);
  reader.check(of);
  return reader.read();
}

}  // namespace tagwrench

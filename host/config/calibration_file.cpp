#include "host/config/calibration_file.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/config_error.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "tagwrench-calibration-1";

class CalibrationReader {
 public:
  explicit CalibrationReader(const std::string& path) : path_(path) {
    std::ifstream in(path);
    if (!in)
      fail(
          "cannot be read; run `tagwrench calibrate wrench`, or remove wrench.calibration to use "
          "springs");
    std::ostringstream text;
    if (!(text << in.rdbuf())) fail("cannot be read; it is empty, or no file");
    root_ = json::parse(text.str(), nullptr, /*allow_exceptions=*/false);
    if (!root_.is_object())
      fail("is not a JSON object; it was cut short or is another kind of file");
    if (root_.value("format", json()) != kFormat) {
      fail(fmt::format(
          "\"format\" is not \"{}\"; it is not a calibration, or one of another version", kFormat));
    }
  }

  const json& at(const json& object, const std::string& key) const {
    if (!object.is_object() || !object.contains(key)) fail(fmt::format("\"{}\" is missing", key));
    return object.at(key);
  }
  const json& at(const std::string& key) const { return at(root_, key); }
  bool has(const std::string& key) const { return root_.contains(key); }

  Vector6 vector6(const json& list, const std::string& key) const {
    if (!list.is_array() || list.size() != 6) fail(fmt::format("\"{}\" must have 6 numbers", key));
    Vector6 out;
    for (int i = 0; i < 6; ++i) {
      if (!list[i].is_number()) fail(fmt::format("\"{}\" must have 6 numbers", key));
      out[i] = list[i].get<double>();
      if (!std::isfinite(out[i]))
        fail(fmt::format("\"{}\" holds a number that is not finite", key));
    }
    return out;
  }

  Matrix6 matrix6(const std::string& key) const {
    const json& rows = at(key);
    if (!rows.is_array() || rows.size() != 6)
      fail(fmt::format("\"{}\" must be 6 rows of 6 numbers", key));
    Matrix6 out;
    for (int r = 0; r < 6; ++r) out.row(r) = vector6(rows[r], key).transpose();
    return out;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw ConfigError(fmt::format("{}: {}", path_, message));
  }

 private:
  std::string path_;
  json root_;
};

/// Refuses a calibration whose identity differs; a stiffness matrix of another sensor gives wrong
/// newtons silently.
void check_identity(const CalibrationReader& file, const CameraModel& camera,
                    const TargetDescription& target) {
  const json& sensor = file.at("sensor");
  std::vector<int> ids;
  for (const Tag& tag : target.tags) ids.push_back(tag.id);
  const json expected = {{"family", std::string(name(target.family))},
                         {"tag_ids", ids},
                         {"image_px", {camera.width_px, camera.height_px}}};
  const auto differs = [&](const std::string& key, const json& ours) {
    file.fail(fmt::format(
        "was made for another sensor: its {} is {}, sensor.yaml has {}; calibrate this sensor", key,
        file.at(sensor, key).dump(), ours.dump()));
  };
  for (const auto& [key, ours] : expected.items()) {
    if (file.at(sensor, key) != ours) differs(key, ours);
  }
  const json& size = file.at(sensor, "tag_size_mm");
  if (!size.is_number() || std::abs(size.get<double>() - target.tag_size * 1e3) > 1e-6) {
    differs("tag_size_mm", target.tag_size * 1e3);
  }
}

}  // namespace

void load_calibration(const std::string& path, const CameraModel& camera,
                      const TargetDescription& target, WrenchModel& model) {
  const CalibrationReader file(path);
  check_identity(file, camera, target);
  model.K = file.matrix6("K");
  model.B = file.vector6(file.at("B"), "B");
  model.range = file.vector6(file.at("range"), "range");
  if ((model.range.array() <= 0).any()) file.fail("\"range\" must be greater than 0 on every axis");
  if (!file.has("covariance")) return;
  model.model_covariance = file.matrix6("covariance");
  if ((model.model_covariance.diagonal().array() < 0).any()) {
    file.fail("\"covariance\" has a negative variance on its diagonal");
  }
}

}  // namespace tagwrench

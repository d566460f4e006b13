#include "host/commands/measuring.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <turbojpeg.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/sensor/sensor_config.h"

// Not fuzzed: copies a sensor.yaml, of which fuzz.yaml_files has the parser.

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

SensorConfig as_it_is(const fs::path& sensor) {
  try {
    return load_sensor(sensor, WrenchCalibration::zero_that_fits);
  } catch (const ConfigError&) {  // its calibration in newtons is of before: the springs count
    return load_sensor(sensor, WrenchCalibration::ignore);
  }
}

constexpr Duration kLiveEventEvery = std::chrono::milliseconds(100);
constexpr Duration kPictureEventEvery = std::chrono::milliseconds(200);
constexpr int kPictureQuality = 70;

std::string base64(std::span<const std::uint8_t> bytes) {
  std::string text((bytes.size() + 2) / 3 * 4, '\0');  // and a zero, where a string has its own
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes.data(),
                  static_cast<int>(bytes.size()));
  return text;
}

/// Empty: it could not be made.
std::string jpeg_in_base64(const ImageView& image) {
  const std::unique_ptr<void, int (*)(tjhandle)> coder(tjInitCompress(), tjDestroy);
  if (!coder) return {};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(coder.get(), image.pixels, image.width, image.stride, image.height,
                                 TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, kPictureQuality, 0);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  return failed != 0 ? std::string() : base64({bytes, size});
}

}  // namespace

int stopped_unwritten() {
  log_info("stopped; nothing was written");
  return kExitStopped;
}

std::string today() { return fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))); }

MeasuredStamp stamp_for(const fs::path& sensor) {
  std::error_code error;
  const fs::path real = fs::is_symlink(sensor, error) ? fs::weakly_canonical(sensor) : sensor;
  return {today(), "tagwrench " TAGWRENCH_VERSION, real.filename().string()};
}

MeasuredSensor::MeasuredSensor(const std::string& sensor, const std::string& out,
                               const std::vector<const char*>& files)
    : from_(sensor), to_(out.empty() ? sensor : out) {
  const std::string text = read_text(from_);
  std::error_code error;
  if (to_ != from_ && !fs::equivalent(to_, from_, error)) {
    check_replaceable(to_);
    if (fs::exists(to_, error) && read_text(to_) != text) {
      throw ConfigError(
          "{}: is there already and says something else than {}; no sensor.yaml is written over: "
          "measure it with --sensor {}, or name a new file with --out",
          to_.string(), sensor, to_.string());
    }
    if (fs::weakly_canonical(folder(), error) ==
        fs::weakly_canonical(measured_folder(from_), error)) {
      throw ConfigError(
          "--out {}: the folder {}/ beside it is that of {}; name a file in another folder", out,
          kMeasuredFolder, sensor);
    }
  }
  check_measurable(folder(), files);
}

void MeasuredSensor::make(const std::vector<const char*>& keeps) const {
  std::error_code error;
  if (to_ == from_ || fs::equivalent(to_, from_, error)) return;
  if (!fs::exists(to_, error)) write_atomically(to_, read_text(from_));
  for (const char* file : keeps) {
    const fs::path old = measured_folder(from_) / file;
    if (fs::exists(old, error)) write_measured(folder() / file, read_text(old));
  }
}

void void_zero(const fs::path& sensor) {
  const fs::path file = measured_folder(sensor) / kMeasuredZero;
  set_aside(file);
  const SensorConfig now = as_it_is(sensor);
  if (now.zero.set.isZero()) return;
  write_measured(file, zero_yaml({stamp_for(sensor), Vector6::Zero(),
                                  sha256_of(identity_of(now.camera, now.target, now.rest)),
                                  sha256_of(now.wrench)}));
}

Events::Events(int fd) noexcept : fd_(fd) {
  const int flags = fd < 0 ? -1 : ::fcntl(fd, F_GETFL);
  if (flags < 0 || ::fcntl(fd, F_SETFL, flags | O_NONBLOCK) != 0) {
    fd_ = -1;
    return;
  }
  ::fcntl(fd, F_SETFD, FD_CLOEXEC);
}

void Events::line(std::string_view kind, const std::string& text) noexcept {
  if (!on()) return;
  send({{"line", {{"kind", kind}, {"text", text}}}});
}

void Events::live(const std::string& text) noexcept {
  if (!on() || !due(live_, kLiveEventEvery)) return;
  send({{"live", text}});
}

void Events::progress(double part) noexcept {
  const int percent = std::isfinite(part) ? static_cast<int>(std::lround(100 * part)) : 0;
  if (!on() || percent == percent_) return;
  if (send({{"progress", std::clamp(percent, 0, 100) / 100.0}})) percent_ = percent;
}

void Events::coverage(std::initializer_list<std::pair<const char*, Seen>> seen) noexcept {
  if (!on()) return;
  nlohmann::json coverage = nlohmann::json::object();
  for (const auto& [name, value] : seen)
    std::visit([&, key = name](const auto& v) { coverage[key] = v; }, value);
  std::string text = dump_json(coverage);
  if (text == coverage_) return;
  if (send({{"coverage", coverage}})) coverage_ = std::move(text);
}

void Events::picture(const ImageView& image, std::span<const TagCorners> tags) noexcept {
  if (!on() || !rest_.empty() || !due(picture_, kPictureEventEvery)) return;
  nlohmann::json outlines = nlohmann::json::array();
  for (const TagCorners& tag : tags) outlines.push_back({{"id", tag.id}, {"px", tag.px}});
  send({{"picture",
         {{"width", image.width},
          {"height", image.height},
          {"tags", std::move(outlines)},
          {"jpeg", jpeg_in_base64(image)}}}});
}

bool Events::due(TimePoint& last, Duration every) const noexcept {
  const TimePoint now = std::chrono::steady_clock::now();
  if (now - last < every) return false;
  last = now;
  return true;
}

/// Whole lines only: what has begun is ended before anything else is.
bool Events::send(const nlohmann::json& event) {
  const auto write_some = [this](std::string_view text) -> std::size_t {
    const ssize_t written = ::write(fd_, text.data(), text.size());
    if (written < 0 && errno != EAGAIN && errno != EINTR) fd_ = -1;  // the reader has gone
    return written < 0 ? 0 : static_cast<std::size_t>(written);
  };
  rest_.erase(0, rest_.empty() ? 0 : write_some(rest_));
  if (!rest_.empty() || !on()) return false;
  std::string text = dump_json(event);
  text += '\n';
  const std::size_t written = write_some(text);
  if (written > 0) rest_ = text.substr(written);
  return written > 0;
}

std::vector<TagCorners> outline_of(std::span<const std::array<double, 2>> corners_px) {
  if (corners_px.empty()) return {};
  const auto extreme = [&](double along_x, double along_y) {
    return *std::max_element(
        corners_px.begin(), corners_px.end(), [&](const auto& a, const auto& b) {
          return along_x * a[0] + along_y * a[1] < along_x * b[0] + along_y * b[1];
        });
  };
  TagCorners outline;
  const std::array<std::array<double, 2>, 4> four = {extreme(-1, -1), extreme(1, -1), extreme(1, 1),
                                                     extreme(-1, 1)};
  for (std::size_t i = 0; i < 4; ++i) {
    outline.px[2 * i] = four[i][0];
    outline.px[2 * i + 1] = four[i][1];
  }
  return {outline};
}

}  // namespace tagwrench

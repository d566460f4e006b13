#include "host/source/simulator/simulator_source.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <turbojpeg.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/os/timer.h"
#include "host/core/png/png.h"
#include "host/source/simulator/trajectory.h"

// Not fuzzed: decodes what it has encoded.

namespace tagwrench {
namespace {

constexpr double kWarmUp = 0.05;     // s, simulated before the first frame
constexpr double kMin = 50e-6;       // s, exposure that can be set
constexpr double kMaxJitters = 8.0;  // more than the mean delay; keeps the stamps in order
constexpr int kExposureSteps = 16;

const sim::Scenario& checked(const sim::Scenario& scenario) {
  const std::string wrong = sim::problem(scenario);
  if (!wrong.empty()) throw ConfigError("scenario: " + wrong);
  return scenario;
}

Duration to_duration(double seconds) { return Duration(std::llround(1e9 * seconds)); }

}  // namespace

SimulatorSource::SimulatorSource(const sim::Scenario& scenario, bool live, sim::LedLight* led,
                                 sim::AppliedLoad* load)
    : scenario_(checked(scenario)),
      disturbances_(scenario.disturbances, scenario.seed, scenario.camera.width_px,
                    static_cast<int>(scenario.target.tags.size())),
      desk_(load == nullptr && scenario.trajectory.motion == sim::Motion::desk
                ? std::make_unique<sim::DeskUse>(scenario)
                : nullptr),
      load_(desk_ ? desk_.get() : load),
      renderer_(scenario),
      motion_(scenario.mechanics, sim::TrajectoryPlayer(scenario.trajectory, scenario.seed),
              -renderer_.half_window() - kWarmUp,
              sim::true_period(scenario) + 4 * sim::PlatformMotion::kStep, load_),
      processor_(scenario.processing, scenario.camera.width_px, scenario.camera.height_px),
      jpeg_(scenario.camera.width_px, scenario.camera.height_px, scenario.compression.jpeg_quality),
      pixels_(static_cast<std::size_t>(scenario.camera.width_px) *
              static_cast<std::size_t>(scenario.camera.height_px)) {
  const sim::Camera& camera = scenario_.camera;
  format_.width = camera.width_px;
  format_.height = camera.height_px;
  format_.period = to_duration(1 / camera.frame_rate);
  period_ = to_duration(sim::true_period(scenario_));
  format_.description = fmt::format("simulated sensor, {}x{} at {:g} Hz, {} {}", camera.width_px,
                                    camera.height_px, camera.frame_rate, scenario_.target.family,
                                    scenario_.target.tags.size() == 1 ? "tag" : "tags");
  truth_.tags = renderer_.tags();
  truth_.visible = renderer_.visible();
  truth_.rest_position = scenario_.target.rest_position;
  renderer_.set_led(led);
  if (!live) return;
  timer_ = monotonic_timer();
  if (!timer_) {
    throw ConfigError(
        "simulated sensor: no timer from the kernel ({}): close other programs and try again",
        std::strerror(errno));
  }
  start_ = std::chrono::steady_clock::now() + period_;
  wake_at(timer_, delivery_time(next_sequence_));
}

/// The time stamp of a frame: the middle of its exposure, and what driver and cable add.
TimePoint SimulatorSource::delivery_time(std::uint64_t sequence) const noexcept {
  const TimePoint exposed = start_ + period_ * static_cast<std::int64_t>(sequence);
  const sim::Delivery& delivery = scenario_.delivery;
  if (delivery.latency <= 0) return exposed;
  sim::Random random = sim::Random::numbered(scenario_.seed, sim::kDeliveryJitter, sequence);
  const double exponential = std::min(-std::log(1 - random.uniform()), kMaxJitters);
  return exposed + to_duration(delivery.latency + delivery.jitter * (exponential - 1));
}

/// The newest frame from next_sequence_ on that was delivered by `now`; next_sequence_ itself if
/// none was.
std::uint64_t SimulatorSource::newest_delivered(TimePoint now) const noexcept {
  const auto delay = to_duration(scenario_.delivery.latency);
  const auto periods = (now - start_ - delay) / period_;
  // Jitter moves a stamp by less than a period.
  auto newest =
      std::max(next_sequence_, static_cast<std::uint64_t>(std::max<std::int64_t>(0, periods + 1)));
  while (newest > next_sequence_ && delivery_time(newest) > now) --newest;
  return newest;
}

/// The first frame has nothing before it.
bool SimulatorSource::stale(std::uint64_t sequence) const noexcept {
  if (!rendered_ || scenario_.delivery.stale_share <= 0) return false;
  sim::Random random = sim::Random::numbered(scenario_.seed, sim::kStaleFrames, sequence);
  return random.uniform() < scenario_.delivery.stale_share;
}

CameraLight::Range SimulatorSource::exposure_range_us() const noexcept {
  const double longest = sim::true_period(scenario_) - scenario_.exposure.rolling_readout;
  return {kMin * 1e6, std::max(kMin, longest) * 1e6};
}

bool SimulatorSource::set_exposure_us(double exposure_us) noexcept {
  const Range range = exposure_range_us();
  if (!std::isfinite(exposure_us)) return false;
  renderer_.set_exposure(std::clamp(exposure_us, range.least, range.most) * 1e-6,
                         renderer_.sensor_gain());
  return true;
}

bool SimulatorSource::set_gain(double gain) noexcept {
  if (!std::isfinite(gain)) return false;
  renderer_.set_exposure(renderer_.exposure(), std::clamp(gain, 1.0, kMaxGain));
  return true;
}

ReadStatus SimulatorSource::read(Frame& frame) noexcept {
  std::uint64_t sequence = next_sequence_;
  if (timer_) {
    std::uint64_t ticks = 0;
    if (::read(timer_.get(), &ticks, sizeof ticks) != sizeof ticks) return ReadStatus::nothing;
    sequence = newest_delivered(std::chrono::steady_clock::now());
    lost_ += static_cast<std::uint32_t>(sequence - next_sequence_);
  }
  bool lost = false;
  while ((lost = disturbances_.frame_lost(sequence))) {
    ++lost_;
    ++sequence;
    if (timer_) break;
  }
  next_sequence_ = lost ? sequence : sequence + 1;
  if (timer_) wake_at(timer_, delivery_time(next_sequence_));
  if (lost) return ReadStatus::nothing;
  render(sequence);

  frame.image = {pixels_.data(), format_.width, format_.height, format_.width};
  frame.decoded = {};
  frame.sequence = sequence;
  frame.dropped = std::exchange(lost_, 0);
  frame.capture_time = delivery_time(sequence);
  frame.latency_origin = timer_ ? frame.capture_time : std::chrono::steady_clock::now();
  return ReadStatus::frame;
}

void SimulatorSource::render(std::uint64_t sequence) noexcept {
  truth_.sequence = sequence;
  truth_.stale = stale(sequence);
  if (truth_.stale) return;
  truth_.time = period_ * static_cast<std::int64_t>(sequence);
  const double time = std::chrono::duration<double>(truth_.time).count();
  for (std::size_t tag = 0; load_ && tag < truth_.tags.size(); ++tag) {
    renderer_.slip_tag(tag, load_->slip(static_cast<int>(tag), time));
    truth_.tags[tag] = renderer_.tags()[tag];
  }
  motion_.advance_to(time + renderer_.half_window());
  renderer_.render(motion_, time, sequence, pixels_.data());
  rendered_ = true;
  processor_.apply(pixels_.data(), time);
  jpeg_.apply(pixels_.data());
  truth_.displacement = motion_.seen(time);
  truth_.exposed_displacement.setZero();
  for (int i = 0; i < kExposureSteps; ++i) {
    const double share = (i + 0.5) / kExposureSteps - 0.5;
    truth_.exposed_displacement +=
        motion_.seen(time + share * renderer_.exposure()) / kExposureSteps;
  }
  truth_.wrench = motion_.applied_wrench(time);
  truth_.camera_T_platform = sim::platform_pose(scenario_.target, truth_.displacement);
  truth_.disturbances = renderer_.happening().kinds;
  std::copy(renderer_.visible().begin(), renderer_.visible().end(), truth_.visible.begin());
  truth_.smear_px = renderer_.smear_px();
}

namespace sim {
namespace {

constexpr int kDefaultJpegQuality = 95;
constexpr std::array<const char*, 3> kEndings{".png", ".pgm", ".jpg"};  // in FileFormat's order

/// Room for the largest grey JPEG of this size.
std::vector<std::uint8_t> room_for_jpeg(int width, int height) {
  const unsigned long size = tjBufSize(width, height, TJSAMP_GRAY);
  if (size == static_cast<unsigned long>(-1))
    throw std::runtime_error(fmt::format("JPEG: no picture is {}x{}", width, height));
  return std::vector<std::uint8_t>(size);
}

/// Bytes of it that are the file; 0: it could not be made.
unsigned long encode_jpeg(tjhandle encoder, const std::uint8_t* pixels, int width, int height,
                          int quality, std::vector<std::uint8_t>& room) noexcept {
  unsigned char* to = room.data();
  unsigned long size = room.size();
  const int failed = tjCompress2(encoder, pixels, width, width, height, TJPF_GRAY, &to, &size,
                                 TJSAMP_GRAY, quality, TJFLAG_ACCURATEDCT | TJFLAG_NOREALLOC);
  return failed != 0 ? 0 : size;
}

/// The picture as a file of the scenario's format.
std::vector<std::uint8_t> encode_image(const ImageView& image, const Compression& compression) {
  const auto [pixels, width, height, stride] = image;
  if (compression.file == FileFormat::png) return encode_png(pixels, width, height);
  if (compression.file == FileFormat::jpeg) {
    std::vector<std::uint8_t> file = room_for_jpeg(width, height);
    const std::unique_ptr<void, int (*)(void*)> encoder(tjInitCompress(), tjDestroy);
    const int quality =
        compression.jpeg_quality > 0 ? compression.jpeg_quality : kDefaultJpegQuality;
    file.resize(encode_jpeg(encoder.get(), pixels, width, height, quality, file));
    if (file.empty())
      throw std::runtime_error(std::string("JPEG: ") + tjGetErrorStr2(encoder.get()));
    return file;
  }
  const std::string header = fmt::format("P5\n{} {}\n255\n", width, height);
  std::vector<std::uint8_t> file(header.begin(), header.end());
  file.insert(file.end(), pixels, pixels + static_cast<std::ptrdiff_t>(width) * height);
  return file;
}

namespace fs = std::filesystem;

constexpr const char* kPartial = ".partial";  // where files wait until all are there
constexpr int kMaxFrames = 1'000'000;         // names have six digits

[[noreturn]] void cannot_write(const fs::path& path, const std::string& reason) {
  throw std::runtime_error(
      fmt::format("{}: cannot be written ({}): free some space or choose another --out",
                  path.string(), reason));
}

void write_file(const fs::path& path, const void* data, std::size_t size) {
  const UniqueFd file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!file) cannot_write(path, std::strerror(errno));
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(file.get(), next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) cannot_write(path, std::strerror(errno));
    next += written;
    size -= static_cast<std::size_t>(written);
  }
}

bool is_ours(const fs::path& name) {
  if (name == "frames.csv" || name == "truth.csv" || name == "sensor.yaml" || name == kPartial)
    return true;
  const std::string stem = name.stem().string();
  const std::string ending = name.extension().string();
  return stem.size() == 6 &&
         std::ranges::all_of(stem, [](unsigned char c) { return std::isdigit(c) != 0; }) &&
         std::ranges::find(kEndings, ending) != kEndings.end();
}

// What an earlier export left in the folder. Throws if anything else is there.
std::vector<fs::path> earlier_export(const fs::path& dir) {
  std::error_code error;
  fs::create_directories(dir, error);
  if (error) {
    throw ConfigError("{}: cannot be made a folder ({}): choose another --out", dir.string(),
                      error.message());
  }
  std::vector<fs::path> found;
  bool marked = false;
  for (auto entry = fs::directory_iterator(dir, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const fs::path name = entry->path().filename();
    marked = marked || name == "truth.csv" || name == kPartial;
    if (!is_ours(name)) {
      throw ConfigError("{}: the folder already holds {}: give --out an empty or a new folder",
                        dir.string(), name.string());
    }
    found.push_back(entry->path());
  }
  if (error) {
    throw ConfigError("{}: cannot be read ({}): choose another --out", dir.string(),
                      error.message());
  }
  // Numbered pictures alone may be anybody's.
  if (!found.empty() && !marked) {
    throw ConfigError(
        "{}: the folder holds pictures that are not an earlier export: give --out an empty or a "
        "new folder",
        dir.string());
  }
  return found;
}

void write_all(const Scenario& scenario, const fs::path& partial, int frames) {
  SimulatorSource source(scenario, false);
  std::string times = "file,t_ns\n";
  std::string truths =
      "seq,t_ns,dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm\n";
  for (int i = 0; i < frames; ++i) {
    Frame frame;
    source.read(frame);
    const std::string name =
        fmt::format("{:06}{}", i, kEndings[static_cast<std::size_t>(scenario.compression.file)]);
    const auto bytes = encode_image(frame.image, scenario.compression);
    write_file(partial / name, bytes.data(), bytes.size());
    times += fmt::format("{},{}\n", name, frame.capture_time.time_since_epoch().count());
    const Truth& truth = source.truth();
    truths += fmt::format("{},{},{:.9g},{:.9g}\n", truth.sequence, truth.time.count(),
                          fmt::join(truth.displacement, ","), fmt::join(truth.wrench, ","));
  }
  const std::string sensor = sensor_yaml(scenario);
  write_file(partial / "sensor.yaml", sensor.data(), sensor.size());
  write_file(partial / "truth.csv", truths.data(), truths.size());
  write_file(partial / "frames.csv", times.data(), times.size());
}

std::string list(const double* values, int count, double scale) {
  const Eigen::VectorXd scaled = scale * Eigen::Map<const Eigen::VectorXd>(values, count);
  return fmt::format("[{:.10g}]", fmt::join(scaled, ", "));
}

}  // namespace

JpegRoundTrip::JpegRoundTrip(int width, int height, int quality)
    : width_(width),
      height_(height),
      quality_(quality),
      encoder_(quality > 0 ? tjInitCompress() : nullptr, tjDestroy),
      decoder_(quality > 0 ? tjInitDecompress() : nullptr, tjDestroy) {
  if (quality <= 0) return;
  if (!encoder_ || !decoder_) throw std::runtime_error("JPEG: out of memory");
  encoded_ = room_for_jpeg(width, height);
}

void JpegRoundTrip::apply(std::uint8_t* pixels) noexcept {
  if (quality_ <= 0) return;
  const unsigned long size =
      encode_jpeg(encoder_.get(), pixels, width_, height_, quality_, encoded_);
  // Out of memory: the picture stays as it was.
  if (size == 0) return;
  tjDecompress2(decoder_.get(), encoded_.data(), size, pixels, width_, width_, height_, TJPF_GRAY,
                TJFLAG_ACCURATEDCT);
}

std::string sensor_yaml(const Scenario& s) {
  const Camera& c = s.camera;
  const Mechanics& m = s.mechanics;
  const std::array<double, 5> distortion =
      c.told_distortion ? c.distortion : std::array<double, 5>{};
  std::string tags, centres;
  for (const TagPlacement& tag : s.target.tags) tags += fmt::format("    - {{id: {}}}\n", tag.id);
  const Eigen::Matrix<double, 4, 3, Eigen::RowMajor> places = spring_centres(m);
  for (int i = 0; i < 4; ++i)
    centres += fmt::format("      - {}\n", list(places.data() + 3 * i, 3, 1e3));
  return fmt::format(
      "# The simulated sensor as its owner knows it.\n"
      "camera:\n  width: {}\n  height: {}\n  fx: {:.10g}\n  fy: {:.10g}\n  cx: {:.10g}\n"
      "  cy: {:.10g}\n  distortion: {}\n  mirrored: {}\n"
      "target:\n  family: {}\n  tag_size_mm: {:.10g}\n  border_mm: {:.10g}\n  tags:\n{}rest:\n  "
      "frames: {}\n"
      "wrench:\n  springs:\n    centres_mm:\n{}    axial_n_per_mm: {:.10g}\n"
      "    lateral_n_per_mm: {:.10g}\n    bending_nm_per_rad: {:.10g}\n"
      "    torsion_nm_per_rad: {:.10g}\n  range_n: {}\n  range_nm: {}\n",
      c.width_px, c.height_px, c.told_focal_factor * c.fx_px, c.told_focal_factor * c.fy_px,
      c.cx_px + c.told_centre_offset_px[0], c.cy_px + c.told_centre_offset_px[1],
      list(distortion.data(), 5, 1), c.mirrored, s.target.family, s.target.tag_size * 1e3,
      s.target.border * 1e3, tags,
      std::clamp(static_cast<int>(0.8 * s.trajectory.rest_time * c.frame_rate), 1, 25), centres,
      m.axial_stiffness * 1e-3, m.lateral_stiffness * 1e-3, m.bending_stiffness,
      m.torsion_stiffness, list(m.range.data(), 3, 1), list(m.range.data() + 3, 3, 1));
}

void export_folder(const Scenario& scenario, const fs::path& dir, int frames) {
  if (frames < 1 || frames > kMaxFrames)
    throw ConfigError("--frames: must lie between 1 and {}", kMaxFrames);
  checked(scenario);
  const std::vector<fs::path> earlier = earlier_export(dir);
  const fs::path partial = dir / kPartial;
  std::error_code ignored;
  fs::remove_all(partial, ignored);
  try {
    if (!fs::create_directory(partial)) cannot_write(partial, "something is in the way");
    write_all(scenario, partial, frames);
    for (const fs::path& path : earlier)
      fs::remove_all(path == partial ? fs::path() : path, ignored);
    // truth.csv first: it marks the folder as ours should the rest fail.
    fs::rename(partial / "truth.csv", dir / "truth.csv");
    for (const auto& entry : fs::directory_iterator(partial))
      fs::rename(entry.path(), dir / entry.path().filename());
    fs::remove(partial);
  } catch (const fs::filesystem_error& error) {
    fs::remove_all(partial, ignored);
    cannot_write(dir, error.code().message());
  } catch (...) {
    fs::remove_all(partial, ignored);
    throw;
  }
}

}  // namespace sim
}  // namespace tagwrench

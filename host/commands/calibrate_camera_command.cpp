// `tagwrench calibrate camera`: pictures of a board in, measured/camera.yaml of a sensor out.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>
#include <vector>

#include "host/app/input.h"
#include "host/calibration/camera/collect.h"
#include "host/calibration/camera/fit.h"
#include "host/calibration/print/board_spec.h"
#include "host/commands/commands.h"
#include "host/commands/measuring.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/termination.h"
#include "host/sensor/measured_files.h"
#include "host/source/replay.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kViewsFromCamera = 20;
constexpr int kViewsFromFolders = 60;
constexpr Duration kSayEvery = std::chrono::seconds(2);
constexpr double kGuessedFocal = 1.25;  // of the image's width
constexpr double kMuchCutOff = 0.5;     // part of a view's corners

struct CalibrateCameraOptions {
  std::string source;                ///< SRC: a camera or a folder
  std::vector<std::string> folders;  ///< or folders, when source is empty
  std::string board;                 ///< board_spec.h
  std::string sensor;                ///< path; empty: the paper's sensor, and `out` is needed
  std::string out;                   ///< path of a new sensor.yaml; empty: `sensor`
  std::optional<int> views;
  std::optional<double> seconds;
  int events = -1;  ///< descriptor, see Events
};

/// The sensor whose camera it is, and where the result goes.
struct Record {
  std::optional<MeasuredSensor> measured;  ///< of --sensor
  std::string fresh;                       ///< path of the whole new sensor.yaml without one
  SensorConfig sensor;

  bool known() const { return measured.has_value(); }
  fs::path file() const { return known() ? measured->sensor() : fs::path(fresh); }
};

CameraFile camera_file(const fs::path& sensor, const CameraFit& fit) {
  CameraFile file{fit.camera, fit.camera.mirrored, fit.used, fit.rms_px, stamp_for(sensor)};
  if (!fit.camera.mirrored) return file;
  file.camera.cx_px = fit.camera.width_px - 1 - fit.camera.cx_px;
  file.camera.distortion[3] = -fit.camera.distortion[3];
  return file;
}

Record open_record(const CalibrateCameraOptions& options) {
  Record record;
  if (!options.sensor.empty()) {
    record.measured.emplace(options.sensor, options.out, std::vector<const char*>{kMeasuredCamera});
    record.sensor = load_sensor(options.sensor, WrenchCalibration::without_camera);
    return record;
  }
  record.fresh = options.out;
  if (record.fresh.empty()) {
    throw ConfigError(
        "calibrate camera: no sensor to write for; name its sensor.yaml with --sensor, or a new "
        "one with --out");
  }
  record.sensor = parse_sensor(paper_sensor_yaml(), "the built-in sensor");
  std::error_code error;
  if (fs::is_regular_file(record.fresh, error)) {
    throw ConfigError(
        "{}: is there already, and --out makes a whole new sensor.yaml; measure the camera for it "
        "with --sensor {}, or name a new file",
        record.fresh, record.fresh);
  }
  check_replaceable(record.fresh);
  const fs::path folder = measured_folder(record.fresh);
  if (fs::exists(folder, error)) {
    throw ConfigError(
        "--out {}: the folder {} is that of another sensor; name a file in another folder",
        record.fresh, folder.string());
  }
  return record;
}

void write(const Record& record, const CameraFit& fit) {
  if (record.known())
    record.measured->make({});
  else
    write_atomically(record.fresh, paper_sensor_yaml(fit.camera));
  const fs::path file = record.file();
  write_measured(measured_folder(file) / kMeasuredCamera,
                 camera_yaml(camera_file(file, fit), file.stem().string()));
}

/// The camera as known so far, for frames of this size.
CameraModel camera_for(const Record& record, const SourceFormat& format) {
  CameraModel camera = record.sensor.camera;
  if (record.known()) {
    if (camera.width_px == format.width && camera.height_px == format.height) return camera;
    throw ConfigError(
        "{}: frames are {}x{}, but sensor.yaml's camera is {}x{}; ask the camera for that size, or "
        "set width and height in sensor.yaml",
        format.description, format.width, format.height, camera.width_px, camera.height_px);
  }
  camera = {};
  camera.width_px = format.width;
  camera.height_px = format.height;
  camera.fx_px = camera.fy_px = kGuessedFocal * format.width;
  return camera;
}

/// Every picture of the folders; nothing if stopped by a signal.
std::unique_ptr<ViewCollector> look_at_folders(const CalibrateCameraOptions& options,
                                               const std::vector<std::string>& folders,
                                               const BoardSpec& board, const Record& record) {
  std::vector<std::unique_ptr<ImagesSource>> sources;
  std::size_t all = 0;
  for (const std::string& folder : folders) {
    sources.push_back(std::make_unique<ImagesSource>(folder, true, OddPictures::set_aside));
    all += sources.back()->count();
    const SourceFormat& first = sources.front()->format();
    const SourceFormat& format = sources.back()->format();
    if (format.width != first.width || format.height != first.height) {
      throw ConfigError(
          "{}: its pictures are {}x{}, those of {} are {}x{}; give pictures of one camera and size",
          folder, format.width, format.height, folders.front(), first.width, first.height);
    }
  }
  auto collector =
      std::make_unique<ViewCollector>(board, camera_for(record, sources.front()->format()), false);
  // Names are enough within one folder.
  const auto called = [&](const std::string& path) {
    return folders.size() > 1 ? path : fs::path(path).filename().string();
  };
  std::size_t seen = 0;
  TimePoint said = Clock::now();
  for (const auto& source : sources) {
    for (std::uint64_t index = 0;; ++index) {
      if (termination_requested()) return nullptr;
      Frame frame;
      const ReadStatus status = source->read(frame);
      if (status == ReadStatus::end) break;
      ++seen;
      const std::string name = called(source->path_of(index));
      if (status == ReadStatus::frame)
        collector->look(frame.image, name);
      else
        collector->set_aside({name, Fate::unreadable, {}});
      if (Clock::now() - said < kSayEvery) continue;
      said = Clock::now();
      log_info("{} of {} pictures, {} views", seen, all, collector->views().size());
    }
    for (const OddPicture& odd : source->set_aside()) {
      if (odd.size) {
        collector->set_aside({called(odd.path), Fate::other_size,
                              fmt::format("{}x{}", odd.size->width, odd.size->height)});
      } else {
        collector->set_aside({called(odd.path), Fate::unreadable, {}});
      }
    }
  }
  log_info("{} pictures, {} different views of the board", seen, collector->views().size());
  collector->thin_out(options.views.value_or(kViewsFromFolders));
  return collector;
}

/// Says what to do next, once per change.
class Guide {
 public:
  void say(ViewResult taken, const ViewCollector& collector, int wanted) {
    if (taken == ViewResult::yes) {
      const std::size_t count = collector.views().size();
      const std::vector<std::string> missing = collector.coverage().missing();
      std::string line = fmt::format("view {} of {} taken", count, wanted);
      const std::string need = listed(missing);
      if (need != need_) line += need.empty() ? "; nothing is missing" : "; still wanted: " + need;
      need_ = need;
      complete_ = missing.empty() && static_cast<int>(count) >= wanted;
      log_info(line);
    }
    const std::string diagnostic = diagnostic_for(taken, collector.last_look());
    frames_ = diagnostic == diagnostic_ ? frames_ + 1 : 1;
    diagnostic_ = diagnostic;
    if (frames_ == kFramesBeforeDiagnostic && !diagnostic.empty() && diagnostic != said_) {
      log_info(diagnostic);
      said_ = diagnostic;
    }
    if (taken == ViewResult::yes) said_.clear();
  }
  bool complete() const { return complete_; }

 private:
  static constexpr int kFramesBeforeDiagnostic = 15;

  static std::string diagnostic_for(ViewResult taken, BoardView look) {
    if (taken == ViewResult::moving) return "hold the board still for a moment";
    if (taken == ViewResult::alike) return "seen from here already: move or tilt the board";
    if (taken == ViewResult::no) return fmt::format("the picture is {}", words(look));
    return {};
  }

  std::string need_;
  std::string diagnostic_;
  std::string said_;
  int frames_ = 0;
  bool complete_ = false;
};

/// In how many views each of the 3 x 3 regions of the image holds corners, in reading order.
std::vector<int> views_of_regions(const ViewCollector& collector) {
  std::vector<int> counts(9);
  const CameraModel& camera = collector.camera();
  for (const CameraView& view : collector.views()) {
    std::array<bool, 9> here{};
    for (const BoardCorner& corner : view.corners) {
      const double x = corner.pixel.x() * 3 / camera.width_px;
      const double y = corner.pixel.y() * 3 / camera.height_px;
      const auto column = static_cast<std::size_t>(std::clamp(x, 0.0, 2.0));
      here[3 * static_cast<std::size_t>(std::clamp(y, 0.0, 2.0)) + column] = true;
    }
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += here[i] ? 1 : 0;
  }
  return counts;
}

/// Where the board is in the image as the camera delivers it.
std::vector<TagCorners> outline_of_board(const ViewCollector& collector, int width) {
  if (collector.last_look() != BoardView::board) return {};
  std::vector<std::array<double, 2>> px;
  for (const BoardCorner& corner : collector.last_corners()) {
    const double x = corner.pixel.x();
    px.push_back({collector.mirrored() ? width - 1 - x : x, corner.pixel.y()});
  }
  return outline_of(px);
}

void tell_events(Events& events, const ViewCollector& collector, int wanted, const Frame& frame,
                 bool taken) {
  if (!events.on()) return;
  const std::size_t views = collector.views().size();
  if (taken || views == 0) {
    events.coverage({{"regions", views_of_regions(collector)},
                     {"views", views},
                     {"wanted", wanted},
                     {"missing", collector.coverage().missing()}});
    events.progress(static_cast<double>(views) / std::max(1, wanted));
  }
  events.picture(frame.image, outline_of_board(collector, frame.image.width));
  events.live(fmt::format(
      "{} of {} views; the board is {}", views, wanted,
      collector.last_look() == BoardView::board ? "seen" : words(collector.last_look())));
}

/// Until the views are complete, time is up, or a signal comes: then nothing.
std::unique_ptr<ViewCollector> look_at_camera(const CalibrateCameraOptions& options,
                                              const BoardSpec& board, const Record& record,
                                              const UniqueFd& stop) {
  const Input input =
      open_input({options.sensor, options.source, false, WrenchCalibration::without_camera});
  FrameSource& source = *input.source;
  log_info("source: " + source.format().description);
  log_info(
      "show the board: whole and sharp, in every part of the picture, tilted each way; Ctrl-C "
      "gives up");
  const int wanted = options.views.value_or(kViewsFromCamera);
  auto collector =
      std::make_unique<ViewCollector>(board, camera_for(record, source.format()), true);
  Guide guide;
  Events events(options.events);
  const TimePoint end = options.seconds
                            ? Clock::now() + std::chrono::duration_cast<Duration>(
                                                 std::chrono::duration<double>(*options.seconds))
                            : TimePoint::max();
  while (!guide.complete() && static_cast<int>(collector->views().size()) < kMaxCameraViews &&
         Clock::now() < end) {
    Frame frame;
    const Next next = next_frame(source, stop, frame);
    if (next == Next::stopped) return nullptr;
    if (next == Next::end) break;
    if (next != Next::frame) continue;
    const std::string name = fmt::format("view {}", collector->views().size() + 1);
    const ViewResult taken = collector->look(frame.image, name);
    guide.say(taken, *collector, wanted);
    tell_events(events, *collector, wanted, frame, taken == ViewResult::yes);
  }
  check_whole(source, record::IfDamaged::refuse);
  return collector;
}

/// What else was measured through the old camera.
std::string stale(const Record& record) {
  std::vector<std::string> parts;
  const SensorConfig& sensor = record.sensor;
  const auto placed = [](const Tag& tag) { return tag.platform_T_tag.has_value(); };
  if (std::any_of(sensor.target.tags.begin(), sensor.target.tags.end(), placed))
    parts.emplace_back("the tags' places in sensor.yaml");
  if (sensor.rest.camera_T_platform) parts.emplace_back("its rest pose");
  const fs::path target = measured_folder(record.file()) / kMeasuredTarget;
  std::error_code error;
  if (fs::exists(target, error)) parts.push_back(target.string());
  return listed(parts);
}

/// "1.2 px in the middle of the picture, 8.1 px at its top right, where the board never was".
std::string reach(const CameraFit& fit, const Coverage& coverage) {
  const auto& px = fit.uncertainty.regions_px;
  const auto worst = static_cast<std::size_t>(std::max_element(px.begin(), px.end()) - px.begin());
  const std::string name = kRegionNames[worst];
  const std::vector<std::string> missing = coverage.missing_regions();
  const bool never = std::find(missing.begin(), missing.end(), name) != missing.end();
  return fmt::format("{:.2g} px in the middle of the picture, {:.2g} px at its {}{}", px[4],
                     px[worst], name, never ? ", where the board never was" : "");
}

/// What became of every picture, and what of it the fit knows, if there is one.
void tell_pictures(Pictures pictures, const std::vector<CameraView>& views, const CameraFit* fit,
                   Events& events) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::string detail = fit == nullptr ? "" : fmt::format("{:.2f} px", fit->views[i].rms_px);
    if (views[i].look.clipped_fraction > kMuchCutOff)
      detail += detail.empty() ? "white cut off" : ", white cut off";
    const bool used = fit != nullptr && fit->views[i].used;
    pictures.became(views[i].name,
                    fit == nullptr ? Fate::view
                    : used         ? Fate::used
                                   : Fate::contradicts,
                    detail);
  }
  for (const std::string& line : pictures.lines()) {
    log_info(line);
    events.line("note", line);
  }
}

void report(const CameraFit& fit, const Coverage& coverage, const Record& record) {
  const CameraModel& now = fit.camera;
  const CameraModel& old = record.sensor.camera;
  const auto& s = fit.uncertainty.sigma;
  log_info("fx {:.2f} +- {:.2f}, fy {:.2f} +- {:.2f}, cx {:.2f} +- {:.2f}, cy {:.2f} +- {:.2f} px",
           now.fx_px, s[0], now.fy_px, s[1], now.cx_px, s[2], now.cy_px, s[3]);
  const auto& [k1, k2, p1, p2, k3] = now.distortion;
  log_info(
      "distortion k1 {:.4f} +- {:.4f}, k2 {:.4f} +- {:.4f}, p1 {:.5f} +- {:.5f}, p2 {:.5f} +- "
      "{:.5f}, k3 {:.4f}{}",
      k1, s[4], k2, s[5], p1, s[6], p2, s[7], k3,
      k3 == 0 ? " (fixed: it does not help)" : fmt::format(" +- {:.4f}", s[8]));
  log_info(
      "reprojection error {:.3f} px RMS over {} views, {} dropped; corners in {} of 9 regions, "
      "tilts to {:.0f} degrees; the board is bowed by {:.1f} % of half its length",
      fit.rms_px, fit.used, fit.views.size() - static_cast<std::size_t>(fit.used),
      coverage.regions(), coverage.largest_tilt() * 57.29578, 100 * fit.bow);
  log_info("a direction is known to {}", reach(fit, coverage));
  if (!fit.uncertainty.views_agree()) {
    log_info(
        "the views contradict each other by {:.1f} times their corners' noise, and count for less; "
        "better: a flat, stiff board held still, and a locked focus",
        std::sqrt(fit.uncertainty.contradiction));
  }
  if (const std::vector<std::string> missing = coverage.missing(); !missing.empty())
    log_info("it would be better still with " + listed(missing));
  if (!record.known()) return;
  log_info("before: fx {:.2f} ({:+.2f} %), fy {:.2f} ({:+.2f} %), cx {:.2f}, cy {:.2f} px",
           old.fx_px, 100 * (now.fx_px / old.fx_px - 1), old.fy_px,
           100 * (now.fy_px / old.fy_px - 1), old.cx_px, old.cy_px);
  if (const std::string parts = stale(record); !parts.empty())
    log_info("of the camera before: {}; run `tagwrench calibrate target`", parts);
}

std::unique_ptr<ViewCollector> collect(const CalibrateCameraOptions& options,
                                       const BoardSpec& board, const Record& record,
                                       const UniqueFd& stop) {
  if (!options.folders.empty()) return look_at_folders(options, options.folders, board, record);
  if (options.source.empty())
    throw ConfigError(
        "calibrate camera: nothing to look at; give --source v4l2:/dev/videoN or --images DIR");
  const SourceSpec spec = parse_source(options.source);
  if (spec.is(SourceKind::simulator)) {
    throw ConfigError(
        "--source sim: the simulated sensor has no board to show; use v4l2:/dev/videoN or "
        "images:DIR");
  }
  if (spec.is(SourceKind::images)) return look_at_folders(options, {spec.argument}, board, record);
  return look_at_camera(options, board, record, stop);
}

/// Throws ConfigError if it cannot start or the views are too poor; then nothing has been written.
int calibrate_camera(const CalibrateCameraOptions& options) {
  const BoardSpec board = parse_board(options.board);
  const Record record = open_record(options);
  const UniqueFd stop = termination_fd();
  std::unique_ptr<ViewCollector> collector = collect(options, board, record, stop);
  if (!collector) return stopped_unwritten();
  Events events(options.events);
  const std::vector<CameraView>& views = collector->views();
  const int width = collector->camera().width_px;
  const int height = collector->camera().height_px;
  Coverage coverage(width, height);
  std::optional<CameraFit> fit;
  try {
    collector->check();
    fit = fit_camera(views, width, height);
    for (std::size_t i = 0; i < views.size(); ++i)
      if (fit->views[i].used) coverage.add(views[i].corners, fit->views[i].pose);
    check_fit(*fit, coverage);
  } catch (const ConfigError&) {
    tell_pictures(collector->pictures(), views, fit ? &*fit : nullptr, events);
    throw;
  }
  tell_pictures(collector->pictures(), views, &*fit, events);
  fit->camera.mirrored = collector->mirrored();
  if (collector->mirrored() != record.sensor.camera.mirrored) {
    log_info("the camera's image is {}: writing mirrored: {}",
             collector->mirrored() ? "mirrored" : "not mirrored", collector->mirrored());
  }
  if (termination_requested()) return stopped_unwritten();
  write(record, *fit);
  report(*fit, coverage, record);
  const fs::path folder = measured_folder(record.file());
  log_info("written: {}{}", record.known() ? "" : record.fresh + " and ",
           (folder / kMeasuredCamera).string());
  if (!record.sensor.calibration.empty() || is_measured(folder, kMeasuredWrench))
    log_info(
        "the calibration in newtons was made with the lens as it was described; run `tagwrench "
        "calibrate wrench` again");
  return 0;
}

}  // namespace

void calibrate_camera_command(command_line::Command family) {
  const auto o = std::make_shared<CalibrateCameraOptions>();
  auto verb = family.add_subcommand(
      "camera", "the lens, from a printed board shown to the camera (tagwrench tags --board)");
  auto source = verb.add_option("--source", o->source,
                                "the camera: v4l2:/dev/videoN[,WxH[@FPS][,FOURCC]]; or images:DIR");
  auto images = verb.add_option("--images", o->folders, "folders of pictures of the board");
  source.excludes(images);
  verb.add_option("--board", o->board,
                  "charuco:COLUMNSxROWS:SQUAREmm:MARKERmm:DICTIONARY or "
                  "checkerboard:COLUMNSxROWS:SQUAREmm, counted in squares")
      .required();
  verb.add_option("--sensor", o->sensor, "sensor.yaml whose camera this is");
  verb.add_option("--out", o->out,
                  "a new sensor.yaml to make; what is found goes into measured/ beside it, without "
                  "--out beside --sensor");
  verb.add_option("--views", o->views,
                  "views of the board to use: as many at least from a camera, at most from folders")
      .check(command_line::range(kMinCameraViews, kMaxCameraViews));
  verb.add_option("--seconds", o->seconds,
                  "look at a camera no longer than this, then use what there is")
      .check(calibration_seconds());
  add_events_option(verb, o->events);
  verb.runs([o] { return calibrate_camera(*o); });
}

}  // namespace tagwrench

// `tagwrench doctor`: what works here; with --focus how sharp the tags are as the lens is turned.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <system_error>
#include <vector>

#include "host/app/input.h"
#include "host/calibration/check/in_situ.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/core/os/user_folders.h"
#include "host/output/line_outputs.h"
#include "host/sensor/sensor_config.h"
#include "host/source/v4l2_device.h"
#include "host/tools/doctor/doctor.h"
#include "host/tracker/acquire.h"
#include "host/tracker/picture_quality.h"

namespace tagwrench {
namespace {

struct DoctorOptions {
  bool focus = false;
  std::string sensor;  ///< sensor.yaml; empty: what the source suggests
  std::string source;  ///< SRC; empty: the only camera
  std::optional<double> seconds;
};

constexpr int kSeen = 0, kNeverSeen = 1;
constexpr Duration kDrawEvery = std::chrono::milliseconds(150);
constexpr Duration kSayEvery = std::chrono::seconds(1);
constexpr double kMuchWhite = 0.10;  // of a tag
constexpr double kFaint = 40;        // grey levels from ink to paper
constexpr double kMuchSharpening = 0.3;

bool at_floor(double blur_px) { return blur_px < 1.1 * kLeastBlur_px; }

std::string only_camera() {
  std::vector<std::string> cameras;
  for (const CameraNode& node : list_camera_nodes())
    if (node.captures) cameras.push_back(node.path);
  if (cameras.empty()) {
    throw ConfigError(
        "--source: no camera that can be used; plug one in, or use --source sim (the simulated "
        "sensor)");
  }
  if (cameras.size() > 1) throw ConfigError("--source: choose a camera: " + capture_nodes_text());
  return "v4l2:" + cameras.front();
}

/// The tags in one frame after the other.
class FocusView {
 public:
  explicit FocusView(const SensorConfig& sensor)
      : camera_(sensor.camera), target_(sensor.target), tags_(sensor.target.tags.size()) {}

  /// Whether any tag could be measured.
  bool look(const Frame& frame) {
    const ImageView& image = frame.image;
    if (!acquirer_ || image.width != camera_.width_px || image.height != camera_.height_px)
      fit_camera(image);
    Finding finding = acquirer_->find(image);
    if (finding.other_way_round) {
      camera_.mirrored = !camera_.mirrored;
      fit_camera(image);
      finding = acquirer_->find(image);
    }
    other_ids_ = finding.other_ids;
    for (FoundTag& tag : finding.tags) {
      if (camera_.mirrored)
        for (Eigen::Vector2d& corner : tag.corners_px) corner.x() = image.width - 1 - corner.x();
      tags_[tag.index].corners_px = tag.corners_px;
    }
    measure(image, frame.capture_time);
    return seen_ != 0;
  }

  /// One line for each tag, and one that says what to do.
  std::vector<std::string> text() const {
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < tags_.size(); ++i)
      lines.push_back(fmt::format("tag {:<4} {}", target_.tags[i].id, tag_text(tags_[i])));
    lines.push_back(advice());
    return lines;
  }

 private:
  struct Tag {
    std::optional<Square> corners_px;  ///< where it was last
    std::optional<EdgeWidth> width;
    double best_px = 0;
  };

  /// No calibration is needed: only the image's size must be right.
  void fit_camera(const ImageView& image) {
    camera_.fx_px *= static_cast<double>(image.width) / camera_.width_px;
    camera_.fy_px = camera_.fx_px;
    camera_.width_px = image.width;
    camera_.height_px = image.height;
    camera_.cx_px = 0.5 * (image.width - 1);
    camera_.cy_px = 0.5 * (image.height - 1);
    camera_.distortion = {};
    acquirer_.emplace(camera_, target_);
  }

  /// Also of tags too blurred to be read, where they were last.
  void measure(const ImageView& image, TimePoint time) {
    seen_ = 0;
    double sum_px = 0;
    int count = 0;
    for (std::size_t i = 0; i < tags_.size(); ++i) {
      Tag& tag = tags_[i];
      tag.width.reset();
      if (!tag.corners_px) continue;
      tag.width = edge_width(image, acquirer_->patterns()[i], *tag.corners_px);
      if (!tag.width) {
        tag.corners_px.reset();
        continue;
      }
      tag.corners_px = tag.width->corners_px;
      const double blur_px = tag.width->blur_px;
      tag.best_px = tag.best_px > 0 ? std::min(tag.best_px, blur_px) : blur_px;
      sum_px += blur_px;
      ++count;
      seen_ |= 1U << i;
    }
    quality_.reset();
    if (count > 0)
      guide_.add(time, sum_px / count, seen_);
    else
      quality_ = picture_quality(image);
  }

  static std::string tag_text(const Tag& tag) {
    if (!tag.width) return "not seen";
    const EdgeWidth& w = *tag.width;
    std::string text =
        at_floor(w.blur_px)
            ? fmt::format("edges {:.1f} px wide or less, the least that can be measured",
                          kLeastBlur_px)
            : fmt::format("edges {:5.2f} px wide, best {:5.2f}", w.blur_px, tag.best_px);
    text += fmt::format("   contrast {:3.0f}", w.contrast);
    if (w.contrast < kFaint) text += ": more light";
    if (w.white_fraction >= 0.005)
      text += fmt::format("   cut off {:.0f} %", 100 * w.white_fraction);
    if (w.white_fraction > kMuchWhite) text += ": less light";
    if (w.sharpening > kMuchSharpening) text += "   sharpened by the camera";
    return text;
  }

  std::string advice() const {
    if (seen_ == 0) return blind_advice();
    const double now = guide_.now_px(), best = guide_.best_px();
    if (at_floor(now)) return "as sharp as can be measured: leave it, and lock the lens";
    const auto away = [&](const char* words) {
      return fmt::format("{}: best was {:.1f} px, now {:.1f}, which is {:.0f} % more noise", words,
                         best, now, 100 * guide_.more_noise());
    };
    switch (guide_.turn()) {
      case FocusTurn::begin: return "turn the lens slowly, one way";
      case FocusTurn::sharper: return "sharper: turn on";
      case FocusTurn::blurrier: return away("less sharp: turn back");
      case FocusTurn::away: return away("it was sharper");
      case FocusTurn::try_on:
        return fmt::format(
            "the sharpest so far, {:.1f} px: turn on, either way, until it gets worse", now);
      case FocusTurn::best:
        return fmt::format("this is the best, {:.1f} px: leave it, and lock the lens", now);
    }
    return {};
  }

  std::string blind_advice() const {
    if (!other_ids_.empty())
      return fmt::format("a tag is seen, but with id {}: give the --sensor of these tags",
                         other_ids_.front());
    const PictureQuality& q = *quality_;
    if (q.bright_counts < kFaint) return "the image is black: lens cap, light";
    if (!q.blur_px)
      return "no edges at all: turn the lens, a turn or more, until tags begin to show";
    return fmt::format(
        "tags cannot be read; the sharpest edges of the image are about {:.0f} px wide: turn the "
        "lens the way this gets less",
        *q.blur_px);
  }

  CameraModel camera_;
  TargetDescription target_;
  std::optional<Acquirer> acquirer_;
  std::vector<Tag> tags_;
  std::vector<int> other_ids_;
  unsigned seen_ = 0;  ///< one bit each
  FocusGuide guide_;
  std::optional<PictureQuality> quality_;  ///< where no tag is seen
};

/// Standard output: lines over lines on a terminal, else one line a second.
class FocusScreen {
 public:
  FocusScreen() {
    const char* term = std::getenv("TERM");
    live_ = ::isatty(STDOUT_FILENO) == 1 && term != nullptr && std::strcmp(term, "dumb") != 0;
  }

  bool due(TimePoint now) const { return now >= next_; }

  /// False: it could not be written, and never will be. A reader that is slow loses some.
  bool show(const std::vector<std::string>& lines, TimePoint now) {
    std::string out;
    if (live_) {
      if (shown_) out += fmt::format("\x1b[{}A", lines.size());
      for (const std::string& line : lines)
        out += fmt::format("\r{}\x1b[K\n", line.substr(0, columns() - 1));
    } else {
      for (const std::string& line : lines) out += (out.empty() ? "" : "; ") + line;
      out += '\n';
    }
    shown_ = true;
    next_ = now + (live_ ? kDrawEvery : kSayEvery);
    return sink_.write(out) != SendStatus::failed;
  }
  std::string failure() const { return sink_.failure(); }

 private:
  static std::size_t columns() {
    winsize size{};
    const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
    return known ? size.ws_col : 80;
  }

  TextSink sink_{"-", /*lossless=*/false};
  bool live_ = false;
  bool shown_ = false;
  TimePoint next_ = TimePoint::min();
};

/// Says on standard output, live on a terminal and once a second elsewhere, how wide the edges of
/// each tag are and which way it goes, until a signal, the source's end or the time. Returns 0 if
/// the tags were seen, else 1. Throws ConfigError for a source or sensor that cannot be used.
int run_focus(const DoctorOptions& options) {
  using Clock = std::chrono::steady_clock;
  const std::string source = options.source.empty() ? only_camera() : options.source;
  const UniqueFd stop = termination_fd();
  Input input = open_input({options.sensor, source, false, WrenchCalibration::without_target});
  log_info("source: " + input.source->format().description);
  FocusView view(input.sensor);
  FocusScreen screen;
  bool ever_seen = false;
  bool looked = false;
  const TimePoint begin = Clock::now();
  while (!options.seconds ||
         std::chrono::duration<double>(Clock::now() - begin).count() < *options.seconds) {
    Frame frame;
    const Next next = next_frame(*input.source, stop, frame);
    if (next == Next::stopped || next == Next::end) break;
    if (next != Next::frame) continue;
    looked = true;
    if (view.look(frame)) ever_seen = true;
    if (!screen.due(frame.capture_time)) continue;
    if (!screen.show(view.text(), frame.capture_time)) {
      log_info(screen.failure());
      return kNeverSeen;
    }
  }
  if (ever_seen || !looked) return kSeen;
  log_info("the tags were never seen");
  return kNeverSeen;
}

/// What is in force for this sensor.yaml, or else for the one that `run` takes by itself.
void say_sensor(std::string file) {
  const std::string folder = config_folder();
  std::error_code error;
  if (file.empty() && !folder.empty() && std::filesystem::exists(folder + "/sensor.yaml", error))
    file = folder + "/sensor.yaml";
  if (file.empty()) return;
  Report report(std::cout);
  try {
    const SensorConfig sensor = load_sensor(file);
    report.line(Mark::ok, "sensor " + file);
    for (const std::string& line : in_force(sensor)) report.line(Mark::ok, line);
  } catch (const ConfigError& e) {
    report.line(Mark::missing, e.what());
  }
}

int examine(const DoctorOptions& o) {
  const int status = run_doctor(std::cout);
  say_sensor(o.sensor);
  if (!std::cout.flush())
    throw std::runtime_error("standard output: cannot be written; redirect it somewhere");
  return status;
}

}  // namespace

void doctor_command(command_line::Command program) {
  const auto o = std::make_shared<DoctorOptions>();
  auto verb = program.add_subcommand(
      "doctor", "say line by line what works here and what to do about the rest");
  auto focus = verb.add_flag("--focus", o->focus,
                             "instead, how sharp the tags are, live, while you turn the lens");
  verb.add_option("--source", o->source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}) +
                      "; without it the only camera")
      .needs(focus);
  verb.add_option("--sensor", o->sensor,
                  "sensor.yaml, to say what is in force for it; without it the one of the "
                  "configuration folder. With --focus for its tags: nothing need be calibrated");
  verb.add_option("--seconds", o->seconds, "end after S seconds")
      .check(command_line::seconds())
      .needs(focus);
  verb.runs([o] { return o->focus ? run_focus(*o) : examine(*o); });
}

}  // namespace tagwrench

// `tagwrench export`: what a recording holds, in files for other programs.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "host/app/input.h"
#include "host/app/recording.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/printable.h"
#include "host/output/line_outputs.h"
#include "host/recording/reader.h"
#include "host/source/replay.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  std::string recording;
  std::string csv;
  std::string paper;
  std::string frames;
  std::string references;
  std::string events;
  bool force = false;
  bool despite_damage = false;
};

/// A text file that appears when it is complete, or standard output (`-`).
class ExportFile {
 public:
  /// Throws ConfigError: it exists and is not to be replaced, or cannot be written.
  ExportFile(const std::string& path, bool force) : path_(path), force_(force) {
    if (path == "-") return;
    std::error_code error;
    if (!force && fs::exists(fs::symlink_status(path, error)))
      throw ConfigError("{}: exists; choose another name, or replace it with --force", path);
    file_.emplace(path);
  }

  /// Throws std::runtime_error: the disk is full.
  void add(std::string_view text) {
    waiting_ += text;
    if (waiting_.size() >= kPiece) flush();
  }
  /// Throws as add().
  void finish() {
    flush();
    if (file_)
      file_->take_the_name(force_ ? NewFile::Existing::replaced : NewFile::Existing::refused);
    if (!file_ && !std::cout.flush())
      throw std::runtime_error("standard output: cannot be written; free some space on the disk");
  }

 private:
  static constexpr std::size_t kPiece = 64 * 1024;

  void flush() {
    if (file_)
      file_->write(waiting_);
    else
      std::cout << waiting_;
    waiting_.clear();
  }

  std::string path_;
  bool force_;
  std::optional<NewFile> file_;
  std::string waiting_;
};

std::int64_t ns(TimePoint time) { return time.time_since_epoch().count(); }

/// The next record; false after the last, and at the first that is damaged, which is said. It was
/// asked for then: export_all() refuses a damaged recording.
template <class Record>
bool next_whole(record::RecordingReader& reader, Record& record) {
  try {
    return reader.next(record);
  } catch (const DamagedFile& e) {
    log_info("{}; what stands before that is exported", e.what());
    return false;
  }
}

/// All records of a type, a line each. What the file holds now is told, but of standard output.
template <class Record, class Line>
void export_rows(const ExportOptions& o, const std::string& path, std::string_view header,
                 std::string_view one, const Line& line) {
  if (path.empty()) return;
  record::RecordingReader reader(o.recording, record::IfDamaged::take);
  ExportFile file(path, o.force);
  file.add(header);
  std::uint64_t count = 0;
  for (Record record; next_whole(reader, record); ++count) file.add(line(record));
  file.finish();
  if (path != "-") log_info("{} in {}", count_text(count, one), path);
}

/// NaN is an empty field.
std::string field(double value) {
  return std::isnan(value) ? std::string(",") : fmt::format(",{}", value);
}

std::string reference_header() {
  std::string header = "t_ns,sigma_ns,channel,axes,saturated,lost_before";
  for (const char* what : {"counts", "value", "sigma"})
    for (int i = 0; i < 6; ++i) header += fmt::format(",{}_{}", what, i);
  return header + "\n";
}

std::string reference_line(const record::ReferenceRecord& r) {
  std::string line = fmt::format("{},{},{},{},{},{}", ns(r.time), r.time_sigma.count(), r.channel,
                                 r.axes, r.saturated ? 1 : 0, r.lost_before);
  for (const auto* six : {&r.counts, &r.value, &r.sigma})
    for (const double value : *six) line += field(value);
  return line + "\n";
}

/// RFC 4180.
std::string in_quotes(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string event_line(const record::EventRecord& e) {
  return fmt::format("{},{},{},{},{},{}\n", e.id, ns(e.time), name(e.kind),
                     e.step < 0 ? std::string() : std::to_string(e.step), e.value,
                     e.text.empty() ? std::string() : in_quotes(printable(e.text)));
}

// A recording as the program of Ouyang and Howe (ICRA 2020) would have written it, so that whoever
// has scripts for its files can use them.
//
// Fields are separated by "; ", the first is text. Tags: time (s), position of tag 1 and tag 2 (m),
// Euler angles of tag 1 and tag 2 (deg, about x, y, z), mean position, mean angles, weight.
// Positions and angles count from the first row; then 0.05 m is taken off the positions, and the
// angles are smoothed exponentially with that weight. Reference: time (s), Fx Fy Fz Mx My Mz in raw
// counts.
constexpr double kWeight = 0.2;
constexpr double kOffset = 0.05;  // m
/// Of the paper's OptoForce: counts per N and per N m.
constexpr std::array<double, 6> kCountsPerUnit = {96.11, 95.64, 20.92, 5425.36, 5524.60, 8103.25};
constexpr double kDegree = 180 / std::numbers::pi;

using Vector3 = std::array<double, 3>;

struct TagPose {
  Vector3 position{};  ///< in the camera's frame, m
  Vector3 angles{};    ///< R = Rz Ry Rx, deg
};

struct Lens {
  cv::Mat matrix;
  cv::Mat distortion;
};

Lens lens_of(const CameraModel& camera) {
  Lens lens;
  lens.matrix = (cv::Mat_<double>(3, 3) << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px,
                 camera.cy_px, 0, 0, 1);
  lens.distortion = cv::Mat(1, 5, CV_64F);
  for (int i = 0; i < 5; ++i)
    lens.distortion.at<double>(i) = camera.distortion[static_cast<std::size_t>(i)];
  return lens;
}

Vector3 euler_deg(const cv::Mat& rotation) {
  const auto r = [&rotation](int row, int column) { return rotation.at<double>(row, column); };
  return {std::atan2(r(2, 1), r(2, 2)) * kDegree,
          std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0))) * kDegree,
          std::atan2(r(1, 0), r(0, 0)) * kDegree};
}

/// Each tag by itself, as that program had it.
std::optional<TagPose> pose_of(const TagCorners& corners, const SensorConfig& sensor,
                               const Lens& lens) {
  const double h = 0.5 * sensor.target.tag_size;
  const std::vector<cv::Point3d> square = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  std::vector<cv::Point2d> pixels;
  for (std::size_t c = 0; c < 4; ++c) {
    const double x = corners.px[2 * c];
    pixels.emplace_back(sensor.camera.mirrored ? sensor.camera.width_px - 1 - x : x,
                        corners.px[2 * c + 1]);
    if (!std::isfinite(x) || !std::isfinite(corners.px[2 * c + 1])) return std::nullopt;
  }
  cv::Mat turn;
  cv::Mat position;
  if (!cv::solvePnP(square, pixels, lens.matrix, lens.distortion, turn, position, false,
                    cv::SOLVEPNP_IPPE_SQUARE))
    return std::nullopt;
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  return TagPose{{position.at<double>(0), position.at<double>(1), position.at<double>(2)},
                 euler_deg(rotation)};
}

double seconds(TimePoint time, TimePoint start) {
  return std::chrono::duration<double>(time - start).count();
}

/// Angles that jump from 180 to -180 have not.
double angle_between(double from, double to) { return std::remainder(to - from, 360.0); }

std::size_t export_tags(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording, record::IfDamaged::take);
  const SensorConfig sensor = recorded_sensor(reader.head(), recording, WrenchCalibration::ignore);
  if (sensor.target.tags.size() != 2) {
    throw ConfigError(
        "{}: the paper's columns are those of two tags, and this sensor has {}; use --csv",
        recording, sensor.target.tags.size());
  }
  const Lens lens = lens_of(sensor.camera);
  ExportFile file(path, force);
  std::size_t rows = 0;
  std::array<TagPose, 2> first;
  std::array<Vector3, 2> smooth{};
  const auto& times = reader.frame_times();
  for (record::TrackRecord record; next_whole(reader, record);) {
    if (record.track.status != Status::ok || record.track.corner_count != 2) continue;
    std::array<Vector3, 2> position{};
    std::array<TagPose, 2> pose;
    bool both = true;
    for (std::size_t tag = 0; tag < 2 && both; ++tag) {
      const auto found = pose_of(record.track.corners[tag], sensor, lens);
      both = found.has_value();
      if (both) pose[tag] = *found;
    }
    if (!both) continue;
    if (rows++ == 0) first = pose;
    std::string line = fmt::format(
        "Arucotag time, tag1 xyz, tag2 xyz, tag1 rollpitchyaw (xyz), tag2 -- xyz zerod averaged -- "
        "expo weight; {}",
        seconds(record.time, times.front()));
    for (std::size_t tag = 0; tag < 2; ++tag) {
      for (std::size_t i = 0; i < 3; ++i) {
        position[tag][i] = pose[tag].position[i] - first[tag].position[i] - kOffset;
        const double angle = angle_between(first[tag].angles[i], pose[tag].angles[i]);
        smooth[tag][i] = (1 - kWeight) * smooth[tag][i] + kWeight * angle;
      }
    }
    const auto append = [&line](double value) { line += fmt::format("; {}", value); };
    for (const auto* both_tags : {&position, &smooth}) {
      for (const Vector3& of_tag : *both_tags)
        for (const double value : of_tag) append(value);
    }
    for (const auto* both_tags : {&position, &smooth})
      for (std::size_t i = 0; i < 3; ++i) append(0.5 * ((*both_tags)[0][i] + (*both_tags)[1][i]));
    file.add(fmt::format("{};{} \n", line, kWeight));
  }
  if (rows == 0)
    throw ConfigError("{}: the tags were never held in it; there is nothing to export", recording);
  file.finish();
  return rows;
}

std::size_t export_reference(const std::string& recording, const std::string& path, bool force) {
  record::RecordingReader reader(recording, record::IfDamaged::take);
  if (reader.frame_times().empty()) return 0;
  const TimePoint start = reader.frame_times().front();
  std::optional<ExportFile> file;
  std::size_t rows = 0;
  for (record::ReferenceRecord reading; next_whole(reader, reading);) {
    if (reading.axes != 6) continue;
    if (!file) file.emplace(path, force);
    ++rows;
    std::string line =
        fmt::format("Optoforce time, xyz, yawpitchroll; {}", seconds(reading.time, start));
    for (std::size_t i = 0; i < 6; ++i) {
      const double counts = std::isnan(reading.counts[i])
                                ? std::round(reading.value[i] * kCountsPerUnit[i])
                                : reading.counts[i];
      line += fmt::format("; {:.1f}", counts);
    }
    file->add(line + "\n");
  }
  if (file) file->finish();
  return rows;
}

/// PREFIX_arucotagData.csv and, where there is a six-axis reference, PREFIX_optoforceData.csv.
/// Throws ConfigError if the sensor has not two tags or they were never held.
void export_paper(const std::string& recording, const std::string& prefix, bool force) {
  const std::size_t tags = export_tags(recording, prefix + "_arucotagData.csv", force);
  const std::size_t readings = export_reference(recording, prefix + "_optoforceData.csv", force);
  log_info("{} of tags, {}", count_text(tags, "row"),
           readings > 0 ? fmt::format("{} of the reference", readings)
                        : "none of a reference: no six-axis sensor was recorded");
}

// Pictures of a recording, for images:DIR.

constexpr std::size_t kMaxFrames = 1'000'000;  // names have six digits

struct Picture {
  const char* extension;
  std::string header;  ///< before the bytes
  std::vector<std::uint8_t> bytes;
};

/// A file as it was, or the luminance that was decoded, with nothing where there is none.
Picture picture_of(const RawFrame& raw, const Frame& frame) {
  if (raw.fourcc == fourcc("MJPG") || raw.fourcc == fourcc("PNG ") ||
      raw.fourcc == fourcc("PGM ")) {
    const char* extension = raw.fourcc == fourcc("MJPG")   ? ".jpg"
                            : raw.fourcc == fourcc("PNG ") ? ".png"
                                                           : ".pgm";
    return {extension, {}, {raw.bytes.begin(), raw.bytes.end()}};
  }
  const ImageView& image = frame.image;
  const Region part = frame.readable();
  Picture picture{".pgm", fmt::format("P5\n{} {}\n255\n", image.width, image.height), {}};
  picture.bytes.resize(static_cast<std::size_t>(image.width) *
                       static_cast<std::size_t>(image.height));
  for (int y = part.y; y < part.y + part.height; ++y) {
    std::copy_n(image.pixels + static_cast<std::ptrdiff_t>(y) * image.stride + part.x, part.width,
                picture.bytes.begin() + static_cast<std::ptrdiff_t>(y) * image.width + part.x);
  }
  return picture;
}

/// "build/frames/" has no name that another one could be made of.
fs::path without_slash(const std::string& folder) {
  const fs::path path = fs::path(folder).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

/// JPEG, PNG and PGM files come out as they went in, everything else as PGM. Throws ConfigError if
/// the folder is there and not empty.
void export_frames(const ExportOptions& o) {
  const std::string& recording = o.recording;
  const std::string& folder = o.frames;
  RecordingSource source(
      std::make_unique<record::RecordingReader>(recording, record::IfDamaged::take), /*fast=*/true);
  const record::Head& head = source.recording().head();
  const fs::path place = without_slash(folder);
  std::error_code error;
  if (fs::exists(place, error) && !(fs::is_directory(place, error) && fs::is_empty(place, error)))
    throw ConfigError("{}: exists; give --frames an empty or a new folder", folder);
  NewFolder files(place);
  std::string times = "file,t_ns\n";
  std::size_t count = 0;
  Frame frame;
  for (ReadStatus status; (status = source.read(frame)) != ReadStatus::end;) {
    if (status != ReadStatus::frame) continue;
    if (count == kMaxFrames)
      throw ConfigError("{}: has more than {} frames", recording, kMaxFrames);
    source.complete(frame);
    const Picture picture = picture_of(source.raw(), frame);
    const std::string name = fmt::format("{:06}{}", count++, picture.extension);
    files.add(name, picture.header, picture.bytes);
    times += fmt::format("{},{}\n", name, frame.capture_time.time_since_epoch().count());
  }
  check_whole(source, if_damaged(o.despite_damage));
  files.add("frames.csv", times);
  write_recorded_sensor(head, files.temporary());
  files.take_the_name();
  log_info("{} in {}{}", count_text(static_cast<std::uint64_t>(count), "frame"), folder,
           head.keep == record::Keep::region
               ? ", black where nothing was kept: replay the recording itself for samples"
               : "");
  if (const std::string unusable = source.unusable(); !unusable.empty()) log_info(unusable);
}

int export_all(const ExportOptions& o) {
  if (o.csv.empty() && o.paper.empty() && o.frames.empty() && o.references.empty() &&
      o.events.empty()) {
    throw ConfigError(
        "export: nothing was asked for; give --csv, --paper, --frames, --references or --events");
  }
  if (const record::RecordingReader reader(o.recording, if_damaged(o.despite_damage));
      !reader.unclosed().empty())
    log_info("{} {}", o.recording, reader.unclosed());
  if (!o.frames.empty()) export_frames(o);  // first: it may find that pixels are damaged
  LineBuffer line{};
  export_rows<Sample>(o, o.csv, kCsvHeader, "sample",
                      [&](const Sample& sample) { return csv_line(line, sample); });
  export_rows<record::ReferenceRecord>(o, o.references, reference_header(), "reading",
                                       reference_line);
  export_rows<record::EventRecord>(o, o.events, "id,t_ns,kind,step,value,text\n", "event",
                                   event_line);
  if (!o.paper.empty()) export_paper(o.recording, o.paper, o.force);
  return 0;
}

}  // namespace

void export_command(command_line::Command program) {
  const auto o = std::make_shared<ExportOptions>();
  auto verb =
      program.add_subcommand("export", "a recording's samples, frames and readings, in files");
  verb.add_option("recording", o->recording, "what `tagwrench record --out` made").required();
  verb.add_option("--csv", o->csv, "its samples, in the columns of --output csv:FILE");
  verb.add_option("--paper", o->paper,
                  "PREFIX_arucotagData.csv and PREFIX_optoforceData.csv, in the columns of\n"
                  "Ouyang and Howe's program (ICRA 2020)");
  verb.add_option("--frames", o->frames, "a folder for --source images:DIR");
  verb.add_option("--references", o->references, "readings of load cells and six-axis sensors");
  verb.add_option("--events", o->events, "marks, notes, news of the board, as CSV");
  verb.add_flag("--force", o->force, "files that exist are replaced");
  verb.add_flag(kDespiteDamage, o->despite_damage, kDespiteDamageHelp);
  verb.runs([o] { return export_all(*o); });
}

}  // namespace tagwrench
